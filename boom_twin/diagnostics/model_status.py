"""Status of the model: whether it keeps up, whether residuals are explained by noise, what the health monitor has found."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
from math import nan, sqrt
from typing import NamedTuple

import numpy as np

from ..config.settings import Thresholds
from ..deviation.load_spectrum import TipLoadFinder
from ..health.alarms import Alarms, repeated, values_of
from ..health.deviations import KIND as DEVIATION
from ..health.sensor_monitor import noise_as_text
from ..types import SECOND, Alarm, Array, Estimate, Health, Report
from .levels import Bounds, ComponentJudge, Evaluation, Level, Status

HOLD = 1.0
"""Seconds for which a failure is shown."""
LOAD_WINDOW, LOAD_INTERVAL = 40 * SECOND, SECOND // 50
"""Window and interval of the estimates of the load at the tip, ns."""


class ModelWatch:
    """Judge of the model, with counts of its predictions and failures.

    Attributes
    ----------
    predictions, failures, broken : int
        Since the model was started; ``broken``: messages that could not be handled at all.
    """

    def __init__(self) -> None:
        self._judge = ComponentJudge("model")
        self.begin(0.0)

    def begin(self, now: float) -> None:
        """Reset the counts, because the model starts at the time `now`, s of a clock that only goes forward."""
        self.predictions = self.failures = self.broken = 0
        self._predicted_at = self._unfed_at = now  # newest looks with a prediction, and without strokes
        self._counts: Mapping[str, str | int] = {}  # of that with a prediction
        self._is_deflected = False
        self._failure, self._failed_at, self._new = "", -HOLD, False
        self._looked, self._steps = now, 0
        self._busy, self._longest = 0.0, 0.0

    def took(self, report: Report, duration: float) -> None:
        """Count a `report` that the twin made in `duration` seconds."""
        self._busy += duration
        if report.is_predicted:
            self._steps += 1
            self._is_deflected = "deflected" in report.events
            if duration > self._longest:
                self._longest = duration
        elif report.status != "ok":
            self.failures += 1
            self._fail(report.status)

    def worked(self, duration: float) -> None:
        """Add `duration` seconds for which the twin was busy beside its samples."""
        self._busy += duration

    def break_down(self, reason: str) -> None:
        """Count a message that could not be handled."""
        self.broken += 1
        self._fail(reason)

    @property
    def has_failed(self) -> bool:
        """Return True if a failure is not reported yet and no failure is shown."""
        return self._new and self._judge.level != Level.ERROR

    def _fail(self, reason: str) -> None:
        self._failure, self._new = reason, True

    def status(
        self, values: Mapping[str, str | int], is_active: bool, is_fed: bool, at: Evaluation, words: Mapping[str, str]
    ) -> Status:
        """Return the status of the model.

        Parameters
        ----------
        values : dict
            Told too; counts of what is out of the ordinary among them.
        is_active, is_fed : bool
            Whether the twin listens, and strokes come.
        at : Evaluation
        words : dict of str to str
            What those counts are of.
        """
        judge = self._judge
        judge.begin(at)
        for key, value in values.items():
            judge.note(key, value)
        self._check_load(at.thresholds, at.now)
        for key in ("predictions", "failures"):
            judge.note(key, getattr(self, key))
        judge.note("unhandled messages", self.broken)
        if self._new:
            self._failed_at, self._new = at.now, False
        if not is_fed:
            self._unfed_at = at.now
        silent = at.now - max(self._predicted_at, self._unfed_at)
        if not is_active:
            judge.fault(Level.WARN, "not active")
        elif at.now - self._failed_at <= HOLD:
            judge.fault(Level.ERROR, self._failure)
        elif not is_fed or (not self.predictions and silent <= at.thresholds.stale_after):
            judge.fault(Level.WARN, "waiting for strokes")
        elif silent > at.thresholds.stale_after:
            judge.fault(Level.ERROR, f"no prediction for {silent:.1f} s, though strokes come{self._why(values, words)}")
        elif self._is_deflected:
            judge.fault(Level.WARN, f"deflected: {words.get('deflected', '')}")
        if self._predicted_at == at.now:
            self._counts = dict(values)
        return judge.finish("following the strokes")

    def _why(self, values: Mapping[str, str | int], words: Mapping[str, str]) -> str:
        """Return in words what was counted most since the newest prediction; empty if nothing was."""
        new = {key: value - int(self._counts.get(key, 0)) for key, value in values.items() if isinstance(value, int)}
        most = max(new, key=lambda key: new[key], default="")
        if not most or new[most] <= 0:
            return ""
        name = most.partition(": ")[2]
        return f": {new[most]} times {name} ({words.get(name, 'see the counts')})"

    def _check_load(self, thresholds: Thresholds, now: float) -> None:
        """Judge the run time of a step against the time available for it."""
        judge, span, steps = self._judge, now - self._looked, self._steps
        self.predictions += steps
        load = self._busy / span if span > 0.0 else nan
        judge.note("step_mean_s", self._busy / steps if steps else nan)
        judge.note("step_longest_s", self._longest if steps else nan)
        judge.note("step_budget_s", span / steps if steps else nan)
        told = f"the model takes {load:.0%} of the time there is: end other work of this computer, or lower the strokes' rate"
        judge.check("load", load, Bounds(thresholds.load_warn, thresholds.load_error), told)
        if steps:
            self._predicted_at = now
        self._looked, self._steps, self._busy, self._longest = now, 0, 0.0, 0.0


class LoadWatch:
    """Judge of the disturbance force at the tip, as estimated in the last `LOAD_WINDOW`; it is never a fault.

    Attributes
    ----------
    explanation : str
        Of residuals that are larger than noise, in words; empty while there was no load at the last look.
    """

    def __init__(self) -> None:
        self._judge, self.explanation = ComponentJudge("tip load"), ""
        self._stamps: deque[int] = deque()
        self._loads: deque[Array] = deque()

    def is_due(self, stamp: int) -> bool:
        """Return True if no estimate was taken within the `LOAD_INTERVAL` before `stamp` (ns)."""
        return not self._stamps or not 0 <= stamp - self._stamps[-1] < LOAD_INTERVAL

    def took(self, estimate: Estimate) -> None:
        """Take an estimate that `is_due`."""
        if self._stamps and estimate.stamp < self._stamps[-1]:  # the clock was set back
            self._stamps.clear()
            self._loads.clear()
        self._stamps.append(estimate.stamp)
        self._loads.append(estimate.load)
        while self._stamps[-1] - self._stamps[0] > LOAD_WINDOW:
            self._stamps.popleft()
            self._loads.popleft()

    def status(self, at: Evaluation) -> Status | None:
        """Return the status, in words and figures; None as long as nothing but strokes was measured."""
        finder = TipLoadFinder()
        finder.add(np.array(self._stamps, np.int64), np.array(self._loads).reshape(-1, 2))
        load, self.explanation = finder.load, ""
        if load is None:
            return None
        if load.is_there:
            self.explanation = f"a load at the tip moves the boom: {load.text}"
        self._judge.begin(at)
        self._judge.note("rms_N", load.rms)
        if load.pulses is not None:
            self._judge.note("pulses_N", load.pulses.height)
            self._judge.note("frequency_Hz", load.pulses.frequency)
            self._judge.note("frequency_sigma_Hz", load.pulses.frequency_sigma)
        return self._judge.finish(load.text)


class _Sums(NamedTuple):
    """Sums over the normalised residuals of one look: time (s), number, sum, sum of squares, largest magnitude."""

    time: float
    number: int
    total: float
    squares: float
    largest: float


class ResidualJudge:
    """Judge of one channel by the root mean square of its normalised residual, which is 1 if noise explains all.

    Parameters
    ----------
    name : str
        Of the channel.
    since : float
        When the first residuals began to come, s of a clock that only goes forward: the window is no longer than that.
    """

    def __init__(self, name: str, since: float) -> None:
        self._judge, self._since = ComponentJudge(f"residual {name}"), since
        self._window: deque[_Sums] = deque()

    def take(self, normalised: Array, now: float) -> None:
        """Take normalised residuals, shape (k,), that became known since the last look; NaN where not measured."""
        known = normalised[np.isfinite(normalised)]
        if len(known):
            squares = float(known @ known)
            self._window.append(_Sums(now, len(known), float(known.sum()), squares, float(np.abs(known).max())))

    def status(self, alarm: tuple[Level, str] | None, at: Evaluation, explained: str = "", is_judged: bool = False) -> Status:
        """Return the status of the channel, with its alarm if there is one.

        Parameters
        ----------
        alarm : tuple of Level and str, optional
        at : Evaluation
        explained : str
            By an alarm or a load, in words; then its size is not judged.
        is_judged : bool
            Whether the rig's health is: then it says what is a fault, and the size of a residual is none by itself.
        """
        thresholds = at.thresholds
        while self._window and self._window[0].time <= at.now - thresholds.residual_window:
            self._window.popleft()
        judge, count = self._judge, sum(sums.number for sums in self._window)
        judge.begin(at)
        rms = sqrt(sum(sums.squares for sums in self._window) / count) if count else nan
        window = min(thresholds.residual_window, at.now - self._since)
        told = f"{rms:.2f} times as large as noise explains, for {window:.2g} s"
        told += "; health finds no fault in that" if is_judged and alarm is None else ""
        if alarm is not None:
            judge.fault(*alarm)
        bounds = Bounds(thresholds.residual_warn, nan if is_judged else thresholds.residual_error)
        bounds = Bounds() if explained else bounds
        judge.check("rms_normalised", rms, bounds, told)
        judge.note("mean_normalised", sum(sums.total for sums in self._window) / count if count else nan)
        judge.note("largest_normalised", max((sums.largest for sums in self._window), default=nan))
        judge.note("count", count)
        judge.note("window_s", window)
        if not count:
            judge.fault(Level.STALE, f"none for {window:.2g} s")
        return judge.finish(explained or "as large as noise explains")


class HealthWatch:
    """Health of the rig: active alarms, and ended ones that are not acknowledged.

    Attributes
    ----------
    has_news : bool
        Whether an alarm began since the last look.
    """

    def __init__(self) -> None:
        self._judge = ComponentJudge("health")
        self._alarms, self._noise = Alarms(), dict[str, float]()
        self._before = Counter[tuple[str, str, str | None]]()  # of ended alarms: how often they had come and gone before
        self.has_news = False

    def took(self, health: Health) -> None:
        """Take the twin's report on the rig's health."""
        before = len(self._alarms.all)
        self._noise = dict(health.noise)
        self._alarms.take(health)
        self.has_news |= len(self._alarms.all) > before
        self._before.update(map(repeated, self._alarms.fold_ended()))

    def acknowledge(self) -> str:
        """Release alarms that have ended; return in words which."""
        ended = [alarm for alarm in self._alarms.all if alarm.until is not None]
        self._alarms.forget_ended()
        self._before.clear()
        return "; ".join(f"{alarm.channel}: {alarm.told}" for alarm in ended) or "no alarm has ended"

    def of(self, channel: str) -> Alarm | None:
        """Return the active alarm of a channel; None without one."""
        return next((alarm for alarm in self._alarms.lasting if alarm.channel == channel), None)

    @property
    def is_alarmed(self) -> bool:
        """Return True if an alarm is active."""
        return bool(self._alarms.lasting)

    @property
    def explained(self) -> str:
        """Return a reference to the alarms that large residuals raised; empty without one."""
        found = (alarm for alarm in self._alarms.lasting if alarm.ranked or alarm.kind == DEVIATION)
        channels = dict.fromkeys(alarm.channel for alarm in found)
        return f"judged by health: alarm of {', '.join(channels)}" if channels else ""

    def status(self, at: Evaluation) -> Status:
        """Return the status of the rig's health."""
        judge, self.has_news = self._judge, False
        judge.begin(at)
        alarms = self._alarms.all
        judge.note("alarms", len(self._alarms.lasting))
        judge.note("not_acknowledged", len(alarms) - len(self._alarms.lasting) + self._before.total())
        for number, alarm in enumerate(alarms, 1):
            judge.fault(level_of(alarm), told_of(alarm, 1 + self._before[repeated(alarm)]))
            for key, value in {"channel": alarm.channel, **values_of(alarm)}.items():
                judge.note(f"{number} {key}", value)
        for name, times in self._noise.items():
            judge.note(name, times)
        for told in noise_as_text(self._noise):
            judge.fault(Level.WARN, told)
        return judge.finish("no alarm")


def level_of(alarm: Alarm) -> Level:
    """Return ERROR for an active alarm with a named cause, else WARN."""
    return Level.WARN if alarm.until is not None or alarm.cause is None else Level.ERROR


def told_of(alarm: Alarm, times: int = 1) -> str:
    """Return an alarm in words, with the number of `times` that it has occurred."""
    ended = f"ended, {times} times" if times > 1 else "ended"
    return f"{alarm.channel}: {alarm.told}" + ("" if alarm.until is None else f" ({ended}; not acknowledged)")
