"""Check the samples that a program gives the twin: types, shapes, units and stamps, with the remedy in the error."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from reprlib import repr as repr_of
from typing import Any

import numpy as np

from ..errors import UsageError
from ..types import Array, Sample, Stream
from .regular import SHORTEST_STEP

FLOAT = np.dtype(float)
DECIDING = 100  # samples of strokes whose stamps decide if they are nanoseconds
LARGEST_STAMP = 2**63  # ns


class SampleCheck:
    """Check of samples before the twin takes them; `drive` is the stream that drives the model."""

    def __init__(self, channels: Mapping[Stream, tuple[str, ...]], drive: Stream) -> None:
        self._drive = drive
        self._shapes = {stream: (len(names),) for stream, names in channels.items()}
        self._names = {stream: f"{names[0]}..{names[-1]}" for stream, names in channels.items() if names}
        self._count, self._low, self._high = 0, LARGEST_STAMP, -LARGEST_STAMP
        self.is_sure = False

    def checked(self, sample: Sample) -> Sample:
        """Return the sample with an int stamp and contiguous float64 values (channels,); UsageError as of `Twin.update`."""
        stream, stamp, values = sample.stream, sample.stamp, sample.values
        if (
            type(stamp) is int
            and type(values) is np.ndarray
            and values.dtype is FLOAT
            and type(stream) is Stream
            and -LARGEST_STAMP <= stamp < LARGEST_STAMP
            and values.shape == self._shapes[stream]
            and values.flags.carray
        ):
            found = sample
        else:
            stream = _stream(stream)
            found = Sample(stream, _stamp(stamp), self._values(stream, values))
        if not self.is_sure and stream is self._drive:
            self._look(found.stamp)
        return found

    def _look(self, stamp: int) -> None:
        """Raise UsageError if the stamps are too close together to be nanoseconds.

        Stamps that have passed once are not checked again; a single repeated stamp decides nothing.
        """
        self._count += 1
        self._low, self._high = min(self._low, stamp), max(self._high, stamp)
        if self._count < DECIDING or self._low == self._high:
            return
        self.is_sure = self._high - self._low >= self._count * SHORTEST_STEP
        if not self.is_sure:
            first, last, count, self._count = self._low, self._high, self._count, 0
            raise UsageError(
                f"stamps of {count} strokes go from {first} to {last}: less than {SHORTEST_STEP} ns from one to the next. "
                "A stamp is a whole number of nanoseconds: give round(seconds * 1e9)."
            )

    def _values(self, stream: Stream, given: Any) -> Array:
        (count,) = self._shapes[stream]
        try:
            values = np.array(np.ma.filled(given.astype(float), np.nan) if isinstance(given, np.ma.MaskedArray) else given)
            if values.dtype.kind not in "iufO" or values.shape != (count,):
                raise TypeError
            return values.astype(float)
        except (TypeError, ValueError):
            if not count:
                raise UsageError(f"{stream.value}: this boom has no such sensor. Give its place in a mapping.") from None
            wanted = f"{count} numbers, {self._names[stream]} of this boom, NaN where there is none"
            raise UsageError(f"values of {stream.value} are {repr_of(given)}. Give {wanted}.") from None


def _stream(stream: Any) -> Stream:
    if isinstance(stream, Stream):
        return stream
    named = next((each for each in Stream if stream in (each.value, each.name)), Stream.STROKES)
    raise UsageError(f"stream is {repr_of(stream)}, not a Stream. Give Stream.{named.name}.")


def _stamp(stamp: Any) -> int:
    try:
        found = LARGEST_STAMP if isinstance(stamp, bool | np.bool_) else operator.index(stamp)
    except TypeError:
        found = LARGEST_STAMP
    if not -LARGEST_STAMP <= found < LARGEST_STAMP:
        raise UsageError(f"stamp is {repr_of(stamp)}: give a whole number of nanoseconds, 64 bits: round(seconds * 1e9).")
    return found
