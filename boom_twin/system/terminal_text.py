"""Standard streams: escape text of others that would steer a terminal, and bear streams that are closed or full."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import TextIO

STDERR = 2  # number of the last of the three standard streams


def printable(text: str, keep: str = "\n\t") -> str:
    r"""The text with every character that is not printed (controls, escapes, marks of direction, lone surrogates) as ``\x1b``.

    Characters of `keep` stay as they are.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep else c.encode("unicode_escape").decode("ascii") for c in text)


def open_closed_streams() -> None:
    """Open standard streams that the caller has closed: a file of results would get their number, and what is printed."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= STDERR:
        os.set_inheritable(number, True)
    os.close(number)


class PrintableStream:
    """A text stream that writes what `printable` makes of a text; all else is that of the `stream` it writes to.

    Where the reader has gone, the text is dropped: the work goes on, and its exit code says how it went.

    Parameters
    ----------
    stream : TextIO
    name : str
        Stands in the OSError of a stream that cannot be written; empty: its text is dropped then, too.
    """

    def __init__(self, stream: TextIO, name: str) -> None:
        self._stream, self._name = stream, name

    def write(self, text: str) -> None:
        """Write the text; a carriage return stays, for lines that are written over."""
        self._do(lambda: self._stream.write(printable(text, keep="\n\t\r")))

    def flush(self) -> None:
        """Pass on what was written so far."""
        self._do(self._stream.flush)

    def _do(self, act: Callable[[], object]) -> None:
        try:
            act()
        except OSError as error:
            with suppress(OSError):  # nothing may be flushed to it at the exit of the process
                os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())
            if self._name and not isinstance(error, BrokenPipeError):
                raise OSError(error.errno, error.strerror, self._name) from None

    def writelines(self, lines: Iterable[str]) -> None:
        """Write all of them."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)
