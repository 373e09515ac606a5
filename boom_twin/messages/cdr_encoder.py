"""Encode ROS messages as CDR from templates whose numbers are filled in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..twin.blocks import Integers
from ..types import SECOND, Array
from .encoded_block import Bytes
from .topic_table import FRAME
from .type_store import fill_header, jazzy

ORIGIN = 4  # bytes of encapsulation, from after which CDR aligns
STAMP = 1_365_991_213  # seconds that stand for the stamp, in every header of a message

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
    """One or more encoded messages with places for stamps and numbers, filled together.

    Parameters
    ----------
    messages : sequence of (str, message of rosbags)
        Type and message. Its numbers are constants or from `fields`, and its stamps are `STAMP` s.

    Attributes
    ----------
    double_places : ndarray of int64
        Index of every field among the doubles after the first encapsulation.
    """

    def __init__(self, messages: Sequence[tuple[str, Any]], fields: NumberFields) -> None:
        data, self._spans = bytearray(), list[slice]()
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

    def fill(self, stamps: Integers, doubles: Array, singles: Sequence[float] = ()) -> list[Bytes]:
        """Return the bytes of each message, a row for each of the stamps.

        Parameters
        ----------
        doubles : ndarray, shape (k, d)
            Numbers in the order of the placeholders.
        singles : sequence of float
            Numbers of ``float32``, the same in every row.
        """
        rows = np.empty((len(stamps), len(self._blank)), np.uint8)
        rows[:] = self._blank
        body = rows[:, ORIGIN:]
        body.view("<f8")[:, self.double_places] = doubles
        times = np.column_stack(np.divmod(stamps, SECOND))
        body.view("<i4")[:, self._stamp_places] = times[:, self._stamp_parts]
        if singles:
            body.view("<f4")[:, self._single_places] = singles
        return [rows[:, span] for span in self._spans]


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
