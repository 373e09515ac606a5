"""Named tuples that kernels take by reference: one pointer to a table of their fields.

numba hands a named tuple on by value: with a boom's tables, state and work arrays every call of a kernel passed some thousand
numbers, and every function was compiled with them, which was most of the time of compiling. Here the fields are written once
by Python, see `boom_twin.kernels.jit.hold`; kernels pass their address on and read a field where it is used.

A field is never written by a kernel (a named tuple cannot be changed, only what its arrays hold), so loads of fields are
marked as invariant, and the compiler may move them out of loops.
"""

from __future__ import annotations

import hashlib
from typing import Any

from llvmlite import ir
from numba import __version__ as numba_version
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.types import Array, NamedTuple, Type

from .jit import ARRAY, HeldFields, _kind


class Reference(Type):
    """numba's type of a named tuple by reference; `fields` is its type by value."""

    def __init__(self, fields: Any) -> None:
        self.fields = fields
        digest = hashlib.sha256(str(fields).encode()).hexdigest()[:16]
        super().__init__(f"{fields.instance_class.__name__}_{digest}")


@register_model(Reference)
class ReferenceModel(models.PrimitiveModel):
    """An address."""

    def __init__(self, manager: Any, of: Reference) -> None:
        for each in (manager.lookup(kind) for kind in of.fields.types if isinstance(kind, Array)):
            if [each.get_field_position(name) for name in ARRAY] != list(range(len(ARRAY))):
                raise ImportError(f"numba {numba_version} keeps arrays otherwise than the versions that were tested")
        super().__init__(manager, of, manager.lookup(of.fields).get_value_type().as_pointer())


@infer_getattr
class ReferenceAttribute(AttributeTemplate):
    """Types of fields."""

    key = Reference

    def generic_resolve(self, of: Reference, name: str) -> Any:
        """Type of the field `name`; None if there is none."""
        return of.fields[of.fields.fields.index(name)] if name in of.fields.fields else None


@lower_getattr_generic(Reference)
def field_of(context: Any, builder: Any, of: Reference, address: Any, name: str) -> Any:
    """Load a field."""
    return _load(builder, _part(builder, address, of.fields.fields.index(name)))


def _part(builder: Any, address: Any, i: int) -> Any:
    """Emit the address of part `i` of an aggregate."""
    return builder.gep(address, [ir.IntType(32)(0), ir.IntType(32)(i)], inbounds=True)


def _load(builder: Any, address: Any) -> Any:
    """Load a value that nobody changes, number by number: an aggregate would lose the mark."""
    kind = address.type.pointee
    if isinstance(kind, (ir.LiteralStructType, ir.ArrayType)):
        value = ir.Constant(kind, ir.Undefined)
        for i in range(len(kind)):
            value = builder.insert_value(value, _load(builder, _part(builder, address, i)), i)
        return value
    loaded = builder.load(address)
    loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
    return loaded


@unbox(Reference)
def unbox_reference(of: Reference, value: Any, c: Any) -> NativeValue:
    """Take the address of fields that were written before."""
    address = c.builder.bitcast(c.pyapi.long_as_voidptr(value), c.context.get_value_type(of))
    error = c.pyapi.err_occurred()
    return NativeValue(address, is_error=c.builder.icmp_unsigned("!=", error, error.type(None)))


def register(kind: type) -> None:
    """Let kernels take named tuples of this class by reference."""
    types = dict[Any, Reference]()

    @typeof_impl.register(kind)
    def type_of(value: Any, c: Any) -> Reference:
        if (known := _kind(value)) not in types:
            types[known] = Reference(NamedTuple([typeof_impl(field, c) for field in value], kind))
        return types[known]


@typeof_impl.register(HeldFields)
def type_of_held(value: HeldFields, c: Any) -> Any:
    """Return the type of the named tuple itself."""
    if value.type is None:
        value.type = typeof_impl(value.fields, c)
    return value.type
