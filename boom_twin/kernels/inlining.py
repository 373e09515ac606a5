"""Inlining in kernels: a function that runs inside kernels only is copied into each, a kernel is called where it stands.

numba copies every function into each that calls it, with all that is below, optimises and translates it there once more: the
sweep stood in seven kernels, and compiling these copies was two thirds of all compiling.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

from llvmlite.binding import create_pass_builder, create_pipeline_tuning_options
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder  # documented for compilers of one's own
from numba.extending import models, register_model
from numba.types import Dispatcher, unliteral

ABSENT = {"inline_closure_likes", "nopython_rewrites", "inline_inlinables", "inline_overloads"}
"""Passes for closures, expressions of whole arrays, and functions that numba's users inline as Python code."""
LEVEL = 1  # of optimisation; above it compiling takes longer, and steps as long


class Callee(NamedTuple):
    """A compiled kernel that others call: where it is in Python, types of its arguments, and the name of its machine code."""

    module: str
    name: str
    arguments: tuple[Any, ...]
    symbol: str


class CalledKernel(Dispatcher):
    """Type of a kernel that is called. A literal number has its plain type, so that none compiles the kernel once more."""

    def get_call_type(self, context: Any, arguments: Any, named: Any) -> Any:
        """Return the signature for the arguments' types, after compiling for it if need be."""
        return super().get_call_type(context, map(unliteral, arguments), {key: unliteral(each) for key, each in named.items()})


register_model(CalledKernel)(models.OpaqueModel)


class KernelCode(JITCodeLibrary):
    """Code of a kernel: `parts` are the libraries copied into it, `calls` the kernels that it calls.

    The machine code of `calls` must be there before this code is loaded.
    """

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self.calls: set[Callee] = set()
        self.parts: dict[Any, None] = {}  # each after one that calls it, else LLVM leaves it out
        self.enable_object_caching()

    def _optimize_functions(self, ll_module: Any) -> None:
        """Leave each function as it is: what the whole module's passes do comes to the same, and once."""
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """Run one pipeline over the module: loops are vectorised, but not unrolled, for they run three to twenty times.

        numba has three: each function at level 3, all of them for pruning reference counts, of which kernels have none, and
        level 3 again. They made no kernel quicker.
        """
        tuning = create_pipeline_tuning_options(speed_level=LEVEL)
        tuning.loop_vectorization, tuning.slp_vectorization = True, False
        tuning.loop_unrolling = tuning.loop_interleaving = False
        builder = create_pass_builder(self._codegen._tm, tuning)
        builder.getModulePassManager().run(self._final_module, builder)

    def add_linking_library(self, library: Any) -> None:
        """Note a function that is called, with those that it calls itself."""
        if (callee := getattr(library, "callee", None)) is not None:
            self.calls.add(callee)
        else:
            self.calls |= getattr(library, "calls", set())
            self.parts |= {library: None} | getattr(library, "parts", {})

    def finalize(self) -> None:
        """Copy every part into this code once, and compile it."""
        for part in self.parts:
            super().add_linking_library(part)
        super().finalize()


class InlinedCode(KernelCode):
    """Intermediate code of a function alone, for the kernels that it is copied into."""

    def finalize(self) -> None:
        """Leave it as it is: it is copied, optimised and compiled with each kernel."""
        self._finalize_dynamic_globals()
        self._finalized = True

    @property
    def codegen(self) -> InlinedCode:
        """Object in which numba looks for `set_env`."""
        return self

    def set_env(self, name: str, env: Any) -> None:
        """Do nothing, for there is no machine code that would raise an exception with what `env` holds."""

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, for there is no machine code."""
        self._ensure_finalized()
        return 0


class LeanCompiler(CompilerBase):
    """numba's compiler without its passes for what kernels do not have, see `ABSENT`."""

    def define_pipelines(self) -> Any:
        """Return the passes."""
        found = DefaultPassBuilder.define_nopython_pipeline(self.state)
        found.passes = [each for each in found.passes if each[0].name() not in ABSENT]
        return [found]


class KernelCompiler(LeanCompiler):
    """numba's compiler, with `KernelCode` for its result, and the same name for the same function in every process."""

    _owners: ClassVar[dict[tuple[str, str], Callable[..., Any]]] = {}

    def _compile_bytecode(self) -> Any:
        name = self.state.func_id
        if self._owners.setdefault((name.modname, name.func_qualname), name.func) is name.func:
            name.unique_id, name.unique_name = 0, name.func_qualname  # numba counts from 1 in the order of compiling
        self.state.library = KernelCode(self.state.targetctx.codegen(), name.func_qualname)
        first, *others = gc.get_threshold()
        gc.set_threshold(max(first, 100_000))  # looking for cycles among millions of new objects takes a sixth of the time
        try:
            compiled = super()._compile_bytecode()
        finally:
            gc.set_threshold(first, *others)
        symbol = compiled.fndesc.llvm_func_name
        compiled.library.callee = Callee(name.modname, name.func_qualname, compiled.signature.args, symbol)
        return compiled


class InlinedCompiler(LeanCompiler):
    """numba's compiler, with `InlinedCode` for its result."""

    def __init__(self, typingctx: Any, targetctx: Any, library: Any, *arguments: Any) -> None:
        super().__init__(typingctx, targetctx, InlinedCode(targetctx.codegen(), "inlined"), *arguments)
