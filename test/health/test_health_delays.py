"""Lags of streams: told with size and deviation, by the name of the stream that is late, and by no other name."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from boom_twin import Sample, Settings, Stream, load_scene
from boom_twin.health.lag_monitor import LagMonitor
from boom_twin.health.monitor import HealthMonitor
from boom_twin.health.sensor_check import BLOCK as BLOCK_TIME
from boom_twin.health.sensor_check import Block, SensorCheck
from boom_twin.offline.ground_truth import load_truth
from boom_twin.types import NO_PLACES, Alarm, Array, StrokeReading, channels_of

from .recorded import ARCH, run, session

RATE, BLOCK = 20, 0.1  # readings of a block, its length in s
NONE = np.zeros(2, dtype=bool)  # masked channels
SIGMA = 1e-3  # rad, noise of a reading


def block_of(raw: Array, expected: Array, number: int, sigma: float = SIGMA) -> SensorCheck:
    """Return a check of readings (k, channels), evenly in time, with the deviation that is expected of their residuals."""
    count, edge = len(raw), np.zeros(raw.shape[1])
    stamps = number * BLOCK_TIME + np.arange(count) * (BLOCK_TIME // max(count, 1))
    check = SensorCheck(SIGMA, 0.0, edge, edge, 0.0)
    check.collect(np.arange(count), stamps, raw, raw - expected, np.full(raw.shape, sigma))
    check.take(Block(number), NONE)
    return check


def angles(times: Array) -> Array:
    """Return joint angles of a boom that goes to and fro and vibrates, rad."""
    return np.stack([0.3 * np.sin(0.4 * times), 0.2 * np.cos(0.31 * times)], axis=1) + 5e-3 * np.sin(6.6 * times)[:, None]


def judged(monitor: LagMonitor, lag: float, seconds: float, first: int = 0, **more: float) -> list[Alarm]:
    """Return what a monitor tells of angles that are so late (s), with noise and what else is wrong.

    With `imu`, a second stream is late by that time.
    """
    rng, news = np.random.default_rng(3), []
    lags = {Stream.ANGLES: lag} | ({Stream.IMU: more["imu"]} if "imu" in more else {})
    for number in range(first, first + round(seconds / BLOCK)):
        times, readings = BLOCK * (number + np.arange(RATE) / RATE), {}
        expected = angles(times)
        for stream, own in lags.items():
            read = angles(times - own) * more.get("scale", 1.0) + more.get("bias", 0.0) + rng.normal(0.0, SIGMA, (RATE, 2))
            read[:, 1] += math.nan if "lost" in more else 0.0
            readings[stream] = block_of(read, expected, number, more.get("sigma", SIGMA))
        news += monitor.take(readings, dict.fromkeys(lags, NONE), Block(number))
    return news


def size(alarm: Alarm) -> float:
    """Return the lag that an alarm states, s."""
    return 1e-3 * float(alarm.evidence.split()[0])


@pytest.mark.parametrize("lag", [0.03, 0.15, 0.5, 0.9])
def test_a_lag_is_told_with_its_size(lag: float) -> None:
    (alarm,) = judged(LagMonitor(Stream.STROKES), lag, 60.0)
    assert (alarm.channel, alarm.kind, alarm.cause) == ("joint_angles", "late", "joint_angles.delay")
    assert size(alarm) == pytest.approx(lag, abs=0.01)
    assert alarm.told == "Stamps of joint angles are late. Correct their delay in the mapping."


def test_an_alarm_tells_since_when_a_stream_is_late() -> None:
    monitor = LagMonitor(Stream.STROKES)
    assert not judged(monitor, 0.0, 20.0)
    (alarm,) = judged(monitor, 0.2, 20.0, first=200)
    assert 1e-9 * alarm.since == pytest.approx(20.0, abs=3.0)


def test_strokes_are_late_if_all_other_streams_are_early() -> None:
    """If only the angles are early, these are it."""
    (strokes,) = judged(LagMonitor(Stream.STROKES), -0.03, 40.0, imu=-0.03)
    assert (strokes.channel, strokes.cause) == ("cylinder_strokes", "cylinder_strokes.delay")
    assert size(strokes) == pytest.approx(0.03, abs=0.01)
    (angles,) = judged(LagMonitor(Stream.STROKES), -0.3, 40.0, imu=0.0)
    assert angles.channel == "joint_angles" and size(angles) == pytest.approx(-0.3, abs=0.01)


@pytest.mark.parametrize(
    ("lag", "wrong"),
    [(0.0, {}), (0.01, {}), (0.15, {"sigma": 0.05}), (0.0, {"bias": 0.02}), (0.0, {"scale": 1.05}), (0.0, {"lost": 1.0})],
)
def test_nothing_else_is_a_lag(lag: float, wrong: dict[str, float]) -> None:
    """Nor a small lag, or one within the deviation that the prediction states: nor encoders that read 5 % too much, or so many
    rad, or one that is silent."""
    assert judged(LagMonitor(Stream.STROKES), lag, 60.0, **wrong) == []


def test_a_lag_that_is_taken_back_ends() -> None:
    monitor = LagMonitor(Stream.STROKES)
    judged(monitor, 0.15, 30.0)
    assert monitor.is_late(Stream.ANGLES)
    (ended,) = judged(monitor, 0.0, 60.0, first=300)
    assert ended.until is not None and monitor.alarms == ()


def test_a_lag_that_came_later_is_told_with_its_size() -> None:
    monitor = LagMonitor(Stream.STROKES)
    assert judged(monitor, 0.0, 60.0) == []
    (alarm,) = judged(monitor, 0.3, 30.0, first=600)
    assert size(alarm) == pytest.approx(0.3, abs=0.03)


def test_little_evidence_tells_nothing() -> None:
    """Two spans; or gaps all the time."""
    monitor = LagMonitor(Stream.STROKES)
    assert judged(monitor, 0.15, 4.0) == []
    for number in range(0, 2000, 2):
        assert judged(monitor, 0.15, BLOCK, number) == []


def test_a_boom_at_rest_has_no_lag() -> None:
    """What is predicted has noise of its own, which readings differ by: no lag makes that go away."""
    rng, monitor = np.random.default_rng(8), LagMonitor(Stream.STROKES)
    for number in range(1000):
        expected = 1.0 + np.cumsum(rng.normal(0.0, 1e-5, (RATE, 2)), axis=0)
        readings = {Stream.ANGLES: block_of(1.0 + rng.normal(0.0, 2e-4, (RATE, 2)), expected, number)}
        assert monitor.take(readings, {Stream.ANGLES: NONE}, Block(number)) == []


def test_a_lag_that_fault_twins_name_too_is_one_alarm() -> None:
    streams = channels_of(4)
    monitor = HealthMonitor(load_scene(), Settings(), (None,) * 4, (), streams, StrokeReading.LENGTH, NO_PLACES, {})
    judged(monitor._lags, 0.03, 40.0)
    (alarm,) = monitor._lags.alarms
    monitor.fault_twins = SimpleNamespace(alarms=[replace(alarm, since=0)])  # type: ignore[assignment]
    assert list(monitor._lasting()) == [alarm]


def late(seconds: float, lag: float, late_stream: Stream = Stream.ANGLES) -> tuple[Sample, ...]:
    """Return the bundled session with the stamps of a stream so late (s)."""
    moved = [
        Sample(each.stream, each.stamp + round(lag * 1e9), each.values) if each.stream is late_stream else each
        for each in session(seconds)
    ]
    return tuple(sorted(moved, key=lambda each: each.stamp))


@pytest.mark.slow
def test_late_angles_are_told_as_that_alone_and_not_used() -> None:
    """What they show is of another time, in moves tens of millimetres off: no encoder is off its prediction by that."""
    found = run(late(40.0, 0.3))
    assert {(channel, kind) for _, channel, kind, _ in found.told()} == {("joint_angles", "late")}


def test_a_named_lag_of_strokes_is_in_the_stated_deviations() -> None:
    """The tip of late strokes is where the boom was: 60 ms ago it was up to 80 mm away."""
    samples, truth = late(25.0, 0.06, Stream.STROKES), load_truth(ARCH)
    found = run(samples)
    (named,) = {(time, channel) for time, channel, kind, _ in found.told() if kind == "late"}
    estimates = [each.estimate for each in found.reports if each.estimate is not None]
    first = min(each.stamp for each in session(25.0) if each.stream is Stream.STROKES)
    assert truth is not None and named[1] == "cylinder_strokes" and named[0] < 15.0
    times = np.array([(each.stamp - first) * 1e-9 + truth.times[0] for each in estimates])
    after = times - times[0] > named[0] + 0.5
    true = [truth.at(times, each)[after] for each in (truth.position, np.gradient(truth.position, truth.times, axis=0))]
    for true_value, value, variance, most in (
        (true[0], [each.tip[:2] for each in estimates], [each.tip_covariance[[0, 3]] for each in estimates], 0.02),
        (true[1], [each.velocity[:2] for each in estimates], [each.velocity_covariance[[0, 3]] for each in estimates], 0.02),
    ):
        error = np.array(value)[after] - true_value
        assert np.abs(error).max() > most and np.sqrt(np.mean(error**2 / np.array(variance)[after])) < 1.5
