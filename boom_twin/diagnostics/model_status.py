"""Whether the model keeps up with the strokes."""

from __future__ import annotations

from collections.abc import Mapping
from math import nan

from ..records import Report
from ..thresholds import Thresholds
from .gate import Bounds
from .judge import Judge
from .status import Level, Status

HOLD = 1.0
"""Seconds for which a failure is shown."""


class ModelWatch:
    """Counts what the model does, and judges it.

    Attributes
    ----------
    predictions, failures, broken : int
        Since the model was started; ``broken``: messages that could not be handled at all.
    """

    def __init__(self) -> None:
        self._judge = Judge("model")
        self.begin(0.0)

    def begin(self, now: float) -> None:
        """The model is started at the time `now`, s of a clock that only goes forward."""
        self.predictions = self.failures = self.broken = 0
        self._failure, self._failed_at, self._new = "", -HOLD, False
        self._looked, self._steps = now, 0
        self._passes, self._busy, self._longest = 0, 0.0, 0.0

    def took(self, report: Report, duration: float) -> None:
        """The twin made `report` of a sample in so many seconds."""
        self._busy += duration
        if report.prediction is not None:
            self._steps += 1
            self._passes += report.passes
            if duration > self._longest:
                self._longest = duration
        elif report.status != "ok":
            self.failures += 1
            self._fail(report.status)

    def break_down(self, reason: str) -> None:
        """A message could not be handled."""
        self.broken += 1
        self._fail(reason)

    @property
    def has_failed(self) -> bool:
        """Whether there is a failure that was not told yet, and none is shown."""
        return self._new and self._judge.level != Level.ERROR

    def _fail(self, reason: str) -> None:
        self._failure, self._new = reason, True

    def status(
        self, values: Mapping[str, str | int], is_active: bool, is_fed: bool, thresholds: Thresholds, now: float, clock: float
    ) -> Status:
        """State of the model.

        Parameters
        ----------
        values : dict
            Told too.
        is_active, is_fed : bool
            Whether the twin listens, and strokes come.
        thresholds : Thresholds
        now, clock : float
            As for `boom_twin.watch.sensor.SensorJudge`.
        """
        judge = self._judge
        judge.begin(now, thresholds)
        for key, value in values.items():
            judge.note(key, value)
        self._check_load(thresholds, now)
        for key in ("predictions", "failures"):
            judge.note(key, getattr(self, key))
        judge.note("unhandled messages", self.broken)
        if self._new:
            self._failed_at, self._new = now, False
        if not is_active:
            judge.fault(Level.WARN, "not active")
        elif now - self._failed_at <= HOLD:
            judge.fault(Level.ERROR, self._failure)
        elif not is_fed or not self.predictions:
            judge.fault(Level.WARN, "waiting for strokes")
        return judge.finish(clock, "following the strokes")

    def _check_load(self, thresholds: Thresholds, now: float) -> None:
        """Time of a step against the time there is for it."""
        judge, span, steps = self._judge, now - self._looked, self._steps
        self.predictions += steps
        load = self._busy / span if span > 0.0 else nan
        judge.note("step_mean_s", self._busy / steps if steps else nan)
        judge.note("passes_mean", self._passes / steps if steps else nan)
        judge.note("step_longest_s", self._longest if steps else nan)
        judge.note("step_budget_s", span / steps if steps else nan)
        told = f"the model takes {load:.0%} of the time there is: raise step or look_step, or lower modes"
        judge.check("load", load, Bounds(thresholds.load_warn, thresholds.load_error), told)
        self._looked, self._steps, self._passes, self._busy, self._longest = now, 0, 0, 0.0, 0.0
