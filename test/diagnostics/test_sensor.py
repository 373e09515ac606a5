"""Figures of one sensor, and what is made of them."""

from __future__ import annotations

from math import inf, isnan, nan

import numpy as np
import pytest

from boom_twin.config.settings import Settings, Thresholds
from boom_twin.diagnostics.levels import ComponentJudge, Evaluation, Level
from boom_twin.diagnostics.sensor_status import SensorSpec, sensor_status, sensors_of
from boom_twin.diagnostics.stream_stats import Channel, ChannelStats, StreamWatch
from boom_twin.scene import load_scene
from boom_twin.types import Sample, Stream

SECOND = 1_000_000_000
NOISE = np.random.default_rng(0).normal(0.0, 1.0, 200)
STAMPS = SECOND + 5_000_000 * np.arange(200)
ALL = dict.fromkeys(Stream, True)


def look(stamps: np.ndarray = STAMPS, values: np.ndarray = NOISE, refused: int = 0) -> ChannelStats:
    return Channel(-4.0, 4.0).look(np.asarray(stamps, dtype=np.int64), np.asarray(values, dtype=float), refused, 0.1)


def test_a_healthy_second() -> None:
    channel = Channel(-4.0, 4.0)
    channel.look(STAMPS, NOISE, 0, 0.1)
    figures = channel.look(STAMPS + SECOND, NOISE, 0, 0.1)
    assert figures.rate == pytest.approx(200.0) and figures.gap == pytest.approx(0.005)
    assert (figures.missing, figures.outside, figures.unchanged) == (0.0, 0.0, 0)
    assert (figures.value, figures.stamp) == (NOISE[-1], STAMPS[-1] + SECOND)


def test_missing_and_refused_readings() -> None:
    values = NOISE.copy()
    values[50:70] = nan
    figures = look(values=values, refused=20)
    assert figures.missing == pytest.approx(40 / 220)
    assert figures.gap == pytest.approx(21 * 0.005) and figures.gaps == 1
    assert figures.rate == pytest.approx(179 / (199 * 0.005))


def test_readings_out_of_range() -> None:
    values = NOISE.copy()
    values[:30] = 4.5
    assert look(values=values).outside == 30 / 200


def test_a_reading_that_does_not_change_is_counted_over_looks() -> None:
    channel, values = Channel(), NOISE.copy()
    values[150:] = 1.0
    counts = [channel.look(STAMPS + k * SECOND, values if k == 0 else np.ones(200), 0, 0.1).unchanged for k in range(3)]
    assert counts == [49, 249, 449]
    assert channel.look(STAMPS + 3 * SECOND, NOISE, 0, 0.1).unchanged == 0


def test_nothing_came() -> None:
    figures = look(np.zeros(0), np.zeros(0))
    assert figures.stamp == 0 and isnan(figures.value) and isnan(figures.rate) and isnan(figures.missing)


def test_steps_of_a_clock_that_was_set_are_no_gaps() -> None:
    stamps = STAMPS.copy()
    stamps[100:] -= 3600 * SECOND
    stamps[150:] += 7200 * SECOND
    figures = look(stamps)
    assert figures.gap == pytest.approx(0.005) and figures.rate == pytest.approx(200.0)


def test_a_stream_gives_each_channel_its_own() -> None:
    watch = StreamWatch(np.array([[-inf, inf], [-inf, 1.0]]))
    for k in range(10):
        watch.seen(SECOND + k * 10_000_000)
        if k != 4:
            watch.took(Sample(Stream.ANGLES, SECOND + k * 10_000_000, np.array([0.1 * k, nan if k > 6 else 2.0])))
    first, second = watch.look(0.1)
    assert (watch.count, first.missing, first.outside) == (10, pytest.approx(0.1), 0.0)
    assert (second.missing, second.outside, second.unchanged) == (pytest.approx(0.4), pytest.approx(0.6), 5)
    assert watch.age_of(second, 1e9) - watch.age_of(first, 1e9) == pytest.approx(0.03)
    assert [figures.missing for figures in watch.look(0.1)] == [pytest.approx(nan, nan_ok=True)] * 2


def test_lags_tell_how_clocks_are_apart() -> None:
    streams = [StreamWatch(np.array([[0.0, 1.0]])) for _ in range(2)]
    for k in range(5):
        for stream, behind in zip(streams, (0, 70_000_000), strict=True):
            stream.seen(SECOND + k * 5_000_000 - behind)
    for stream in streams:
        stream.look(0.1)
    assert streams[1].lag - streams[0].lag == pytest.approx(0.07, abs=0.005)


SENSOR = SensorSpec("joint_1", "rad", -4.0, 4.0, 1.0, 0.1)
GOOD = ChannelStats(value=0.1, stamp=1, rate=200.0, gap=0.005, gaps=0, missing=0.0, outside=0.0, unchanged=1)


def judged(changes: dict[str, float], age: float = 0.0, sensor: SensorSpec = SENSOR) -> tuple[Level, str]:
    """Level and message after ten seconds of it."""
    judge = ComponentJudge("sensor joint_1")
    figures = ChannelStats(**{name: changes.get(name, getattr(GOOD, name)) for name in ChannelStats.__dataclass_fields__})
    for now in range(10):
        status = sensor_status(judge.begin(Evaluation(Thresholds(), float(now), 1e9 + now)), sensor, figures, age)
    return status.level, status.message


@pytest.mark.parametrize(
    ("changes", "age", "level", "words"),
    [
        ({}, 0.0, Level.OK, "measuring"),
        ({}, 2.5, Level.STALE, "no reading for 2.5 s"),
        ({"stamp": 0}, 2.5, Level.STALE, "no reading yet"),
        ({"stamp": 0}, 0.5, Level.OK, "waiting for a reading"),
        ({"gap": 0.2}, 0.0, Level.WARN, "gap of 0.200 s"),
        ({"missing": 0.05}, 0.0, Level.WARN, "5.0% of the messages without a value"),
        ({"missing": 0.8}, 0.0, Level.ERROR, "80.0% of the messages without a value"),
        ({"outside": 0.8, "value": 7.0}, 0.0, Level.ERROR, "80.0% of the readings out of -4 to 4 rad, newest 7"),
        ({"unchanged": 199}, 0.0, Level.OK, "measuring"),
        ({"unchanged": 400}, 0.0, Level.ERROR, "the reading has not changed for 2.0 s: frozen"),
    ],
)
def test_what_a_sensor_is_told_to_be(changes: dict[str, float], age: float, level: Level, words: str) -> None:
    assert judged(changes, age) == (level, words)


def test_an_optional_sensor_may_be_absent() -> None:
    assert judged({"stamp": 0}, 99.0, SensorSpec("tip_imu_x", "m_s2", -inf, inf, 0.05, 0.0, False)) == (
        Level.OK,
        "not there; optional",
    )


def test_sensors_of_the_default_scene() -> None:
    scene, settings = load_scene(), Settings()
    sensors = sensors_of(scene, settings, ALL, [None] * 4)
    assert [sensor.name for sensor in sensors[Stream.STROKES]] == [f"cylinder_{i}" for i in (1, 2, 3, 4)]
    assert sensors[Stream.STROKES][0].high == pytest.approx(scene.joints[0].cylinder.max_stroke, abs=2e-4)
    assert np.degrees(sensors[Stream.ANGLES][1].low) == pytest.approx(scene.joints[1].range_deg[0] - 5.0, abs=0.1), "with sag"
    assert [sensor.name for sensor in sensors[Stream.IMU]] == ["tip_imu_x", "tip_imu_z"]
