"""Alarm of a force at the tip that the model does not know and that is above a set limit: ``tip.load``.

Inference takes such a force for a nuisance (see `boom_twin.health.inference.innovation_filter`): pumps and wind are no fault.
It must stay plausible, though: what would take more than the limit is either an overload or no load at all.
"""

from __future__ import annotations

from dataclasses import replace

from ..types import NANO, Alarm, Ranked

CAUSE = "tip.load"
CHANNEL = "tip"
CERTAIN = 3.0  # deviations of the estimate by which it has to be above the limit
AFTER, OVER = 2.0, 6.0  # s, from the first to a later passing of the limit that makes an alarm; and without one, that end it


class TipLoadMonitor:
    """Compares the estimated load with its limit.

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
        """Forget what was."""
        self.alarm: Alarm | None = None
        self._since = self._last = 0
        self._largest = 0.0, 0.0

    def take(self, stamp: int, size: float, sigma: float) -> list[Alarm]:
        """An estimate of the load and its deviation, N, at `stamp` (ns); 0 where none is needed. Gives the news."""
        is_above = size - CERTAIN * sigma > self._limit
        if self._since and (stamp - self._last) * NANO > OVER:
            return self.end(stamp)
        if not is_above:
            return []
        self._since, self._last = self._since or stamp, stamp
        self._largest = max(self._largest, (size, sigma))
        if (stamp - self._since) * NANO < AFTER:
            return []
        size, sigma = self._largest
        told = (
            f"{CAUSE} exceeded: {size:.0f} +- {sigma:.0f} N at the tip, above the limit of {self._limit:g} N (tip_load_limit); "
            "stop the pump, free the end hose, and compare the posture of the boom with its readings"
        )
        ranked = (Ranked(CAUSE, 1.0, (("exceeded", size, sigma, "N"),)),)
        self.alarm = Alarm(CHANNEL, "exceeded", self._since, None, CAUSE, told, ranked)
        return [self.alarm]

    def end(self, stamp: int) -> list[Alarm]:
        """The load is there no more, or is none; gives the alarm that ended, if there was one."""
        ended = [] if self.alarm is None else [replace(self.alarm, until=stamp)]
        self.begin()
        return ended
