"""Small arrays on the stack of a kernel.

The compiler knows that such arrays have no alias. So it keeps their values in registers and vectorises.
Arrays that come from Python may overlap, so each write forces the compiler to reload values.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils
from numba.core.registry import cpu_target
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array
from numba.types import Array, intp


def type_of_maker(shape: tuple[int, ...]) -> Any:
    """Return numba's type of a function that makes an array of `shape` with its argument's dtype; see `jit.StackArray`."""
    size = 1
    for length in shape:
        size *= length

    @intrinsic
    def made(_: Any, like: Any) -> Any:
        kind = Array(like.dtype, len(shape), "C")

        def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            number = context.get_data_type(like.dtype)
            with builder.goto_entry_block():
                room = builder.alloca(ir.ArrayType(number, size))
            item, strides = context.get_abi_sizeof(number), []
            for i in range(len(shape)):
                strides.append(item)
                for length in shape[i + 1 :]:
                    strides[-1] *= length
            array = make_array(kind)(context, builder)
            populate_array(
                array,
                data=cgutils.gep_inbounds(builder, room, 0, 0),
                shape=[context.get_constant_generic(builder, intp, n) for n in shape],
                strides=[context.get_constant_generic(builder, intp, n) for n in strides],
                itemsize=context.get_constant_generic(builder, intp, item),
                meminfo=None,
            )
            return array._getvalue()

        return kind(like), write

    cpu_target.typing_context.refresh()
    return cpu_target.typing_context.resolve_value_type(made)
