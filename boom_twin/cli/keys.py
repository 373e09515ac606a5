"""Keys pressed in a terminal, without waiting for them."""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from types import TracebackType
from typing import Any, Self


class Keys:
    """Use it as a context; it gives no keys where stdin is no terminal, or that of another program.

    Leaving the context gives the terminal back as it was.
    """

    def __init__(self) -> None:
        self._before: list[Any] | None = None

    def __enter__(self) -> Self:
        if _is_ours():
            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin, termios.TCSADRAIN)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None and _is_ours():
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)

    @property
    def are_read(self) -> bool:
        """Whether there is a terminal."""
        return self._before is not None

    def pressed(self) -> str:
        """The keys since the last call."""
        if self._before is None or not _is_ours() or not select.select([sys.stdin], [], [], 0.0)[0]:
            return ""
        return os.read(sys.stdin.fileno(), 100).decode(errors="replace")


def _is_ours() -> bool:
    """Whether stdin is a terminal and this process in its foreground."""
    try:
        if not sys.stdin.isatty():
            return False
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except (OSError, ValueError, AttributeError):  # no controlling terminal; stdin closed
        return sys.stdin is not None and not sys.stdin.closed and sys.stdin.isatty()
