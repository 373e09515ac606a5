"""Alarm of an unknown force at the tip above a set limit: ``tip.load``.

Pumps and wind raise no alarm. A force above the limit is an overload, an obstacle at the tip, or a load that the scene lacks.
A force that the cylinder lengths alone contradict raises none: late or wrong readings of other sensors look like a force.
"""

from __future__ import annotations

from dataclasses import replace

from ..types import NANO, Alarm, Array, Ranked
from .alarms import change_text
from .deviations import SETTLED
from .sensor_check import WINDOW

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
