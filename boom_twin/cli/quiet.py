"""``--quiet``: what a command tells on the way is left out; warnings and errors stay."""

from __future__ import annotations

from io import TextIOBase
from typing import TextIO

KEPT = ("warning", "boom_twin ", "usage:", "open ")
"""How lines begin that stay; the last one is the address of the live page."""


class QuietStream(TextIOBase):
    """Text stream that passes on only lines that begin with one of `KEPT`.

    Parameters
    ----------
    stream : TextIO
        Where they go.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._begun = stream, ""

    def write(self, text: str) -> int:
        """Take text in; a line is passed on when it is complete."""
        *lines, self._begun = (self._begun + text).replace("\r", "\n").split("\n")
        for line in lines:
            if line.startswith(KEPT):
                self._stream.write(f"{line}\n")
        return len(text)

    def flush(self) -> None:
        """Pass on what was written so far, as far as it is complete."""
        self._stream.flush()
