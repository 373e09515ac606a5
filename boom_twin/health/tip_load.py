"""Alarm of a force at the tip that the model does not know and that is above a set limit: ``tip.load``.

Pumps and wind are no fault. A force above the limit is an overload, an obstacle at the tip, or a load that the scene lacks.
"""

from __future__ import annotations

from dataclasses import replace

from ..types import Alarm, Array, Ranked

CAUSE = "tip.load"
CERTAIN = 3.0  # standard deviations by which the estimated force has to be above the limit
AFTER, OVER = 2_000_000_000, 6_000_000_000  # ns from the first passing to a later one that raises it; without one, to its end


class TipLoadMonitor:
    """Monitor that compares the estimated force at the tip with its limit.

    Parameters
    ----------
    limit : float
        N.

    Attributes
    ----------
    alarm : Alarm or None
        While it lasts.
    """

    def __init__(self, limit: float) -> None:
        self._limit = limit
        self.begin()

    def begin(self) -> None:
        """Reset the monitor."""
        self.alarm: Alarm | None = None
        self._since = self._last = 0
        self._largest = 0.0, 0.0

    def take(self, stamp: int, load: Array, variances: Array) -> list[Alarm]:
        """Take the estimated force (2,) in N with its variances at `stamp` (ns); return an alarm that began or ended."""
        size = float((load @ load) ** 0.5)
        sigma = float((variances @ load**2) ** 0.5) / max(size, 1e-300)
        if self._since and stamp - self._last > OVER:
            ended = [] if self.alarm is None else [replace(self.alarm, until=self._last)]
            self.begin()
            return ended
        if size - CERTAIN * sigma <= self._limit:
            return []
        self._since, self._last = self._since or stamp, stamp
        self._largest = max(self._largest, (size, sigma))
        if self.alarm is not None or stamp - self._since < AFTER:
            return []
        size, sigma = self._largest
        evidence = f"{size:.0f} N (+- {sigma:.0f}), limit {self._limit:g} N (tip_load_limit)"
        ranked = (Ranked(CAUSE, 1.0, (("exceeded", size, sigma, "N"),)),)
        self.alarm = Alarm("tip", "exceeded", self._since, None, CAUSE, evidence, ranked)
        return [self.alarm]
