"""Text for people: control characters of received text escaped, plurals, standard streams that may be closed or full."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import TextIO


def printable(text: str, keep: str = "\n\t") -> str:
    r"""Return the text with every unprintable character escaped, as in ``\x1b``.

    Unprintable: control characters, escapes, direction marks and lone surrogates. Characters of `keep` stay unchanged.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep else c.encode("unicode_escape").decode("ascii") for c in text)


def several(number: int, noun: str) -> str:
    """Return a number with its noun, in the plural unless it is 1: ``2 joints``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def open_closed_streams() -> None:
    """Open closed standard streams on the null device. Otherwise a result file would get their number and the printed text."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:  # stderr, the last of the three
        os.set_inheritable(number, True)
    os.close(number)


class PrintableStream:
    """Wrapper of a text `stream` that escapes all written text by `printable`; `name` is that in the OSError of a failed write.

    If the reader of a pipe has ended, or the name is empty, text is dropped and the command continues.
    """

    def __init__(self, stream: TextIO, name: str) -> None:
        self._stream, self._name = stream, name

    def write(self, text: str) -> None:
        """Write the text. Carriage returns are kept, so that progress lines can be overwritten."""
        self._do(lambda: self._stream.write(printable(text, keep="\n\t\r")))

    def flush(self) -> None:
        self._do(self._stream.flush)

    def _do(self, act: Callable[[], object]) -> None:
        try:
            act()
        except OSError as error:
            with suppress(OSError):  # redirect, so that the flush at process exit cannot fail
                os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())
            if self._name and not isinstance(error, BrokenPipeError):
                raise OSError(error.errno, error.strerror, self._name) from None

    def writelines(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)
