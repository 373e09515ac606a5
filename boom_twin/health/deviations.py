"""Alarms by limits, beside the search for faults: lasting deviations of a stream, a force at the tip, cylinders that creep.

Pumps and wind raise no alarm. A force above the limit is an overload, an obstacle at the tip, or a load that the scene lacks.
A force that the cylinder lengths alone contradict raises none: late or wrong readings of other sensors look like a force.

A creeping cylinder changes its length slowly and evenly, unlike a move by an operator. A leak makes a cylinder creep, and its
joint turns. If the angle sensor shows no turn, the stroke transducer drifts.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..config.settings import Settings
from ..scene.kinematics import strokes_of_angles
from ..scene.schema import Scene
from ..types import NANO, SECOND, SENSORS, Alarm, Array, Ranked, Stream, channels_of
from ..wiring.readings import LONGEST
from .alarms import change_text
from .sensor_check import ENOUGH, WINDOW, Block, SensorCheck

KIND = "deviation"  # kind of all its alarms
SIGMAS = {Stream.ANGLES: 3.0, Stream.FORCES: 10.0}
"""Standard deviations that a mean residual has to exceed, beside its limit. Deviations of forces lack the model error."""
LASTING = round(1.5 * WINDOW / NANO)  # ns, debounce time: in fast motion a mean is off for as long as it is taken over
GONE = 0.5  # share of the limit below which a deviation ends
SETTLED = round(3.0 * WINDOW / NANO)  # ns below that share before it ends: a mean forgets all but 5 %


class DeviationMonitor:
    """Monitor that compares slow means of one stream's residuals with the limits of the settings."""

    def __init__(self, stream: Stream, scene: Scene, settings: Settings) -> None:
        self._stream, self._names = stream, channels_of(len(scene.joints))[stream]
        lengths = np.array([section.length for section in scene.sections])
        self._reach = np.cumsum(lengths[::-1])[::-1] if stream is Stream.ANGLES else None  # m, boom outboard of each joint
        force = np.full(len(self._names), settings.force_deviation)
        self._limits = force if self._reach is None else settings.tip_deviation / self._reach
        self._since, self._seen = np.full((2, len(self._names)), -1)  # ns, of each deviation and of its newest block
        self._last = dict[int, Alarm]()

    @property
    def alarms(self) -> Sequence[Alarm]:
        """Active alarms."""
        return list(self._last.values())

    def take(self, readings: SensorCheck, masked: NDArray[np.bool_], block: Block) -> list[Alarm]:
        """Take a block, without the channels that are `masked`; return the alarms that began or ended."""
        slow, news = readings.slow, list[Alarm]()
        weight = np.maximum(slow.weight, 1e-9)
        off = (slow.read - slow.expected) / weight
        if not self._last and not (np.abs(off) > self._limits).any():
            self._since[:] = -1
            return []
        is_known = np.isfinite(readings.means[0]) & (slow.weight > ENOUGH) & ~masked
        least = np.maximum(self._limits, SIGMAS[self._stream] * np.sqrt(slow.variance / weight))
        is_far, is_near = is_known & (np.abs(off) > least), is_known & (np.abs(off) < GONE * self._limits)
        is_explained = np.abs(off) < LONGEST * np.abs(slow.rate) / weight + least  # by a lag, see `lag_monitor`
        self._since = np.where(is_far, np.where(self._since < 0, block.start, self._since), -1)
        for i in np.flatnonzero(is_far & ~is_explained & (block.end - self._since >= LASTING)).tolist():
            if i not in self._last:
                self._last[i] = Alarm(self._names[i], KIND, int(self._since[i]), None, None, self._evidence(i, off[i]))
                news.append(self._last[i])
        self._seen[~is_near] = block.end
        for i in [*self._last]:
            if masked[i] or block.end - self._seen[i] > SETTLED:
                news.append(replace(self._last.pop(i), until=int(self._seen[i])))
        return news

    def _evidence(self, i: int, off: Array) -> str:
        """Return the deviation of channel `i` in figures."""
        factor, unit = SENSORS[self._stream].shown_unit
        tip = "" if self._reach is None else f", tip {1e3 * abs(off) * self._reach[i]:.0f} mm"
        return change_text(factor * float(off), unit) + tip


CAUSE = "tip.load"
CERTAIN = 3.0  # standard deviations by which a force is above the limit, or contradicts the lengths
AFTER = round(WINDOW / NANO)  # ns from the first passing to a later one that raises the alarm; it ends `SETTLED` after the last


