"""Whether one sensor measures."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isnan

from ..thresholds import Thresholds
from .channel import Figures
from .frozen import readings_of_frozen
from .gate import Bounds
from .judge import Judge
from .status import Status


@dataclass(frozen=True, slots=True)
class Sensor:
    """What is known of a sensor: name of its status, range, noise and resolution, in its own unit.

    ``unit`` is how a key ends that holds a value of it: ``rad``, ``m``, ``m_s2``.
    """

    name: str
    unit: str
    low: float
    high: float
    sigma: float
    resolution: float
    required: bool = True


class SensorJudge:
    """Judges one sensor by its figures."""

    def __init__(self, sensor: Sensor) -> None:
        self._sensor, self._judge = sensor, Judge(f"sensor {sensor.name}")

    def status(self, figures: Figures, age: float, thresholds: Thresholds, now: float, clock: float) -> Status:
        """State of the sensor.

        Parameters
        ----------
        figures : Figures
        age : float
            Since its last reading, s.
        thresholds : Thresholds
            The thresholds.
        now, clock : float
            Time (s) of a clock that only goes forward, and of the one that people know.
        """
        judge, sensor = self._judge, self._sensor
        judge.begin(now, thresholds)
        if not figures.stamp and not sensor.required:
            return judge.finish(clock, "not there; optional")
        judge.note(f"value_{sensor.unit}", figures.value)
        judge.note("rate_Hz", figures.rate)
        told = f"no reading for {age:.1f} s" if figures.stamp else "no reading yet"
        judge.check_age(age, thresholds.stale_after, told)
        judge.check("gap_s", figures.gap, Bounds(thresholds.gap_warn), f"gap of {figures.gap:.3f} s", at_once=True)
        judge.note("gaps", figures.gaps)
        share = Bounds(thresholds.unusable_warn, thresholds.unusable_error)
        judge.check("missing_share", figures.missing, share, f"{figures.missing:.1%} of the messages without a value")
        self._check_range(figures, share)
        self._check_frozen(figures, thresholds)
        return judge.finish(clock, "measuring" if figures.stamp else "waiting for a reading")

    def _check_range(self, figures: Figures, share: Bounds) -> None:
        if self._sensor.high < inf:
            low, high, unit = self._sensor.low, self._sensor.high, self._sensor.unit
            told = f"{figures.outside:.1%} of the readings out of {low:.6g} to {high:.6g} {unit}, newest {figures.value:.6g}"
            self._judge.note(f"low_{unit}", low)
            self._judge.note(f"high_{unit}", high)
            self._judge.check("outside_share", figures.outside, share, told)

    def _check_frozen(self, figures: Figures, thresholds: Thresholds) -> None:
        """How long the reading has not changed, against what noise explains."""
        known = 0.0 if isnan(figures.rate) else 1.0 / figures.rate
        needed = readings_of_frozen(self._sensor.sigma, self._sensor.resolution, thresholds.frozen_false_alarm)
        limit, unchanged = max(thresholds.frozen_after, needed * known), figures.unchanged * known
        told = f"the reading has not changed for {unchanged:.1f} s: frozen"
        self._judge.check("unchanged_s", unchanged, Bounds(error=limit), told)
