"""Samples from a user's program: readings by name; checks of types, shapes, units and stamps, with remedies."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from reprlib import repr as repr_of
from typing import Any

import numpy as np

from ..errors import UsageError
from ..types import SENSORS, Array, Report, Sample, Stream, channels_of, stream_of
from .state import SHORTEST_STEP

FLOAT = np.dtype(float)
DECIDING = 100  # samples of strokes whose stamps decide if they are nanoseconds
LARGEST_STAMP = 2**63  # ns


class SampleCheck:
    """Check of samples before the twin takes them.

    `drive` is the stream that drives the model. Its first stamps show if they are nanoseconds.
    """

    def __init__(self, channels: Mapping[Stream, tuple[str, ...]], drive: Stream) -> None:
        self._drive = drive
        self._shapes = {stream: (len(names),) for stream, names in channels.items()}
        self._names = {stream: f"{names[0]}..{names[-1]}" for stream, names in channels.items() if names}
        self._count, self._low, self._high = 0, LARGEST_STAMP, -LARGEST_STAMP
        self._is_sure = False

    def checked(self, sample: Sample) -> Sample:
        """Return the sample with an int stamp and contiguous float64 values (channels,); UsageError as of `Twin.update`."""
        if not isinstance(sample, Sample):
            raise UsageError(
                f"sample is {repr_of(sample)}. Give Sample(Stream.STROKES, stamp_ns, values), or readings by name."
            )
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
        if stream is self._drive and not self._is_sure:
            self._look(found.stamp)
        return found

    def _look(self, stamp: int) -> None:
        """Raise UsageError if the first `DECIDING` different stamps are too close together to be nanoseconds."""
        self._count += 1
        self._low, self._high = min(self._low, stamp), max(self._high, stamp)
        if self._count < DECIDING or self._low == self._high:
            return
        self._is_sure = self._high - self._low >= self._count * SHORTEST_STEP
        if not self._is_sure:
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


LARGEST = {Stream.STROKES: 20.0, Stream.ANGLES: 50.0, Stream.IMU: 1000.0}
"""SI values beyond which a first reading is in another unit: m, rad, m/s^2."""


def samples_of(readings: Mapping[str, Any], stamp_ns: int | None, joints: int) -> list[Sample]:
    """Return the samples of readings at `stamp_ns`, strokes first; UsageError for names, values or a stamp that cannot be used.

    A reading is a number by the name of a channel (``cylinder_1``, ``joint_2``, ``tip_imu_x``, ``cylinder_force_1``), or all
    of a stream by its name (``cylinder_strokes``, ``joint_angles``, ``tip_imu``, ``cylinder_forces``). SI units; NaN without
    a reading.
    """
    if stamp_ns is None:
        raise UsageError("stamp_ns is not given. Give the time of the readings in ns: stamp_ns=time.time_ns().")
    channels = channels_of(joints)
    streams = {stream.value: stream for stream, names in channels.items() if names}
    found: dict[Stream, Array] = {}
    for name, value in readings.items():
        if (stream := streams.get(name)) is not None:
            shape = (len(channels[stream]),)
            array = _array(name, value, f"{shape[0]} numbers, {channels[stream][0]} .. {channels[stream][-1]}")
            if array.shape != shape:
                raise UsageError(
                    f"{name}: shape {array.shape}, and this boom has {shape[0]} channels there: {', '.join(channels[stream])}."
                )
            found[stream] = array
            continue
        stream = stream_of(str(name))
        if stream is None or name not in channels[stream]:
            known = [*(channel for names in channels.values() for channel in names), *streams]
            near = get_close_matches(str(name), known, n=1, cutoff=0.6)
            remedy = f"Did you mean {near[0]}?" if near else f"Known are {', '.join(known)}."
            raise UsageError(f"{name!r}: no channel of this boom, which has {joints} joints. {remedy}")
        array = _array(name, value, "a number")
        if array.shape != ():
            raise UsageError(f"{name}: shape {array.shape}. Give one number; all channels of a stream go by {stream.value}.")
        found.setdefault(stream, np.full(len(channels[stream]), np.nan))[channels[stream].index(name)] = array
    if not found:
        raise UsageError("no readings are given. Give numbers by name, as {'cylinder_1': 0.63, ..}.")
    return [Sample(stream, stamp_ns, found[stream]) for stream in Stream if stream in found]


def check_units(samples: Sequence[Sample]) -> None:
    """Raise UsageError for first readings that can only be in another unit."""
    for sample in samples:
        kind, largest = SENSORS[sample.stream], LARGEST.get(sample.stream, np.inf)
        if np.isfinite(sample.values).any() and np.nanmin(np.abs(sample.values)) > largest:
            told = f"{sample.stream.value}: {repr_of(sample.values.tolist())}, all above {largest:g} {kind.unit}"
            raise UsageError(f"{told}. Give SI units: {kind.unit}.")


def merged(reports: Sequence[Report]) -> Report:
    """Return one report of samples with one stamp: predictions of the strokes, residuals and events of all."""
    last: dict[str, Any] = {}
    for report in reports:
        own = {name: getattr(report, name) for name in ("prediction", "estimate", "change", "health")}
        last |= {name: value for name, value in own.items() if value is not None}
    return replace(
        reports[-1],
        accepted=all(report.accepted for report in reports),
        residuals=tuple(row for report in reports for row in report.residuals),
        events=tuple(dict.fromkeys(event for report in reports for event in report.events)),
        status=next((report.status for report in reports if report.status != "ok"), "ok"),
        **last,
    )


def _array(name: str, value: Any, wanted: str) -> Array:
    try:
        array = np.asarray(np.nan if value is None else value)
        if array.dtype.kind not in "iuf":
            raise TypeError
    except (TypeError, ValueError):
        raise UsageError(f"{name} is {repr_of(value)}. Give {wanted}, NaN where there is none.") from None
    return array.astype(float)