class TipLoadMonitor:
    """Monitor that compares the estimated force at the tip with its `limit` (N); `alarm` is the lasting alarm or None."""

    def __init__(self, limit: float) -> None:
        self._limit = limit
        self.begin()

    def begin(self) -> None:
        """Reset the monitor."""
        self.alarm: Alarm | None = None
        self._since = self._last = 0
        self._largest = 0.0, 0.0

    def take(self, stamp: int, loads: Array, variances: Array) -> list[Alarm]:
        """Take forces (2, 2), predicted and estimated, in N, with variances at `stamp` (ns); return what began or ended."""
        size = max(float((loads[1] @ loads[1]) ** 0.5), 1e-300)
        direction = loads[1] / size
        predicted = float(direction @ loads[0])
        doubt, sigma = ((variances @ direction**2) ** 0.5).tolist()
        if self._since and stamp - self._last > SETTLED:
            ended = [] if self.alarm is None else [replace(self.alarm, until=self._last)]
            self.begin()
            return ended
        if size - CERTAIN * sigma <= self._limit or size > predicted + CERTAIN * doubt:
            return []
        self._since, self._last = self._since or stamp, stamp
        self._largest = max(self._largest, (size, sigma))
        if self.alarm is not None or stamp - self._since < AFTER:
            return []
        size, sigma = self._largest
        evidence = f"{change_text(size, 'N', sigma)}, tip_load_limit {self._limit:g} N"
        ranked = (Ranked(CAUSE, 1.0, (("exceeded", size, sigma, "N"),)),)
        self.alarm = Alarm("tip", "exceeded", self._since, None, CAUSE, evidence, ranked)
        return [self.alarm]


CREEP_SPAN, PARTS = 12, 4  # s of a window, several periods of a pump; equal parts of it whose means are compared
UNEVEN = 0.4  # largest relative difference of the rates between parts, and of the rates by length and by angle
SWING = 1e-3  # m, largest change of a mean length from second to second by pump and wind; short moves change it by more
SLOWEST, FASTEST = 1e-4, 3e-3  # m/s, rates of creeping: above noise, and below the moves of an operator
CREPT = 4e-3  # m, least change of length for an alarm: a softening oil spring changes it by less


class CreepMonitor:
    """Monitor of mean lengths and angles of each second.

    Attributes
    ----------
    creeping : dict of int to int
        Onset (ns) by creeping cylinder (from 0).
    """

    def __init__(self, scene: Scene) -> None:
        self._scene, self.creeping = scene, dict[int, int]()
        self._seconds: deque[tuple[int, Array]] = deque(maxlen=CREEP_SPAN)
        self._alarms: dict[int, Alarm] = {}  # by cylinder

    def take(self, stamp: int, block: Any) -> list[Alarm]:
        """Take the samples of a second that begins at a stamp (ns); return the alarms that end or begin."""
        if self._seconds and stamp - self._seconds[-1][0] != SECOND:
            self._seconds.clear()
        count, codes = len(self._scene.joints), list(Stream)
        both = (block.values[block.streams == codes.index(stream), :count] for stream in (Stream.STROKES, Stream.ANGLES))
        with np.errstate(invalid="ignore"):  # means of no readings are NaN
            lengths, angles = (np.nansum(rows, axis=0) / np.isfinite(rows).sum(axis=0) for rows in both)
        self._seconds.append((stamp, np.stack([lengths, strokes_of_angles(self._scene, angles)])))
        begun = self._begun(stamp + SECOND)
        ended = [replace(self._alarms.pop(i), until=stamp) for i in [*self._alarms] if i not in self.creeping]
        self._alarms |= begun
        return [*ended, *begun.values()]

    def _begun(self, now: int) -> dict[int, Alarm]:
        """Note which cylinders creep up to a stamp (ns); return the alarms of those that are even in the newest window."""
        before, self.creeping, begun = self.creeping, {}, dict[int, Alarm]()
        if len(self._seconds) < CREEP_SPAN:
            return begun
        seconds = np.array([each for _, each in self._seconds])
        parts = seconds.reshape(PARTS, -1, *seconds.shape[1:]).mean(axis=1)
        rates = np.diff(parts[:, 0], axis=0) * PARTS / CREEP_SPAN
        rate, by_angle = (parts[-1] - parts[0]) / (CREEP_SPAN - CREEP_SPAN / PARTS)
        is_slow = (np.abs(rate) > SLOWEST) & (np.abs(rate) < FASTEST) & (np.abs(by_angle - rate) < UNEVEN * np.abs(rate))
        is_slow &= (np.abs(np.diff(seconds[:, 0], axis=0) - rate) < UNEVEN * np.abs(rate) + SWING).all(axis=0)
        is_even = (np.abs(rates - rate) < UNEVEN * np.abs(rate)).all(axis=0)
        for i in np.flatnonzero(is_slow & (is_even | np.isin(np.arange(len(rate)), [*before]))).tolist():
            onset = self.creeping[i] = before.get(i, self._seconds[0][0])
            change = float(rate[i]) * (now - onset) / SECOND
            if abs(change) >= CREPT and is_even[i] and i not in self._alarms:
                name, told = f"cylinder_{i + 1}", f"{change_text(1e3 * rate[i], 'mm/s')}, {change_text(1e3 * change, 'mm')}"
                begun[i] = Alarm(name, "creeps", onset, None, f"{name}.drive", told)
        return begun
