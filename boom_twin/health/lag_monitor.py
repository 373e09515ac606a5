"""Monitor of the lags of all streams behind the strokes, by the estimator of the commissioning check.

A lag raises an alarm if it explains most residuals beyond their stated deviation, and its size is known to a tenth. If all
other streams lead by the same time, the strokes are late.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..types import NANO, SENSORS, Alarm, Array, Stream
from ..wiring.readings import CLEAR, SPAN, Lag, lag_near
from .alarms import change_text
from .sensor_check import BLOCK, Block, Readings

LEAST = 0.025  # s, smallest lag of an alarm: a wrong payload or spring shifts vibration by less
SIGMAS = 10.0  # smallest lag in standard deviations: a window across its onset gives a mixture
EVERY = round(SPAN / (BLOCK * NANO))  # blocks between two estimates
WINDOWS = 12 * EVERY, 6 * EVERY, 3 * EVERY  # blocks of each window; a short one shows a new lag sooner


class LagMonitor:
    """Monitor of the lags of all streams behind `drive`, the stream that drives the model."""

    def __init__(self, drive: Stream) -> None:
        self._drive, self._alarms = drive, dict[Stream, Alarm]()
        self._newest = 0.0  # s, of the drive, while it is late
        self.begin()

    def begin(self) -> None:
        """Discard all readings, because the boom restarts at rest; alarms last until all lags are surely small."""
        self._number = 0
        self._means: dict[Stream, deque[tuple[int, Array]]] = {}  # of each block (ns), see `SensorCheck`

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """Alarms that last."""
        return tuple(self._alarms.values())

    @property
    def lag_of_drive(self) -> float:
        """Lag of the stream that drives the model, s; 0 while it has no alarm."""
        return self._newest if self._drive in self._alarms else 0.0

    def is_late(self, stream: Stream) -> bool:
        """Return True if an alarm says that the stream lags or leads the strokes."""
        return stream in self._alarms or self._drive in self._alarms

    def take(self, readings: Readings, failing: Mapping[Stream, NDArray[np.bool_]], block: Block) -> list[Alarm]:
        """Take a block without the channels of failing sensors; return the alarms that began or ended."""
        if block.number != self._number + 1:
            self._means.clear()
        self._number = block.number
        for stream, each in readings.items():
            if each.has_readings and not SENSORS[stream].beside:
                means = block.start, np.where(failing[stream], np.nan, each.means[:3])
                self._means.setdefault(stream, deque(maxlen=WINDOWS[0])).append(means)
        return [] if block.number % EVERY else self._judge(block.end)

    def _judge(self, end: int) -> list[Alarm]:
        """Begin and end alarms by the present lags."""
        lags = {stream: _lag(means) for stream, means in self._means.items()}
        late = {stream: lag for stream, lag in lags.items() if lag.left < CLEAR and _exceeds(lag)}
        if late and max(late.values()).lag < 0.0:
            surest = min(late.values(), key=lambda lag: lag.sigma)
            if not any(_exceeds(lag._replace(lag=lag.lag - surest.lag)) for lag in lags.values()):
                since = min(lag.since for lag in late.values())
                late = {self._drive: surest._replace(lag=-surest.lag, since=since)}
        self._newest = late[self._drive].lag if self._drive in late else self._newest
        near = {stream for stream, lag in lags.items() if abs(lag.lag) + SIGMAS * lag.sigma < LEAST}
        if near == lags.keys():
            near.add(self._drive)
        news = [replace(self._alarms.pop(stream), until=end) for stream in list(self._alarms) if stream in near]
        for stream, lag in late.items():
            if stream not in self._alarms:
                name, evidence = stream.value, change_text(1e3 * lag.lag, "ms", 1e3 * lag.sigma)
                self._alarms[stream] = Alarm(name, "late", lag.since, None, f"{name}.delay", evidence)
                news.append(self._alarms[stream])
        return news


def _exceeds(lag: Lag) -> bool:
    return abs(lag.lag) > max(LEAST, SIGMAS * lag.sigma)


def _lag(means: deque[tuple[int, Array]]) -> Lag:
    """Return the lag of the window that a lag explains best, by the channels with all readings."""
    stamps, kept = map(np.array, zip(*means, strict=True))
    found = list[Lag]()
    for count in WINDOWS:
        newest = kept[-count:]
        newest = newest[:, :, np.isfinite(newest).all(axis=(0, 1))]
        if newest.size:
            found.append(lag_near(stamps[-count:], *newest.swapaxes(0, 1)))
    return min(found, key=lambda lag: (lag.left, lag.sigma), default=Lag(0.0, np.inf))
