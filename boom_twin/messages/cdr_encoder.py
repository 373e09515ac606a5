"""Encode ROS messages as CDR from templates whose numbers are filled in."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..twin.blocks import Integers
from ..types import SECOND, Array
from .encoded_block import Bytes
from .message_fields import FRAME, fill_header
from .type_store import jazzy

ORIGIN = 4
"""Bytes of encapsulation, from after which CDR aligns."""
STAMP = 1_365_991_213
"""Seconds that stand for the stamp, in every header of a message."""

_TIME = struct.Struct("<iI")
_DOUBLE, _SINGLE = 0x7E37_E43C_8800_0000, 0x7E96_7600
"""Bits of the first placeholder of either width, about 1e300 and 1e38; the next ones count up. No constant comes near them."""


class NumberFields:
    """Source of placeholders for the numbers of a template, each unique."""

    def __init__(self) -> None:
        self.doubles = self.singles = 0

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


class Template:
    """Encoded message with places for stamps and numbers.

    Parameters
    ----------
    type_name : str
    msg : message of rosbags
        Message whose numbers are constants or from `fields`, and whose stamps are `STAMP` s.
    fields : NumberFields
        Placeholders in `msg`.

    Attributes
    ----------
    size : int
        Size of a message, bytes.
    double_places, stamp_places : ndarray of int64
        Index of every field among the doubles, and of every stamp among the words of four bytes, after the encapsulation.
    """

    def __init__(self, type_name: str, msg: Any, fields: NumberFields) -> None:
        self._data = bytearray(jazzy().serialize_cdr(msg, type_name))
        self.size = len(self._data)
        size = self.size - ORIGIN
        words = np.frombuffer(self._data, "<i4", size // 4, ORIGIN)
        self._singles, self._doubles = words.view("<f4"), np.frombuffer(self._data, "<f8", size // 8, ORIGIN)
        self.stamp_places = np.flatnonzero(words == STAMP)
        self._stamps = [ORIGIN + 4 * place for place in self.stamp_places.tolist()]
        self._single_places = _places(words, _SINGLE, fields.singles)
        self.double_places = _places(self._doubles.view("<i8"), _DOUBLE, fields.doubles)

    def byte_of(self, double: int) -> int:
        """Return the offset of a field in the message, by its index among the doubles; -1 is the last field."""
        return ORIGIN + 8 * int(self.double_places[double])

    def put_into(self, data: Bytes) -> None:
        """Copy the message, with its placeholders, to the beginning of an array of bytes."""
        data[: self.size] = np.frombuffer(self._data, np.uint8)

    def fill(self, stamp: int, doubles: Array | Sequence[float], singles: Sequence[float] = ()) -> bytes:
        """Return the message with a stamp (ns) in all its headers, and with numbers in the order of the placeholders."""
        time = divmod(stamp, SECOND)
        for place in self._stamps:
            _TIME.pack_into(self._data, place, *time)
        self._doubles[self.double_places] = doubles
        if singles:
            self._singles[self._single_places] = singles
        return bytes(self._data)

    def fill_rows(self, stamps: Integers, doubles: Array | Sequence[Array]) -> Bytes:
        """Return many messages, a row of bytes each, with stamps, shape (k,), and numbers, shape (d, k); see `fill`."""
        rows = np.empty((len(stamps), len(self._data)), np.uint8)
        rows[:] = np.frombuffer(self._data, np.uint8)
        rows[:, ORIGIN : ORIGIN + self._doubles.nbytes].view("<f8")[:, self.double_places] = np.transpose(doubles)
        times = np.column_stack(np.divmod(stamps, SECOND))
        for place in self._stamps:
            rows[:, place : place + _TIME.size].view("<i4")[:] = times
        return rows


def stamped(header: Any, frame: str = FRAME) -> None:
    """Put the placeholder of a stamp, and the frame, into a header."""
    fill_header(header, STAMP * SECOND, frame)


def _places(bits: Any, first: int, count: int) -> Any:
    """Return the indices of the placeholders in their order. Raise ValueError unless each is there once."""
    found = np.flatnonzero((bits >= first) & (bits < first + count))
    places = found[np.argsort(bits[found])]
    if bits[places].tolist() != list(range(first, first + count)):
        raise ValueError(f"{len(places)} of {count} placeholders stand at a place of their own")
    return places
