"""Named tuples that kernels take by reference: one pointer to a table of their fields.

numba hands a named tuple on by value: with a boom's tables, state and work arrays every call of a kernel passed some thousand
numbers, and every function was compiled with them, which was most of the time of compiling. Here the fields are written once,
when Python calls a kernel; kernels pass the address on and read a field where it is used.

A field is never written by a kernel (a named tuple cannot be changed, only what its arrays hold), so loads of fields are
marked as invariant, and the compiler may move them out of loops.

To write the fields is most of what a short call costs: two hundred arrays, each looked at in four places. Where the same tuple
comes with every call they are written once, see `boom_twin.kernels.jit.hold`, and the call gets their address.
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

from .jit import ARRAY, HeldFields

TUPLE_FLAG = 1 << 26  # Py_TPFLAGS_TUPLE_SUBCLASS


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


def _written(builder: Any, address: Any) -> Any:
    """The address, as one that the compiler knows nothing of: no load from it can be moved before what was written there."""
    kind = ir.FunctionType(address.type, [address.type])
    return builder.asm(kind, "", "=r,0,~{memory}", [address], side_effect=True)


@unbox(Reference)
def unbox_reference(of: Reference, value: Any, c: Any) -> NativeValue:
    """Write the fields of a Python tuple where the call can read them, or take the address of what was written before."""
    builder, kind = c.builder, c.context.get_value_type(of.fields)
    with builder.goto_entry_block():
        room, address, failed = map(builder.alloca, (kind, kind.as_pointer(), ir.IntType(1)))
    builder.store(room, address)
    builder.store(ir.IntType(1)(0), failed)
    with builder.if_else(_is_tuple(c, value)) as (is_tuple, is_held):
        with is_tuple:
            for i, each in enumerate(of.fields.types):
                field = c.unbox(each, c.pyapi.tuple_getitem(value, i))
                builder.store(field.value, _part(builder, room, i))
                builder.store(builder.or_(builder.load(failed), field.is_error), failed)
        with is_held:
            builder.store(builder.bitcast(c.pyapi.long_as_voidptr(value), kind.as_pointer()), address)
            error = c.pyapi.err_occurred()
            builder.store(builder.icmp_unsigned("!=", error, error.type(None)), failed)
    return NativeValue(_written(builder, builder.load(address)), is_error=builder.load(failed))


def _is_tuple(c: Any, value: Any) -> Any:
    """Emit the test that a Python object is a tuple, by the flag that Python gives that class and its subclasses."""
    word, module, name = c.pyapi.ulong, c.builder.module, "PyType_GetFlags"
    flags_of = module.globals.get(name) or ir.Function(module, ir.FunctionType(word, [c.pyapi.pyobj]), name)
    kind = c.pyapi.object_type(value)
    flags = c.builder.call(flags_of, [kind])
    c.pyapi.decref(kind)
    return c.builder.icmp_unsigned("!=", c.builder.and_(flags, word(TUPLE_FLAG)), word(0))


def register(kind: type) -> None:
    """Let kernels take named tuples of this class by reference."""

    @typeof_impl.register(kind)
    def type_of(value: Any, c: Any) -> Reference:
        return Reference(NamedTuple([typeof_impl(field, c) for field in value], kind))


@typeof_impl.register(HeldFields)
def type_of_held(value: HeldFields, c: Any) -> Any:
    """Return the type of the named tuple itself."""
    return typeof_impl(value.fields, c)
