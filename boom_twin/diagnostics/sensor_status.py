"""Status of a sensor: measuring, stuck or silent."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isnan

from ..config.settings import Settings
from ..health.sensor_check import readings_of_frozen, sensor_ranges
from ..scene.schema import Scene
from ..texts import alarm_text
from ..types import SENSORS, Mount, Stream
from .levels import Bounds, ComponentJudge, Status
from .stream_stats import ChannelStats

SLOW = 2.0  # largest step of stamps that is no gap at any rate, in sampling periods
RANGE_MARGIN = 5.0  # tolerance of a sensor's range, in standard deviations of its noise


@dataclass(frozen=True, slots=True)
class SensorSpec:
    """Specification of a sensor: channel, unit as suffix of a key (``m_s2``), range, noise, resolution."""

    name: str
    unit: str
    low: float
    high: float
    sigma: float
    resolution: float
    required: bool = True


def sensors_of(
    scene: Scene,
    settings: Settings,
    required: Mapping[Stream, bool],
    mounts: Sequence[Mount | None],
    absent: Collection[str] = (),
) -> dict[Stream, list[SensorSpec]]:
    """Return the sensors of every stream, in the order of a sample's values.

    Ranges are those of `boom_twin.health.sensor_check.sensor_ranges`. `required` has the inputs that the twin reads, True if
    it needs them. `absent` are channels without a sensor.
    """
    found = {}
    ranges = sensor_ranges(scene, mounts)
    for stream, kind in SENSORS.items():
        is_required = required.get(Stream(kind.beside or stream))
        if is_required is None or kind.gives:
            continue
        sigma, resolution = settings.noise(kind)
        unit, over = kind.unit_suffix, RANGE_MARGIN * sigma
        bounds = zip(kind.channels(len(scene.joints)), *(bound.tolist() for bound in ranges[stream]), strict=True)
        found[stream] = [
            SensorSpec(
                name, unit, low - over, high + over, sigma, resolution, is_required and not kind.beside and name not in absent
            )
            for name, low, high in bounds
        ]
    return found


def sensor_status(judge: ComponentJudge, sensor: SensorSpec, stats: ChannelStats, age: float) -> Status:
    """Return the status of a sensor by its statistics and the `age` (s) of its last reading.

    Faults have the texts of alarms of `boom_twin.health`.
    """
    thresholds, unit = judge.at.thresholds, sensor.unit
    if not stats.stamp and not sensor.required:
        return judge.finish("not there; optional")
    judge.note({f"value_{unit}": stats.value, "rate_Hz": stats.rate})
    judge.check_age(age, "no reading" if stats.stamp else "no reading yet")
    period = 0.0 if isnan(stats.rate) or stats.rate == 0.0 else 1.0 / stats.rate
    gap = Bounds(max(thresholds.gap_warn, SLOW * period))
    judge.check("gap_s", stats.gap, gap, "gap between readings", at_once=True)
    judge.note({"gaps": stats.gaps})
    share = Bounds(thresholds.unusable_warn, thresholds.unusable_error)
    judge.check("missing_share", stats.missing, share, "messages without a value")
    if sensor.high < inf:
        judge.note({f"low_{unit}": sensor.low, f"high_{unit}": sensor.high})
        judge.check("outside_share", stats.outside, share, alarm_text(sensor.name, "range", None))
    needed = readings_of_frozen(sensor.sigma, sensor.resolution, thresholds.frozen_false_alarm)
    stuck, unchanged = Bounds(error=max(thresholds.frozen_after, needed * period)), stats.unchanged * period
    judge.check("unchanged_s", unchanged, stuck, alarm_text(sensor.name, "stuck", None))
    return judge.finish("measuring" if stats.stamp else "waiting for a reading")
