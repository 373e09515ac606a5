"""Standard streams: escape text of others that would steer a terminal, and bear streams that are closed or full."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import TextIO

STDERR = 2  # number of the last of the three standard streams


def printable(text: str, keep: str = "\n\t") -> str:
    r"""Return the text with every unprintable character escaped, as in ``\x1b``.

    Unprintable are controls, escapes, marks of direction and lone surrogates. Characters of `keep` are unchanged.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep else c.encode("unicode_escape").decode("ascii") for c in text)


def open_closed_streams() -> None:
    """Open standard streams that the caller has closed. Otherwise a file of results gets their number and the printed text."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= STDERR:
        os.set_inheritable(number, True)
    os.close(number)


class PrintableStream:
    """Text stream that writes texts through `printable` to a `stream`, with all other methods of that stream.

    If the reader has ended, the text is dropped. The work goes on, and its exit code gives the result.

    Parameters
    ----------
    stream : TextIO
    name : str
        Name in the OSError of a stream that cannot be written. If it is empty, the text is dropped then, too.
    """

    def __init__(self, stream: TextIO, name: str) -> None:
        self._stream, self._name = stream, name

    def write(self, text: str) -> None:
        """Write the text. A carriage return is kept, for lines that are written over."""
        self._do(lambda: self._stream.write(printable(text, keep="\n\t\r")))

    def flush(self) -> None:
        """Flush the stream."""
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
        """Write all lines."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)
