"""Test for strokes and angles of another boom than the scene."""

from __future__ import annotations

from collections.abc import Iterable
from math import degrees, radians

import numpy as np

from ..health.wiring_monitor import KIND as WIRING
from ..types import Array, Health, Report, Sample, Stream

JUDGED_TIME = 5_000_000_000  # window (ns) of the test
FEWEST_RESIDUALS = 10  # least number of a joint's residuals in the window
LARGEST_RESIDUAL = radians(10.0)  # largest residual by sag, load, wrong stiffness, and most encoders' zeros


class OtherBoom:
    """Test for a session of another boom, by the medians of the angles' residuals.

    The test uses the first window in which the readings of most encoders change. A constant encoder may be dead and is not
    used. A single large residual may be an encoder fault. If more than half are large, the scene is wrong. The test is made
    once, because a later difference is a fault of the rig. It is not made if health reports wrong wiring.
    """

    def __init__(self) -> None:
        self.is_judged = False  # True after the test: no more samples are needed
        self._begin = 0
        self._values: list[Array] = []
        self._residuals: list[Array] = []

    def took(self, sample: Sample, report: Report) -> str:
        """Take the `report` of `sample`; return the evidence of another boom, empty without evidence."""
        for part in report.all:
            self.hear(part.health)
        values = [sample.values] if sample.stream is Stream.ANGLES else []
        found = [each.values for part in report.all for each in part.residuals if each.stream is Stream.ANGLES]
        return self.take(sample.stamp, values, found)

    def hear(self, health: Health | None) -> None:
        """Take the health of the rig: wrong wiring explains large residuals."""
        self.is_judged |= health is not None and any(alarm.kind == WIRING for alarm in health.alarms)

    def take(self, stamp: int, values: Iterable[Array], residuals: Iterable[Array]) -> str:
        """Take rows of angles and of their residuals (n,) in rad up to a `stamp` (ns); return the same as `took`."""
        if self.is_judged:
            return ""
        self._values.extend(values)
        self._residuals.extend(residuals)
        self._begin = self._begin or stamp
        return self.judge() if stamp - self._begin > JUDGED_TIME else ""

    def judge(self) -> str:
        """Return the evidence of another boom, empty without evidence; clear the window."""
        values, residuals = self._values, self._residuals
        self._begin, self._values, self._residuals = 0, [], []
        if self.is_judged or len(values) < FEWEST_RESIDUALS or len(residuals) < FEWEST_RESIDUALS:
            return ""
        table, off = np.array(values), np.array(residuals)
        counts = np.isfinite(off).sum(axis=0)
        heard = [i for i in range(len(counts)) if counts[i] >= FEWEST_RESIDUALS]
        live = [i for i in heard if np.nanmax(table[:, i]) > np.nanmin(table[:, i])]
        if 2 * len(live) <= len(heard):
            return ""
        self.is_judged = True
        medians = {i: float(np.nanmedian(off[:, i])) for i in live}
        far = {i: value for i, value in medians.items() if abs(value) > LARGEST_RESIDUAL}
        if 2 * len(far) <= len(live):
            return ""
        told = ", ".join(f"joint_{i + 1} by {degrees(value):+.1f} deg" for i, value in far.items())
        return f"{told} off what the strokes say, and at most {degrees(LARGEST_RESIDUAL):g} deg can be a fault of the rig"
