"""Monitor of lasting deviations of a stream from the prediction, in the unit of the stream, without a cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..config.settings import Settings
from ..scene.schema import Scene
from ..types import NANO, SENSORS, Alarm, Array, Stream, channels_of
from ..wiring.readings import LONGEST
from .alarms import change_text
from .blocks import Block
from .sensor_check import ENOUGH, WINDOW, StreamReadings

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

    def take(self, readings: StreamReadings, masked: NDArray[np.bool_], block: Block) -> list[Alarm]:
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
