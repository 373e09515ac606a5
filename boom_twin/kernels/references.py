"""Named tuples that kernels take by reference: one pointer to a table of their fields.

numba hands a named tuple on by value: with a boom's tables, state and work arrays every call of a kernel passed some thousand
numbers, and every function was compiled with them, which was most of the time of compiling. Here the fields are written once,
when Python calls a kernel; kernels pass the address on and read a field where it is used.

A field is never written by a kernel (a named tuple cannot be changed, only what its arrays hold), so loads of fields are
marked as invariant, and the compiler may move them out of loops.
"""

from __future__ import annotations

import hashlib
from typing import Any

from llvmlite import ir
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic
from numba.core.registry import cpu_target
from numba.core.types import NamedTuple, Type  # type: ignore[attr-defined]
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, intrinsic, models, register_model, typeof_impl, unbox


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
    return _load(builder, cgutils.gep_inbounds(builder, address, 0, of.fields.fields.index(name)))


def _load(builder: Any, address: Any) -> Any:
    """Load a value that nobody changes, number by number: an aggregate would lose the mark."""
    kind = address.type.pointee
    if isinstance(kind, (ir.LiteralStructType, ir.ArrayType)):
        value = ir.Constant(kind, ir.Undefined)
        for i in range(len(kind)):
            value = builder.insert_value(value, _load(builder, cgutils.gep_inbounds(builder, address, 0, i)), i)
        return value
    loaded = builder.load(address)
    loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
    return loaded


def _written(builder: Any, address: Any) -> Any:
    """The address, as one that the compiler knows nothing of: no load from it can be moved before what was written there."""
    kind = ir.FunctionType(address.type, [address.type])
    return builder.asm(kind, "", "=r,0,~{memory}", [address], side_effect=True)


@unbox(Reference)
def unbox_reference(of: Reference, value: Any, c: Any) -> NativeValue:
    """Write the fields of a Python tuple where the call can read them."""
    room = cgutils.alloca_once(c.builder, c.context.get_value_type(of.fields))
    failed = cgutils.false_bit
    for i, kind in enumerate(of.fields.types):
        field = c.unbox(kind, c.pyapi.tuple_getitem(value, i))
        c.builder.store(field.value, cgutils.gep_inbounds(c.builder, room, 0, i))
        failed = c.builder.or_(failed, field.is_error)
    return NativeValue(_written(c.builder, room), is_error=failed)


@intrinsic
def referenced(_: Any, fields: Any) -> Any:
    """The named tuple `fields`, made in a kernel, by reference."""

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        room = cgutils.alloca_once(builder, context.get_value_type(fields))
        builder.store(arguments[0], room)
        return _written(builder, room)

    return Reference(fields)(fields), write


def kind_of_referenced() -> Any:
    """numba's type of the function `referenced`."""
    return cpu_target.typing_context.resolve_value_type(referenced)


def register(kind: type) -> None:
    """Let kernels take named tuples of this class by reference."""

    @typeof_impl.register(kind)
    def type_of(value: Any, c: Any) -> Reference:
        return Reference(NamedTuple([typeof_impl(field, c) for field in value], kind))
