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

from numba import __version__ as numba_version
from numba.core.typing.templates import AttributeTemplate  # what the public `infer_getattr` wants
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.types import Array, BaseTuple, NamedTuple, Type, intp

from .jit import ARRAY, HeldFields, _kind


class Reference(Type):
    """numba's type of a named tuple by reference; `fields` is its type by value, `places` where each begins in the table."""

    def __init__(self, fields: Any) -> None:
        self.fields = fields
        words = [_words(kind) for kind in fields.types]
        self.places = [sum(words[:i]) for i in range(len(words))]
        digest = hashlib.sha256(str(fields).encode()).hexdigest()[:16]
        super().__init__(f"{fields.instance_class.__name__}_{digest}")


def _words(kind: Any) -> int:
    """Return how many words of the table a value takes."""
    if isinstance(kind, BaseTuple):
        return sum(map(_words, kind))
    return len(ARRAY) - 2 + 2 * kind.ndim if isinstance(kind, Array) else 1


@register_model(Reference)
class ReferenceModel(models.PrimitiveModel):
    """An address of words."""

    def __init__(self, manager: Any, of: Reference) -> None:
        for each in (manager.lookup(kind) for kind in of.fields.types if isinstance(kind, Array)):
            if [each.get_field_position(name) for name in ARRAY] != list(range(len(ARRAY))):
                raise ImportError(f"numba {numba_version} keeps arrays otherwise than the versions that were tested")
        super().__init__(manager, of, manager.lookup(intp).get_value_type().as_pointer())


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
    i = of.fields.fields.index(name)
    return _load(context, builder, of.fields.types[i], address, of.places[i])


def _load(context: Any, builder: Any, kind: Any, address: Any, place: int) -> Any:
    """Load a value that nobody changes, number by number: an aggregate would lose the mark."""

    def word(i: int, kind: Any) -> Any:
        at = builder.gep(address, [context.get_constant(intp, place + i)], inbounds=True)
        loaded = builder.load(builder.bitcast(at, kind.as_pointer()))
        loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
        return loaded

    if isinstance(kind, Array):  # kernels own no memory: `meminfo` and `parent` stay null
        value = context.get_constant_null(kind)
        *numbers, shape, strides = value.type.elements
        for i in range(2, len(numbers)):
            value = builder.insert_value(value, word(i, numbers[i]), i)
        for axis in range(kind.ndim):
            for part, each in enumerate((shape, strides)):
                loaded = word(len(numbers) + part * kind.ndim + axis, each.element)
                value = builder.insert_value(value, loaded, [len(numbers) + part, axis])
        return value
    if isinstance(kind, BaseTuple):
        value = context.get_constant_null(kind)
        for i, part in enumerate(kind):
            value = builder.insert_value(value, _load(context, builder, part, address, place), i)
            place += _words(part)
        return value
    return word(0, context.get_value_type(kind))


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
