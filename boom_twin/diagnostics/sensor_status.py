"""Statistics and status of the sensors of a stream: readings that arrive, and alarms of `boom_twin.health`."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from math import isnan, nan

import numpy as np
from numpy.typing import NDArray

from ..types import NANO, SENSORS, Array, Sample, Stream
from .levels import Bounds, ComponentJudge, Level, Status


@dataclass(frozen=True, slots=True)
class ChannelStats:
    """Statistics of one sensor since the last look."""

    value: float  # newest reading, in the sensor's unit; NaN before the first one
    stamp: int  # stamp of `value`, ns; 0 before the first one
    rate: float  # readings a second, by their stamps; NaN if fewer than two
    gap: float  # longest step between their stamps, s
    gaps: int  # steps longer than permitted, since listening began
    missing: float  # share of the messages without a finite value; NaN without messages


class Channel:
    """Computation of the statistics of one sensor."""

    def __init__(self) -> None:
        self._value, self._stamp, self._gaps = nan, 0, 0

    def look(self, stamps: NDArray[np.int64], values: Array, refused: int, longest: float) -> ChannelStats:
        """Return the statistics of `values` (k,) with `stamps` (k,) in ns; NaN where the message had no value.

        `refused` further messages had no usable value; `longest` (s) is the largest permitted step of stamps.
        """
        longest_pause = 10.0  # longest step of stamps (s) that is a pause of the sensor; a longer one is a jump of its clock
        messages, usable = len(values) + refused, np.isfinite(values)
        stamps, values, steps = stamps[usable], values[usable], np.zeros(0)
        if len(values):
            steps = np.diff(stamps, prepend=self._stamp or stamps[0]) * NANO
            steps = steps[(steps > 0.0) & (steps <= longest_pause)]
            self._value, self._stamp = float(values[-1]), int(stamps[-1])
        total = float(steps.sum())
        self._gaps += int(np.count_nonzero(steps > longest))
        return ChannelStats(
            value=self._value,
            stamp=self._stamp,
            rate=len(steps) / total if total > 0.0 else nan,
            gap=float(steps.max(initial=0.0)),
            gaps=self._gaps,
            missing=1.0 - len(values) / messages if messages else nan,
        )


class StreamWatch:
    """Statistics of one stream, computed when `look` is called. Times are in s, stamps in ns.

    `lag` is the least time from stamp to arrival between the last two looks, s; NaN without messages. It contains an unknown
    clock offset. The difference of two streams' lags is the offset between their clocks.
    """

    def __init__(self, sensors: int, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._sensors, self._monotonic = sensors, monotonic
        self.count = 0  # messages, since the beginning
        self.begin()

    def begin(self) -> None:
        """Start listening; reset everything but the count."""
        self.newest: int | None = None
        self._heard, self._looked_count, self._least, self.lag = self._monotonic(), self.count, nan, nan
        self._counted = nan, 0
        self._channels = [Channel() for _ in range(self._sensors)]
        self._samples: list[tuple[int, Array]] = []  # stamps (ns) and values since the last look

    def seen(self, stamp: int) -> None:
        self.count += 1
        self.newest = stamp
        self._heard = now = self._monotonic()
        lag = now - stamp * NANO
        if not lag >= self._least:
            self._least = lag

    def took(self, sample: Sample) -> None:
        """Take the sample of a message. A refused message has none."""
        self._samples.append((sample.stamp, np.array(sample.values)))

    def age(self, now: float) -> float:
        """Return the time since the last message, or since listening began."""
        return now - self._heard

    def age_of(self, stats: ChannelStats, now: float) -> float:
        """Return the time since a channel's last reading, or since listening began.

        Up to the newest message, time is taken from stamps.
        """
        if self.newest is None or not stats.stamp:
            return self.age(now)
        return self.age(now) + max(0, self.newest - stats.stamp) * NANO

    def arrival_rate(self, now: float) -> float:
        """Return the messages a second since the last call; NaN at the first."""
        (time, count), self._counted = self._counted, (now, self.count)
        return (self.count - count) / (now - time) if now > time else nan

    def look(self, longest: float) -> list[ChannelStats]:
        """Return the statistics of every channel since the last look; `longest` (s) is the largest permitted step of stamps."""
        stamps = np.array([stamp for stamp, _ in self._samples], np.int64)
        table = np.array([values for _, values in self._samples], float).reshape(len(stamps), self._sensors)
        self._samples = []
        refused = max(0, self.count - self._looked_count - len(stamps))
        self._looked_count = self.count
        self.lag, self._least = self._least, nan
        return [channel.look(stamps, table[:, i], refused, longest) for i, channel in enumerate(self._channels)]


SLOW = 2.0  # largest step of stamps that is no gap at any rate, in sampling periods


@dataclass(frozen=True, slots=True)
class SensorSpec:
    """Specification of a sensor: channel, and unit as suffix of a key (``m_s2``)."""

    name: str
    unit: str
    required: bool = True


def sensors_of(joints: int, required: Mapping[Stream, bool], absent: Collection[str] = ()) -> dict[Stream, list[SensorSpec]]:
    """Return the sensors of every stream, in the order of a sample's values.

    `required` has the inputs that the twin reads, True if it needs them. `absent` are channels without a sensor.
    """
    found = {}
    for stream, kind in SENSORS.items():
        is_required = required.get(Stream(kind.beside or stream))
        if is_required is not None and not kind.gives:
            needed = is_required and not kind.beside
            channels = kind.channels(joints)
            found[stream] = [SensorSpec(name, kind.unit_suffix, needed and name not in absent) for name in channels]
    return found


def sensor_status(
    judge: ComponentJudge, sensor: SensorSpec, stats: ChannelStats, age: float, alarm: tuple[Level, str] | None
) -> Status:
    """Return the status of a sensor by its statistics, the `age` (s) of its last reading, and its active `alarm`, if any."""
    thresholds, unit = judge.at.thresholds, sensor.unit
    if not stats.stamp and not sensor.required and isnan(stats.missing):  # no message, not even one that is left out
        return judge.finish("absent; optional")
    judge.note({f"value_{unit}": stats.value, "rate_Hz": stats.rate})
    judge.check_age(age, "no reading" if stats.stamp else "no reading yet")
    period = 0.0 if isnan(stats.rate) or stats.rate == 0.0 else 1.0 / stats.rate
    gap = Bounds(max(thresholds.gap_warn, SLOW * period))
    judge.check("gap_s", stats.gap, gap, "gap between readings", at_once=True)
    judge.note({"gaps": stats.gaps})
    share = Bounds(thresholds.unusable_warn, thresholds.unusable_error)
    judge.check("missing_share", stats.missing, share, "messages without a value")
    if alarm is not None:
        judge.fault(*alarm)
    return judge.finish("measuring" if stats.stamp else "waiting for a reading")
