"""Encode ROS messages as CDR from templates whose numbers are filled in, one by one or in blocks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..types import SECOND, Array, Integers
from .type_store import jazzy

Bytes = NDArray[np.uint8]


class EncodedRows(NamedTuple):
    """Messages of one topic and one length."""

    key: str
    places: Integers  # index of each message in the block; shape (k,)
    data: Bytes  # bytes of each message; contiguous, not empty; shape (k, length)


class EncodedBlock(NamedTuple):
    """Encoded messages in the order of writing."""

    log_times: Integers  # log time of each message, ns; shape (n,)
    rows: list[EncodedRows]  # groups that together have every index from 0 to n - 1 once


class EncodedBlockBuilder:
    """Builder of a block from groups of encoded messages, sorted by their samples."""

    def __init__(self) -> None:
        self._groups: list[tuple[str, Integers, Integers, Bytes]] = []

    def add(self, key: str, at: Integers, turns: Integers | int, data: Bytes) -> None:
        """Add messages of one topic and one length for the samples in rows `at`. `turns` is their order within a sample."""
        if len(at):
            self._groups.append((key, at, np.full(len(at), turns), data))

    def add_one(self, key: str, at: int, turn: int, data: bytes) -> None:
        self.add(key, np.array([at]), turn, np.frombuffer(data, np.uint8)[np.newaxis])

    def block(self, stamps: Integers) -> EncodedBlock:
        """Return the block of all messages. Log times are the stamps (ns) of the samples."""
        if not self._groups:
            return EncodedBlock(stamps[:0], [])
        at, turns = (np.concatenate([group[column] for group in self._groups]) for column in (1, 2))
        order = np.lexsort((turns, at))
        places = np.empty(len(order), np.int64)
        places[order] = np.arange(len(order))
        ends = np.cumsum([len(group[1]) for group in self._groups])
        parts = np.split(places, ends[:-1])
        rows = [EncodedRows(group[0], part, group[3]) for group, part in zip(self._groups, parts, strict=True)]
        return EncodedBlock(stamps[at[order]], rows)


ORIGIN = 4  # bytes of encapsulation, from after which CDR aligns
STAMP = 1_365_991_213  # seconds that stand for the stamp, in every header of a message

_DOUBLE, _SINGLE = 0x7E37_E43C_8800_0000, 0x7E96_7600
"""Bits of the first placeholder of either width, about 1e300 and 1e38; the next ones count up. No constant comes near them."""


class NumberFields:
    """Source of placeholders for the numbers of a template, each unique. `names` are in the order of the named ones."""

    def __init__(self) -> None:
        self.doubles = self.singles = 0
        self.names: list[str] = []

    def double(self) -> float:
        """Return the next placeholder of a ``float64``."""
        self.doubles += 1
        return float(np.uint64(_DOUBLE + self.doubles - 1).view(np.float64))

    def single(self) -> float:
        """Return the next placeholder of a ``float32``."""
        self.singles += 1
        return float(np.uint32(_SINGLE + self.singles - 1).view(np.float32))

    def row(self, count: int) -> list[float]:
        """Return the next `count` placeholders of ``float64``."""
        return [self.double() for _ in range(count)]

    def named(self, *names: str) -> list[float]:
        """Return the next placeholders of ``float64``, for numbers with these names."""
        self.names += names
        return self.row(len(names))


class Template:
    """One or more encoded messages with places for stamps and numbers, filled together.

    Each message comes with its type. Its numbers are constants or from `fields`, and its stamps are `STAMP` s. `double_places`
    are the indices of the fields among the doubles after the first encapsulation. `names` are those of `fields`.
    """

    def __init__(self, messages: Sequence[tuple[str, Any]], fields: NumberFields) -> None:
        data, self._spans, self.names = bytearray(), list[slice](), fields.names
        for type_name, msg in messages:
            encoded = bytes(jazzy().serialize_cdr(msg, type_name))
            self._spans.append(slice(len(data), len(data) + len(encoded)))
            data += encoded + bytes(-len(encoded) % 8)
        data += bytes(ORIGIN)  # so that a whole number of doubles follows the first encapsulation
        self._blank = np.frombuffer(bytes(data), np.uint8)
        words, doubles = (self._blank[ORIGIN:].view(kind) for kind in ("<i4", "<i8"))
        seconds = np.flatnonzero(words == STAMP)
        self._stamp_places, self._stamp_parts = np.concatenate([seconds, seconds + 1]), np.repeat([0, 1], len(seconds))
        self._single_places = _places(words, _SINGLE, fields.singles)
        self.double_places = _places(doubles, _DOUBLE, fields.doubles)

    def byte_of(self, double: int) -> int:
        """Return the offset of a field in the first message, by its index among the doubles; -1 is the last field."""
        return ORIGIN + 8 * int(self.double_places[double])

    def fill(self, stamps: Integers, doubles: Array, singles: Array | None = None) -> list[Bytes]:
        """Return the bytes of each message, a row for each of the stamps.

        `doubles` (k, d) and `singles` (k, s), of ``float32``, are in the order of their placeholders.
        """
        rows = np.empty((len(stamps), len(self._blank)), np.uint8)
        rows[:] = self._blank
        body = rows[:, ORIGIN:]
        body.view("<f8")[:, self.double_places] = doubles
        times = np.array(np.divmod(stamps, SECOND))
        body.view("<i4")[:, self._stamp_places] = times[self._stamp_parts].T
        if singles is not None:
            body.view("<f4")[:, self._single_places] = singles
        return [rows[:, span] for span in self._spans]


def _places(bits: Any, first: int, count: int) -> Any:
    """Return the indices of the placeholders in their order. Raise ValueError unless each is there once."""
    found = np.flatnonzero((bits >= first) & (bits < first + count))
    places = found[np.argsort(bits[found])]
    if bits[places].tolist() != list(range(first, first + count)):
        raise ValueError(f"{len(places)} of {count} placeholders stand at a place of their own")
    return places
