"""Levels that must last, and what is told of one sensor."""

from __future__ import annotations

from math import inf, isnan, nan

import numpy as np
import pytest

from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.levels import Bounds, ComponentJudge, Evaluation, Hysteresis, Level
from boom_twin.diagnostics.sensor_status import Channel, ChannelStats, SensorSpec, sensor_status

SECOND = 1_000_000_000
NOISE = np.random.default_rng(0).normal(0.0, 1.0, 200)
STAMPS = SECOND + 5_000_000 * np.arange(200)


def look(stamps: np.ndarray = STAMPS, values: np.ndarray = NOISE, refused: int = 0) -> ChannelStats:
    return Channel().look(np.asarray(stamps, dtype=np.int64), np.asarray(values, dtype=float), refused, 0.1)


def test_figures_of_a_second() -> None:
    channel = Channel()
    channel.look(STAMPS, NOISE, 0, 0.1)
    well = channel.look(STAMPS + SECOND, NOISE, 0, 0.1)
    assert well.rate == pytest.approx(200.0) and well.gap == pytest.approx(0.005)
    assert (well.missing, well.value, well.stamp) == (0, NOISE[-1], STAMPS[-1] + SECOND)
    lacking = look(values=np.where((np.arange(200) >= 50) & (np.arange(200) < 70), nan, NOISE), refused=20)
    assert lacking.missing == pytest.approx(40 / 220) and lacking.rate == pytest.approx(179 / (199 * 0.005))
    assert lacking.gap == pytest.approx(21 * 0.005) and lacking.gaps == 1
    none = look(np.zeros(0), np.zeros(0))
    assert none.stamp == 0 and isnan(none.value) and isnan(none.rate) and isnan(none.missing)
    set_back = STAMPS - np.where(np.arange(200) >= 100, 3600 * SECOND, 0) + np.where(np.arange(200) >= 150, 7200 * SECOND, 0)
    assert look(set_back).gap == pytest.approx(0.005) and look(set_back).rate == pytest.approx(200.0)


SENSOR = SensorSpec("joint_1", "rad")
GOOD = ChannelStats(value=0.1, stamp=1, rate=200.0, gap=0.005, gaps=0, missing=0.0)
OPTIONAL = SensorSpec("tip_imu_x", "m_s2", False)


@pytest.mark.parametrize(
    ("changes", "age", "level", "words", "sensor"),
    [
        ({}, 0.0, Level.OK, "measuring", SENSOR),
        ({}, 2.5, Level.STALE, "no reading", SENSOR),
        ({"stamp": 0}, 2.5, Level.STALE, "no reading yet", SENSOR),
        ({"stamp": 0}, 0.5, Level.OK, "waiting for a reading", SENSOR),
        ({"stamp": 0, "missing": nan}, 99.0, Level.OK, "absent; optional", OPTIONAL),
        (
            {"stamp": 0, "missing": 1.0},
            9.0,
            Level.STALE,
            "no reading yet; messages without a value",
            OPTIONAL,
        ),  # as of another frame
        ({"gap": 0.2}, 0.0, Level.WARN, "gap between readings", SENSOR),
        ({"missing": 0.05}, 0.0, Level.WARN, "messages without a value", SENSOR),
        ({"missing": 0.8}, 0.0, Level.ERROR, "messages without a value", SENSOR),
    ],
)
def test_what_a_sensor_is_told_to_be(
    changes: dict[str, float], age: float, level: Level, words: str, sensor: SensorSpec
) -> None:
    judge = ComponentJudge("sensor joint_1")
    figures = ChannelStats(**{name: changes.get(name, getattr(GOOD, name)) for name in ChannelStats.__dataclass_fields__})
    for now in range(10):
        status = sensor_status(judge.begin(Evaluation(Thresholds(), float(now), 1e9 + now)), sensor, figures, age, None)
    assert (status.level, status.message) == (level, words)


BOUNDS, SLOW = Bounds(warn=1.0, error=2.0), Thresholds(raise_after=2.0, clear_after=5.0, release=0.8)
AT_ONCE = Thresholds(raise_after=0.0, clear_after=0.0, release=0.8)
LOW = Bounds(warn=100.0, error=10.0, low=True)


@pytest.mark.parametrize(
    ("values", "expected", "bounds", "thresholds"),
    [
        ([0, 1.5, 0, 1.5, 0], "OOOOO", BOUNDS, SLOW),  # too short
        ([0, 1.5, 1.5, 1.5, 1.5], "OOWWW", BOUNDS, SLOW),
        ([0, 2.5, 2.5, 2.5, 1.7, 1.7], "OOEEEE", BOUNDS, SLOW),  # not below 0.8 of the limit
        ([0, 2.5, 2.5, 1.5, 1.5, 1.5, 1.5, 1.5], "OOEEEEEW", BOUNDS, SLOW),
        ([0, 1.5, 1.5, 0.9, 0.9, 0.9, 0.9, 0.9], "OOWWWWWW", BOUNDS, SLOW),
        ([0, 1.5, 1.5, 0, 0, 1.5, 0, 0, 0, 0, 0], "OOWWWWWWWWO", BOUNDS, SLOW),
        ([nan, nan, nan], "OOO", BOUNDS, SLOW),
        ([0, 1.5, 2.5, 0], "OWEO", BOUNDS, AT_ONCE),
        ([inf, 101.0, 99.0, 9.0, 11.0, 13.0, 120.0, 126.0], "OOWEEWWO", LOW, AT_ONCE),
    ],
)
def test_a_level_must_last(values: list[float], expected: str, bounds: Bounds, thresholds: Thresholds) -> None:
    """First letters of the levels at one value a second."""
    judge = Hysteresis()
    found = [judge.update(value, bounds, thresholds, float(now)) for now, value in enumerate(values)]
    assert "".join(level.name[0] for level in found) == expected
