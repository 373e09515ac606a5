"""Statuses of the model: run time, normalised residuals, health alarms, tip load."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
from math import nan, sqrt

import numpy as np
from numpy.typing import NDArray

from ..analysis.load_spectrum import TipLoadFinder
from ..health.alarms import Alarms, repeated, values_of
from ..health.deviations import KIND as DEVIATION
from ..health.sensor_monitor import noise_as_text
from ..types import SECOND, Alarm, Array, Health, Report
from .levels import Bounds, ComponentJudge, Level, Status, Value

FAILURE_SHOWN = 1.0  # time (s) for which a failure is shown
LOAD_WINDOW = 40 * SECOND  # ns, window of loads at the tip
INTERVAL = SECOND // 50  # ns, least time between two rows of a window
SWING_WINDOW = 4 * SECOND  # ns, window of displacements of the tip: four periods of a slow boom


class ModelWatch:
    """Counts of the model's predictions and failures since the monotonic time `now` (s).

    `drive` names the input that drives it.
    """

    def __init__(self, now: float, drive: str = "strokes") -> None:
        self._drive = drive
        self._predictions = self._failures = self._broken = 0
        self._predicted_at = self._unfed_at = now  # times of the newest status with a prediction, and of that without strokes
        self._counts: Mapping[str, Value] = {}  # at `_predicted_at`
        self._is_deflected = False
        self._failure, self._failed_at, self.has_news = "", -FAILURE_SHOWN, False
        self._looked, self._steps = now, 0
        self._busy, self._longest = 0.0, 0.0

    def took(self, report: Report, duration: float) -> None:
        """Count a `report` that the twin made in `duration` seconds."""
        self._busy += duration
        if report.prediction is not None:
            self._steps += 1
            self._is_deflected = "deflected" in report.events
            if duration > self._longest:
                self._longest = duration
        elif report.status != "ok":
            self._failures += 1
            self._failure, self.has_news = report.status, True

    def worked(self, duration: float) -> None:
        self._busy += duration

    def break_down(self, reason: str) -> None:
        self._broken += 1
        self._failure, self.has_news = reason, True

    def status(
        self, judge: ComponentJudge, counts: Mapping[str, Value], idle: str, is_fed: bool, words: Mapping[str, str]
    ) -> Status:
        """Return the status of the model; `is_fed`: True while strokes arrive.

        `idle` is the reason why the twin does not listen, or empty. `counts` are reported too. `words` describe the counts of
        irregular samples.
        """
        now, stale_after = judge.at.now, judge.at.thresholds.stale_after
        judge.note(counts)
        self._check_load(judge)
        totals = {"predictions": self._predictions, "failures": self._failures, "unhandled messages": self._broken}
        judge.note(totals)
        if self.has_news:
            self._failed_at, self.has_news = now, False
        if not is_fed:
            self._unfed_at = now
        silent = now - max(self._predicted_at, self._unfed_at)
        if idle:
            judge.fault(Level.WARN, idle)
        elif now - self._failed_at <= FAILURE_SHOWN:
            judge.fault(Level.ERROR, self._failure)
        elif not is_fed or (not self._predictions and silent <= stale_after):
            judge.fault(Level.WARN, f"waiting for {self._drive}")
        elif silent > stale_after:
            judge.note({"no_prediction_s": silent})
            judge.fault(Level.ERROR, f"no prediction, although {self._drive} arrive{self._why(counts, words)}")
        elif self._is_deflected:
            judge.fault(Level.WARN, f"deflected: {words.get('deflected', '')}")
        if self._predicted_at == now:
            self._counts = dict(counts)
        return judge.finish(f"following the {self._drive}")

    def _why(self, counts: Mapping[str, Value], words: Mapping[str, str]) -> str:
        """Return in words the event counted most since the newest prediction, or empty."""
        new = {key: value - int(self._counts.get(key, 0)) for key, value in counts.items() if isinstance(value, int)}
        most = max(new, key=lambda key: new[key], default="")
        if not most or new[most] <= 0:
            return ""
        name = most.partition(": ")[2]
        return f": {name} ({words.get(name, 'see the counts')})"

    def _check_load(self, judge: ComponentJudge) -> None:
        """Judge the run time of a step against the time available for it."""
        thresholds, now, steps = judge.at.thresholds, judge.at.now, self._steps
        span = now - self._looked
        self._predictions += steps
        load = self._busy / span if span > 0.0 else nan
        means = (self._busy / steps, self._longest, span / steps) if steps else (nan, nan, nan)
        judge.note(dict(zip(("step_mean_s", "step_longest_s", "step_budget_s"), means, strict=True)))
        told = "the model takes most of the available time: end other work of this computer, or lower the strokes' rate"
        judge.check("load", load, Bounds(thresholds.load_warn, thresholds.load_error), told)
        if steps:
            self._predicted_at = now
        self._looked, self._steps, self._busy, self._longest = now, 0, 0.0, 0.0


class StampWindow:
    """Rows of `width` numbers of the last `window` (ns) by their stamps, at most one in every `INTERVAL`."""

    def __init__(self, window: int, width: int) -> None:
        self._window, self._width, self._rows = window, width, deque[tuple[int, Array]]()

    @property
    def stamps(self) -> NDArray[np.int64]:
        return np.array([stamp for stamp, _ in self._rows], np.int64)

    @property
    def rows(self) -> Array:
        return np.array([row for _, row in self._rows], float).reshape(-1, self._width)

    def is_due(self, stamp: int) -> bool:
        """Return True if no row was added within the `INTERVAL` before `stamp` (ns)."""
        return not self._rows or not 0 <= stamp - self._rows[-1][0] < INTERVAL

    def add(self, stamp: int, row: Array) -> None:
        """Add a row that `is_due`; forget all if the clock was set back."""
        if self._rows and stamp < self._rows[-1][0]:
            self._rows.clear()
        self._rows.append((stamp, row))
        while self._rows[0][0] < stamp - self._window:
            self._rows.popleft()


class SwingWatch:
    """Displacements of the tip in the last `SWING_WINDOW`: estimated by all sensors, else predicted."""

    def __init__(self) -> None:
        self._places = StampWindow(SWING_WINDOW, 2)

    def took(self, report: Report) -> None:
        p = report.prediction
        if p is not None and self._places.is_due(report.stamp):
            e = report.estimate
            place = p.tip_displacement if e is None else p.tip_displacement + e.tip[:2] - p.tip_position
            self._places.add(report.stamp, place)

    def status(self, judge: ComponentJudge) -> Status:
        """Return the status with the swing: the largest distance of the tip from its mean, m."""
        places, limits = self._places.rows, judge.at.thresholds
        swing = float(np.linalg.norm(places - places.mean(axis=0), axis=1).max()) if len(places) else nan
        bounds = Bounds(limits.swing_warn, limits.swing_error)
        judge.check("swing_m", swing, bounds, "the tip swings too far: slow the pump down or stop the move", at_once=True)
        return judge.finish("the tip swings less than its limit")


class LoadWatch:
    """Estimated disturbance force at the tip in the last `LOAD_WINDOW`. It is never a fault."""

    def __init__(self) -> None:
        self.explanation = ""  # reason of residuals above noise; empty without a load at the last look
        self._loads = StampWindow(LOAD_WINDOW, 4)  # forces and their variances

    def took(self, report: Report) -> None:
        if self._loads.is_due(report.stamp) and (estimate := report.estimate) is not None:
            self._loads.add(report.stamp, np.concatenate([estimate.load, estimate.load_variance]))

    def status(self, judge: ComponentJudge) -> Status | None:
        """Return the status; None if only strokes are measured."""
        finder, rows = TipLoadFinder(), self._loads.rows
        finder.add(self._loads.stamps, rows[:, :2], rows[:, 2:])
        load, self.explanation = finder.load, ""
        if load is None:
            return None
        if load.is_there:
            self.explanation = "a load at the tip moves the boom"
        judge.note({"rms_N": load.rms, "rms_sigma_N": load.sigma})
        if (pulses := load.pulses) is not None:
            frequency = {"frequency_Hz": pulses.frequency, "frequency_sigma_Hz": pulses.frequency_sigma}
            judge.note({"pulses_N": pulses.height} | frequency)
        found = "pump pulses at the tip" if pulses is not None else "a load at the tip that the model does not know"
        return judge.finish(found if load.is_there else "no load at the tip above its uncertainty")


class ResidualWindow:
    """Normalised residuals of one channel: with noise only, their root mean square is 1.

    The window begins at the monotonic time `since` (s) at the earliest.
    """

    def __init__(self, since: float) -> None:
        self._since = since
        self._window: deque[tuple[float, int, float, float, float]] = deque()  # time, number, sum, sum of squares, largest

    def take(self, normalised: Array, now: float) -> None:
        """Take the normalised residuals since the last look, shape (k,); NaN where not measured."""
        values = normalised[np.isfinite(normalised)]
        largest = float(np.abs(values).max(initial=0.0))
        self._window.append((now, len(values), float(values.sum()), float(values @ values), largest))

    def status(
        self, judge: ComponentJudge, alarm: tuple[Level, str] | None, explained: str = "", is_judged: bool = False
    ) -> Status:
        """Return the status of the channel, with level and words of its `alarm`, if any.

        The residual is not judged if `explained` names an alarm or a load as its reason. If the rig's health `is_judged`,
        health reports faults, and a large residual is a warning at most.
        """
        thresholds, now = judge.at.thresholds, judge.at.now
        while self._window and self._window[0][0] <= now - thresholds.residual_window:
            self._window.popleft()
        _, counts, sums, squares, peaks = zip(*self._window, strict=True) if self._window else ((),) * 5
        count, rms, mean, largest = sum(counts), nan, nan, nan
        if count:
            rms, mean, largest = sqrt(sum(squares) / count), sum(sums) / count, max(peaks)
        window = min(thresholds.residual_window, now - self._since)
        told = "larger than noise explains"
        told += "; health finds no fault in these residuals" if is_judged and alarm is None else ""
        if alarm is not None:
            judge.fault(*alarm)
        bounds = Bounds(thresholds.residual_warn, nan if is_judged else thresholds.residual_error)
        judge.check("rms_normalised", rms, Bounds() if explained else bounds, told)
        judge.note({"mean_normalised": mean, "largest_normalised": largest, "count": count, "window_s": window})
        if not count:
            judge.fault(Level.STALE, "none within the window")
        return judge.finish(explained or "as large as noise explains")


class HealthWatch:
    """Health of the rig: active alarms, and ended ones that are not acknowledged."""

    def __init__(self) -> None:
        self._alarms, self._noise = Alarms(), dict[str, float]()
        self._before = Counter[tuple[str, str, str | None]]()  # number of earlier alarms
        self.has_news = False  # an alarm began since the last look

    def took(self, health: Health) -> None:
        """Take the twin's report on the rig's health."""
        before = len(self._alarms.all)
        self._noise = dict(health.noise)
        self._alarms.take(health)
        self.has_news |= len(self._alarms.all) > before
        self._before.update(map(repeated, self._alarms.fold_ended()))

    def acknowledge(self) -> str:
        """Release ended alarms; return them in words."""
        ended = [alarm for alarm in self._alarms.all if alarm.until is not None]
        self._alarms.forget_ended()
        self._before.clear()
        return "; ".join(alarm.told for alarm in ended) or "no alarm has ended"

    def of(self, channel: str) -> tuple[Level, str] | None:
        """Return level and words of the active alarm of a channel; None without one."""
        alarms = (alarm for alarm in self._alarms.lasting if alarm.channel == channel)
        return next(((_level_of(alarm), alarm.told) for alarm in alarms), None)

    def of_sensor(self, channel: str) -> tuple[Level, str] | None:
        """Return level and words of the active alarm that blames the sensor of a channel; None without one."""
        alarms = (alarm for alarm in self._alarms.lasting if alarm.channel == channel and alarm.cause == f"{channel}.sensor")
        return next(((_level_of(alarm), alarm.told) for alarm in alarms), None)

    @property
    def is_alarmed(self) -> bool:
        return bool(self._alarms.lasting)

    @property
    def explained(self) -> str:
        """Return a reference to alarms raised by large residuals; empty without one."""
        found = (alarm for alarm in self._alarms.lasting if alarm.ranked or alarm.kind == DEVIATION)
        channels = dict.fromkeys(alarm.channel for alarm in found)
        return f"judged by health: alarm of {', '.join(channels)}" if channels else ""

    def status(self, judge: ComponentJudge) -> Status:
        self.has_news = False
        alarms, lasting = self._alarms.all, len(self._alarms.lasting)
        judge.note({"alarms": lasting, "not_acknowledged": len(alarms) - lasting + self._before.total()})
        for number, alarm in enumerate(alarms, 1):
            times = 1 + self._before[repeated(alarm)]
            judge.fault(_level_of(alarm), alarm.told if alarm.until is None else f"{alarm.told} (ended, not acknowledged)")
            values: dict[str, Value] = {"channel": alarm.channel, **values_of(alarm), "times": times}
            judge.note({f"{number} {key}": value for key, value in values.items()})
        judge.note(self._noise)
        if noise_as_text(self._noise):
            judge.fault(Level.WARN, "most sensors of a stream are noisier than its setting states")
        return judge.finish("no alarm")


def _level_of(alarm: Alarm) -> Level:
    return Level.WARN if alarm.until is not None or alarm.cause is None else Level.ERROR
