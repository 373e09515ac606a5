"""Random damage of bytes and of lines of text."""

from __future__ import annotations

from collections.abc import Callable

from numpy.random import Generator


def pick(random: Generator, items: list | tuple) -> object:
    """One of `items`."""
    return items[int(random.integers(len(items)))]


def flipped(random: Generator, data: bytes) -> bytes:
    """One bit is another."""
    if not data:
        return data
    changed = bytearray(data)
    changed[int(random.integers(len(data)))] ^= 1 << int(random.integers(8))
    return bytes(changed)


def cut(random: Generator, data: bytes) -> bytes:
    """The end is missing."""
    return data[: int(random.integers(len(data) + 1))]


def overwritten(random: Generator, data: bytes) -> bytes:
    """A span of zeros, of ones, or of anything."""
    start, size = _span(random, data)
    fill = pick(random, (b"\0" * size, b"\xff" * size, random.bytes(size)))
    return data[:start] + fill + data[start + size :]


def inserted(random: Generator, data: bytes) -> bytes:
    """Some bytes more."""
    start, size = _span(random, data)
    return data[:start] + random.bytes(size) + data[start:]


def removed(random: Generator, data: bytes) -> bytes:
    """Some bytes less."""
    start, size = _span(random, data)
    return data[:start] + data[start + size :]


def repeated(random: Generator, data: bytes) -> bytes:
    """A span stands there twice."""
    start, size = _span(random, data)
    return data[: start + size] + data[start:]


def _span(random: Generator, data: bytes) -> tuple[int, int]:
    return int(random.integers(len(data) + 1)), int(2 ** random.uniform(0, 9))


DAMAGES: tuple[Callable[[Generator, bytes], bytes], ...] = (flipped, cut, overwritten, inserted, removed, repeated)


def damaged(random: Generator, data: bytes) -> bytes:
    """One or two damages."""
    for _ in range(int(random.integers(1, 3))):
        data = pick(random, DAMAGES)(random, data)
    return data


def rearranged(random: Generator, text: str) -> str:
    """A line is missing, twice there, elsewhere, or indented otherwise."""
    lines = text.splitlines(keepends=True)
    if not lines:
        return text
    one, other = (int(random.integers(len(lines))) for _ in range(2))
    how = random.integers(5)
    if how == 0:
        del lines[one]
    elif how == 1:
        lines.insert(other, lines[one])
    elif how == 2:
        lines[one], lines[other] = lines[other], lines[one]
    elif how == 3:
        lines[one] = pick(random, (" ", "  ", "\t", "- ", "# ", "? ")) + lines[one]
    else:
        del lines[min(one, other) : max(one, other)]
    return "".join(lines)
