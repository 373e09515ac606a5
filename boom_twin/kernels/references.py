"""numba's type of the named tuples that kernels take by reference: one pointer to a table of their fields.

numba hands a named tuple on by value: with a boom's tables, state and work arrays every call of a kernel passed some thousand
numbers, and every function was compiled with them, which was most of the time of compiling. Here Python writes the fields
once, see `boom_twin.kernels.jit.Referenced`. Kernels pass the address on and read a field where it is used.

A field is never written by a kernel (a named tuple cannot be changed, only what its arrays hold), so loads of fields are
marked as invariant, and the compiler may move them out of loops.
"""

from __future__ import annotations

import hashlib
from typing import Any

from numba import __version__ as numba_version
from numba.extending import NativeValue, lower_getattr_generic, models, register_model, typeof_impl, unbox
from numba.types import Array, BaseTuple, NamedTuple, intp

from .jit import ARRAY, Referenced


class Reference(NamedTuple):
    """Type of a named tuple by reference. Its fields have the types of one by value; `places` is where each begins."""

    def __init__(self, types: list[Any], kind: type) -> None:
        super().__init__(types, kind)
        words = [_words(each) for each in types]
        self.places = [sum(words[:i]) for i in range(len(words))]
        digest = hashlib.sha256(str(types).encode()).hexdigest()[:16]
        self.name = f"{kind.__name__}_{digest}"  # a part of the name of machine code

    @property
    def key(self) -> str:
        """Name instead of all types of fields, by which numba would tell types apart in every look-up while it compiles."""
        return self.name


def _words(kind: Any) -> int:
    """Return the words of the table that a value takes."""
    if isinstance(kind, BaseTuple) and not isinstance(kind, Reference):
        return sum(map(_words, kind))
    return len(ARRAY) - 2 + 2 * kind.ndim if isinstance(kind, Array) else 1


@register_model(Reference)
class ReferenceModel(models.PrimitiveModel):
    """An address of words."""

    def __init__(self, manager: Any, of: Reference) -> None:
        for each in (manager.lookup(kind) for kind in of.types if isinstance(kind, Array)):
            if [each.get_field_position(name) for name in ARRAY] != list(range(len(ARRAY))):
                raise ImportError(f"numba {numba_version} keeps arrays otherwise than the versions that were tested")
        super().__init__(manager, of, manager.lookup(intp).get_value_type().as_pointer())


@lower_getattr_generic(Reference)
def field_of(context: Any, builder: Any, of: Reference, address: Any, name: str) -> Any:
    """Load a field."""
    i = of.fields.index(name)
    return _load(context, builder, of.types[i], address, of.places[i])


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
    if isinstance(kind, BaseTuple) and not isinstance(kind, Reference):
        value = context.get_constant_null(kind)
        for i, part in enumerate(kind):
            value = builder.insert_value(value, _load(context, builder, part, address, place), i)
            place += _words(part)
        return value
    return word(0, context.get_value_type(kind))


@unbox(Reference)
def unbox_reference(of: Reference, value: Any, c: Any) -> NativeValue:
    """Take the address of the table."""
    number = c.pyapi.object_getattr_string(value, "address")
    is_missing = c.builder.icmp_unsigned("==", number, number.type(None))
    number = c.builder.select(is_missing, c.pyapi.make_none(), number)  # no address can be read of null
    address = c.builder.bitcast(c.pyapi.long_as_voidptr(number), c.context.get_value_type(of))
    c.pyapi.decref(number)
    return NativeValue(address, is_error=is_missing)


_TYPES = dict[object, Reference]()  # by `Referenced.layout`


@typeof_impl.register(Referenced)
def type_of(value: Any, c: Any) -> Reference:
    """Return the type of a named tuple by reference."""
    if (found := _TYPES.get(value.layout)) is None:
        found = _TYPES[value.layout] = Reference([typeof_impl(field, c) for field in value], type(value))
    return found
