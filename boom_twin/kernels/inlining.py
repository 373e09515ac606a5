"""How functions that only run inside kernels are compiled: not optimised and not made machine code on their own."""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class InlinedCode(JITCodeLibrary):
    """Intermediate code of a function and of those that it calls, for the kernels that it is linked into."""

    def _optimize_final_module(self) -> None:
        """The kernel's own optimisation sees it."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    @property
    def codegen(self) -> InlinedCode:
        """Where `set_env` is looked for."""
        return self

    def set_env(self, name: str, env: Any) -> None:
        """There is no machine code that would raise an exception with what `env` holds."""

    def get_pointer_to_function(self, name: str) -> int:
        """0: there is no machine code."""
        self._ensure_finalized()
        return 0


class InlinedCompiler(Compiler):
    """numba's compiler, with `InlinedCode` for its result."""

    def __init__(self, typingctx: Any, targetctx: Any, library: Any, *arguments: Any) -> None:
        super().__init__(typingctx, targetctx, InlinedCode(targetctx.codegen(), "inlined"), *arguments)
