"""Status of the tip's swing, against limits from the settings."""

from __future__ import annotations

from collections import deque

import numpy as np

from ..types import SECOND, Array, Report
from .levels import Bounds, ComponentJudge, Status

WINDOW, INTERVAL = 4 * SECOND, SECOND // 50  # window (four periods of a slow boom) and interval of displacements, ns


class SwingWatch:
    """Displacements of the tip in the last `WINDOW`: estimated by all sensors, else predicted."""

    def __init__(self) -> None:
        self._places: deque[tuple[int, Array]] = deque()

    def took(self, report: Report) -> None:
        """Take a report that has a prediction."""
        p, e, stamp = report.prediction, report.estimate, report.stamp
        if p is None or (self._places and 0 <= stamp - self._places[-1][0] < INTERVAL):
            return
        if self._places and stamp < self._places[-1][0]:  # the clock was set back
            self._places.clear()
        self._places.append((stamp, p.tip_displacement if e is None else p.tip_displacement + e.tip[:2] - p.tip_position))
        while stamp - self._places[0][0] > WINDOW:
            self._places.popleft()

    def status(self, judge: ComponentJudge) -> Status:
        """Return the status with the swing: the largest distance of the tip from its mean, m."""
        places, limits = np.array([place for _, place in self._places]), judge.at.thresholds
        swing = float(np.linalg.norm(places - places.mean(axis=0), axis=1).max()) if len(places) else np.nan
        bounds = Bounds(limits.swing_warn, limits.swing_error)
        judge.check("swing_m", swing, bounds, "the tip swings too far: slow the pump down or stop the move", at_once=True)
        return judge.finish("the tip swings less than its limit")
