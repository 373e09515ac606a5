"""Status of every sensor: whether it measures, is frozen, or silent."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isnan

from ..config.settings import Settings, Thresholds
from ..health.sensor_check import readings_of_frozen, sensor_ranges
from ..scene.schema import Scene
from ..types import SENSORS, Mount, Stream
from .levels import Bounds, ComponentJudge, Evaluation, Status
from .stream_stats import ChannelStats


@dataclass(frozen=True, slots=True)
class SensorSpec:
    """Specification of a sensor: name of its status, range, noise and resolution, in its own unit.

    ``unit`` stands at the end of the keys of its values: ``rad``, ``m``, ``m_s2``.
    """

    name: str
    unit: str
    low: float
    high: float
    sigma: float
    resolution: float
    required: bool = True


class SensorJudge:
    """Judge of one sensor by its statistics."""

    def __init__(self, sensor: SensorSpec) -> None:
        self._sensor, self._judge = sensor, ComponentJudge(f"sensor {sensor.name}")

    def status(self, figures: ChannelStats, age: float, at: Evaluation) -> Status:
        """Return the status of the sensor.

        Parameters
        ----------
        figures : ChannelStats
        age : float
            Since its last reading, s.
        at : Evaluation
        """
        judge, sensor, thresholds = self._judge, self._sensor, at.thresholds
        judge.begin(at)
        if not figures.stamp and not sensor.required:
            return judge.finish("not there; optional")
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
        return judge.finish("measuring" if figures.stamp else "waiting for a reading")

    def _check_range(self, figures: ChannelStats, share: Bounds) -> None:
        if self._sensor.high < inf:
            low, high, unit = self._sensor.low, self._sensor.high, self._sensor.unit
            told = f"{figures.outside:.1%} of the readings out of {low:.6g} to {high:.6g} {unit}, newest {figures.value:.6g}"
            self._judge.note(f"low_{unit}", low)
            self._judge.note(f"high_{unit}", high)
            self._judge.check("outside_share", figures.outside, share, told)

    def _check_frozen(self, figures: ChannelStats, thresholds: Thresholds) -> None:
        """Judge for how long the reading has not changed, against what noise explains."""
        known = 0.0 if isnan(figures.rate) else 1.0 / figures.rate
        needed = readings_of_frozen(self._sensor.sigma, self._sensor.resolution, thresholds.frozen_false_alarm)
        limit, unchanged = max(thresholds.frozen_after, needed * known), figures.unchanged * known
        told = f"the reading has not changed for {unchanged:.1f} s: frozen"
        self._judge.check("unchanged_s", unchanged, Bounds(error=limit), told)


SLACK = 5.0
"""Deviations of its noise by which a sensor may read beyond the range of what it measures."""


def sensors_of(
    scene: Scene,
    settings: Settings,
    required: Mapping[Stream, bool],
    mounts: Sequence[Mount | None],
    absent: Collection[str] = (),
) -> dict[Stream, list[SensorSpec]]:
    """Return the sensors of every stream, in the order of a sample's values.

    Parameters
    ----------
    scene : Scene
        Gives the ranges, see `boom_twin.health.sensor_check.sensor_ranges`.
    settings : Settings
        Noise and resolution.
    required : dict of Stream to bool
        Whether the twin needs the stream.
    mounts : sequence of Mount or None
        Of the sensor of each joint; an inclinometer (not None) has no range of its own.
    absent : collection of str
        Channels without a sensor.
    """
    found = {}
    ranges = sensor_ranges(scene, mounts)
    for stream, kind in SENSORS.items():
        sigma, resolution = settings.noise(kind)
        unit, over = kind.unit_suffix, SLACK * sigma
        bounds = zip(kind.channels(len(scene.joints)), *(bound.tolist() for bound in ranges[stream]), strict=True)
        found[stream] = [
            SensorSpec(name, unit, low - over, high + over, sigma, resolution, required[stream] and name not in absent)
            for name, low, high in bounds
        ]
    return found
