"""Whether one residual is as large as noise explains."""

from __future__ import annotations

from collections import deque
from math import nan, sqrt
from typing import NamedTuple

import numpy as np

from ..records import Array
from ..thresholds import Thresholds
from .gate import Bounds
from .judge import Judge
from .status import Level, Status


class _Sums(NamedTuple):
    """Of the normalised residuals in one look: its time (s), and how many, their sum, squares and largest magnitude."""

    time: float
    number: int
    total: float
    squares: float
    largest: float


class ResidualJudge:
    """Judges one channel by the root mean square of its normalised residual, which is 1 where noise explains all.

    Parameters
    ----------
    name : str
        Of the channel.
    """

    def __init__(self, name: str) -> None:
        self._judge = Judge(f"residual {name}")
        self._window: deque[_Sums] = deque()

    def take(self, normalised: Array, now: float) -> None:
        """Normalised residuals, shape (k,), that became known since the last look; NaN where not measured."""
        known = normalised[np.isfinite(normalised)]
        if len(known):
            squares = float(known @ known)
            self._window.append(_Sums(now, len(known), float(known.sum()), squares, float(np.abs(known).max())))

    def status(self, alarm: tuple[Level, str] | None, thresholds: Thresholds, now: float, clock: float) -> Status:
        """State of the channel, with its alarm if there is one; times as for `boom_twin.watch.sensor.SensorJudge`."""
        while self._window and self._window[0].time <= now - thresholds.residual_window:
            self._window.popleft()
        judge, count = self._judge, sum(sums.number for sums in self._window)
        judge.begin(now, thresholds)
        rms = sqrt(sum(sums.squares for sums in self._window) / count) if count else nan
        told = f"{rms:.2f} times as large as noise explains, for {thresholds.residual_window:g} s"
        if alarm is not None:
            judge.fault(*alarm)
        judge.check("rms_normalised", rms, Bounds(thresholds.residual_warn, thresholds.residual_error), told)
        judge.note("mean_normalised", sum(sums.total for sums in self._window) / count if count else nan)
        judge.note("largest_normalised", max((sums.largest for sums in self._window), default=nan))
        judge.note("count", count)
        judge.note("window_s", thresholds.residual_window)
        if not count:
            judge.fault(Level.STALE, f"none for {thresholds.residual_window:g} s")
        return judge.finish(clock, "as large as noise explains")
