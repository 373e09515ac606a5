"""Escape text from files and messages that would steer a terminal."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TextIO


def printable(text: str, keep: str = "\n\t") -> str:
    r"""The text with every character that is not printed (controls, escapes, marks of direction, lone surrogates) as ``\x1b``.

    Characters of `keep` stay as they are.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep else c.encode("unicode_escape").decode("ascii") for c in text)


class PrintableStream:
    """A text stream that writes what `printable` makes of a text; all else is that of the `stream` it writes to."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write the text; a carriage return stays, for lines that are written over."""
        self._stream.write(printable(text, keep="\n\t\r"))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write all of them."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)
