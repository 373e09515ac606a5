"""numba's type of a number that stands for several booms: one value a lane, all in one vector register.

Arrays and records of `compiler.lanes.LANE` are to kernels arrays and records of `Lanes`, so that the same functions are
compiled for one boom and for several side by side. Arithmetic is by lane, and rounds as that of one number. A comparison gives
a `Mask`, which is no condition of a branch and does not compile as one: ask whether it holds in `some` lane, or `select` by it.
"""

from __future__ import annotations

import math
import operator
from functools import cache, reduce
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils
from numba.core.compiler_lock import global_compiler_lock
from numba.core.imputils import lower_builtin, lower_cast, lower_getattr
from numba.core.registry import cpu_target
from numba.core.typeconv import Conversion
from numba.core.types import Array, Boolean, Float, Integer, Number, Record, Type, boolean, float64
from numba.core.typing import signature
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global
from numba.extending import intrinsic, models, register_model

from .jit import LANES


class Lanes(Type):
    """`width` numbers of double precision, one for each boom."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(f"lanes{width}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """A number is one that all lanes share."""
        return Conversion.safe if isinstance(other, (Number, Boolean)) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Return lanes if `other` is a number, else None."""
        return self if isinstance(other, Number) else None


class Mask(Type):
    """A truth value for each of `width` lanes."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(f"mask{width}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """A truth value is one that all lanes share."""
        return Conversion.safe if isinstance(other, Boolean) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Return a mask if `other` is a truth value, else None."""
        return self if isinstance(other, Boolean) else None


class LanedRecord(Record):
    """A record with `Lanes` among its fields."""

    @property
    def dtype(self) -> Any:
        """Type of plain bytes, for numpy has no numbers like these."""
        return np.dtype((np.void, self.size))


register_model(LanedRecord)(models.RecordModel)


@register_model(Lanes)
class LanesModel(models.PrimitiveModel):
    """A vector."""

    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, ir.VectorType(ir.DoubleType(), kind.width))


@register_model(Mask)
class MaskModel(models.PrimitiveModel):
    """A vector of bits."""

    def __init__(self, manager: Any, kind: Mask) -> None:
        super().__init__(manager, kind, ir.VectorType(ir.IntType(1), kind.width))


@cache
def install() -> None:
    """Tell numba of what is registered here: it loads SciPy's BLAS for that, which a start without lanes does not need.

    Under numba's lock: two threads that meet the first lanes at once would take each other's registrations away.
    """
    with global_compiler_lock:
        cpu_target.typing_context.refresh()
        cpu_target.target_context.refresh()


def laned(kind: Any) -> Any:
    """A type with `Lanes` in place of the records that numba takes them for."""
    if isinstance(kind, Array):
        dtype = laned(kind.dtype)
        return kind if dtype is kind.dtype else kind.copy(dtype=dtype)
    if not isinstance(kind, Record):
        return kind
    if list(kind.fields) == [LANES]:
        install()
        numbers: Any = kind.fields[LANES].type
        return Lanes(numbers.shape[0])
    types = {name: laned(field.type) for name, field in kind.fields.items()}
    if all(types[name] is field.type for name, field in kind.fields.items()):
        return kind
    fields: Any = [(name, field._replace(type=types[name])._asdict()) for name, field in kind.fields.items()]
    return LanedRecord(fields, kind.size, kind.aligned)


def spread(builder: Any, value: Any, width: int) -> Any:
    """A vector of `value` in every lane."""
    kind = ir.VectorType(value.type, width)
    undefined, first = ir.Constant(kind, ir.Undefined), ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
    return builder.shuffle_vector(builder.insert_element(undefined, value, ir.IntType(32)(0)), undefined, first)


@lower_cast(Float, Lanes)
@lower_cast(Integer, Lanes)
@lower_cast(Boolean, Lanes)
def lanes_of_number(context: Any, builder: Any, kind: Any, to: Lanes, value: Any) -> Any:
    """The number in every lane."""
    return spread(builder, context.cast(builder, value, kind, float64), to.width)


@lower_cast(Boolean, Mask)
def mask_of_truth(context: Any, builder: Any, kind: Any, to: Mask, value: Any) -> Any:
    """The truth value in every lane."""
    return spread(builder, value, to.width)


def _lanes_among(kinds: Any, of: type, others: Any) -> Any:
    """The type `of` among `kinds` if the rest of them are `others`."""
    found = [kind for kind in kinds if isinstance(kind, of)]
    return found[0] if found and all(isinstance(kind, (of, *others)) for kind in kinds) else None


def _let(function: Any, count: int, lower: Any, takes: type = Lanes, gives: type = Lanes, also: Any = ()) -> None:
    """Let kernels call `function`, and what does the same `also`, with so many arguments, some of them of the type `takes`."""

    class Template(AbstractTemplate):
        key = function

        def generic(self, arguments: Any, keywords: Any) -> Any:
            others = (Boolean,) if takes is Mask else (Number,)
            if len(arguments) != count or (kind := _lanes_among(arguments, takes, others)) is None:
                return None
            return signature(gives(kind.width), *[kind] * count)

    def implement(context: Any, builder: Any, of: Any, values: Any) -> Any:
        return lower(builder, *values)

    for name in (function, *also):
        infer_global(name)(type("Template", (Template,), {"key": name}))
        lower_builtin(name, *[takes] * count)(implement)


def _intrinsic(name: str) -> Any:
    """LLVM's function of that name on vectors."""

    def call(builder: Any, *values: Any) -> Any:
        kind = values[0].type
        to = ir.FunctionType(kind, [kind] * len(values))
        return builder.call(cgutils.get_or_insert_function(builder.module, to, f"{name}.v{kind.count}f64"), values)

    return call


def _lane_by_lane(name: str) -> Any:
    """The library's function of that name, called for each lane."""

    def call(builder: Any, *values: Any) -> Any:
        kind, number = values[0].type, ir.DoubleType()
        function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(number, [number] * len(values)), name)
        found = ir.Constant(kind, ir.Undefined)
        for i in range(kind.count):
            at = ir.IntType(32)(i)
            one = builder.call(function, [builder.extract_element(value, at) for value in values])
            found = builder.insert_element(found, one, at)
        return found

    return call


def _compared(predicate: str, unordered: bool = False) -> Any:
    def compare(builder: Any, a: Any, b: Any) -> Any:
        return builder.fcmp_unordered(predicate, a, b) if unordered else builder.fcmp_ordered(predicate, a, b)

    return compare


def _outermost(predicate: str) -> Any:
    """Return a reduction like Python's `max` and `min`: a value replaces the one before if it compares so to it."""

    def reduced(builder: Any, *values: Any) -> Any:
        return reduce(
            lambda so_far, value: builder.select(builder.fcmp_ordered(predicate, value, so_far), value, so_far), values
        )

    return reduced


def _is_finite(builder: Any, value: Any) -> Any:
    size = _intrinsic("llvm.fabs")(builder, value)
    return builder.fcmp_ordered("<", size, ir.Constant(value.type, [math.inf] * value.type.count))


for _sign, _in_place, _name in (
    (operator.add, operator.iadd, "fadd"),
    (operator.sub, operator.isub, "fsub"),
    (operator.mul, operator.imul, "fmul"),
    (operator.truediv, operator.itruediv, "fdiv"),
):
    _let(_sign, 2, lambda builder, a, b, name=_name: getattr(builder, name)(a, b), also=(_in_place,))
for _sign, _name in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">="), (operator.eq, "==")):
    _let(_sign, 2, _compared(_name), gives=Mask)
_let(operator.ne, 2, _compared("!=", unordered=True), gives=Mask)
_let(operator.neg, 1, lambda builder, a: builder.fneg(a))
_let(abs, 1, _intrinsic("llvm.fabs"))
_let(round, 1, _intrinsic("llvm.rint"))
_let(np.floor, 1, _intrinsic("llvm.floor"))
_let(math.sqrt, 1, _intrinsic("llvm.sqrt"))
_let(math.isfinite, 1, _is_finite, gives=Mask)
for _function, _name in ((max, ">"), (min, "<")):
    for _count in (2, 3):
        _let(_function, _count, _outermost(_name))
for _library, _count in ((math.cos, 1), (math.sin, 1), (math.atan2, 2), (math.hypot, 2)):
    _let(_library, _count, _lane_by_lane(_library.__name__))
_let(operator.and_, 2, lambda builder, a, b: builder.and_(a, b), takes=Mask, gives=Mask, also=(operator.iand,))
_let(operator.or_, 2, lambda builder, a, b: builder.or_(a, b), takes=Mask, gives=Mask, also=(operator.ior,))
_let(operator.invert, 1, lambda builder, a: builder.not_(a), takes=Mask, gives=Mask)


@infer_getattr
class LanesAttribute(AttributeTemplate):
    """Attributes that numbers have."""

    key = Lanes

    def resolve_real(self, kind: Lanes) -> Lanes:
        """The real part is all."""
        return kind


@lower_getattr(Lanes, "real")
def real_part(context: Any, builder: Any, kind: Lanes, value: Any) -> Any:
    """The value itself."""
    return value


@intrinsic
def some(_: Any, condition: Any) -> Any:
    """Return True if `condition` holds in any lane."""

    def write(context: Any, builder: Any, of: Any, arguments: Any) -> Any:
        if not isinstance(of.args[0], Mask):
            return arguments[0]
        bits = ir.IntType(of.args[0].width)
        return builder.icmp_unsigned("!=", builder.bitcast(arguments[0], bits), bits(0))

    return boolean(condition), write


@intrinsic
def select(typingctx: Any, condition: Any, a: Any, b: Any) -> Any:
    """`a` where `condition` holds, else `b`."""
    kind = Lanes(condition.width) if isinstance(condition, Mask) else typingctx.unify_types(a, b)

    def write(context: Any, builder: Any, of: Any, arguments: Any) -> Any:
        return builder.select(*arguments)

    return kind(condition, kind, kind), write
