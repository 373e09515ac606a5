"""A lag of the stamps of the angles: told with size and deviation, and by no other name."""

from __future__ import annotations

import math
from weakref import WeakKeyDictionary

import numpy as np
import pytest

from boom_twin import Sample, Stream
from boom_twin.health.blocks import BLOCK as BLOCK_TIME
from boom_twin.health.blocks import Block, MeasuredRows
from boom_twin.health.delay_monitor import DelayMonitor
from boom_twin.health.stream_readings import StreamReadings, StreamSurvey
from boom_twin.types import NANO, Alarm, Array

from .recorded import run, session

_SURVEYS: WeakKeyDictionary[object, StreamSurvey] = WeakKeyDictionary()
RATE, BLOCK = 20, 0.1  # readings of a block, its length in s
NONE = np.zeros(2, dtype=bool)  # masked channels


def block_of(judge: object, raw: Array, expected: Array, number: int) -> StreamReadings:
    """Return readings (k, channels), evenly in time, for `judge`, whose blocks before it count in the slow means."""
    count, channels = raw.shape
    survey = _SURVEYS.setdefault(judge, StreamSurvey(1.0, channels))
    stamps = number * BLOCK_TIME + np.arange(count) * (BLOCK_TIME // max(count, 1))
    rows = MeasuredRows(stamps, raw, raw - expected, np.ones(raw.shape))
    return survey.take(rows, np.zeros(channels, dtype=bool), BLOCK_TIME * NANO)


def angles(times: Array) -> Array:
    """Return joint angles of a boom that goes to and fro and vibrates, rad."""
    return np.stack([0.3 * np.sin(0.4 * times), 0.2 * np.cos(0.31 * times)], axis=1) + 5e-3 * np.sin(6.6 * times)[:, None]


def judged(monitor: DelayMonitor, lag: float, seconds: float, first: int = 0, **more: float) -> list[Alarm]:
    """Return what a monitor tells of readings that are so late (s), with noise and what else is wrong."""
    rng, news = np.random.default_rng(3), []
    for number in range(first, first + round(seconds / BLOCK)):
        times = BLOCK * (number + np.arange(RATE) / RATE)
        expected = angles(times)
        read = angles(times - lag) * more.get("scale", 1.0) + more.get("bias", 0.0) + rng.normal(0.0, 1e-3, expected.shape)
        read[:, 1] += more.get("lost", 0.0) * math.nan if "lost" in more else 0.0
        news += monitor.take(block_of(monitor, read, expected, number), NONE, Block(number))
    return news


@pytest.mark.parametrize("lag", [0.12, 0.15, 0.5, 1.0, -0.7])
def test_a_lag_is_told_with_its_size(lag: float) -> None:
    (alarm,) = judged(DelayMonitor(), lag, 40.0)
    assert (alarm.channel, alarm.kind, alarm.cause) == ("joint_angles", "late", "joint_angles.delay")
    assert float(alarm.evidence.split()[1]) == pytest.approx(lag, abs=0.01)
    assert alarm.told == "Stamps of joint angles are late. Correct their delay in the mapping."


@pytest.mark.parametrize(
    ("lag", "wrong"), [(0.0, {}), (0.05, {}), (0.0, {"bias": 0.02}), (0.0, {"scale": 1.05}), (0.0, {"lost": 1.0})]
)
def test_nothing_else_is_a_lag(lag: float, wrong: dict[str, float]) -> None:
    """Nor a small lag: encoders that read 5 % too much, or so many rad, or one that is silent."""
    assert judged(DelayMonitor(), lag, 60.0, **wrong) == []


def test_a_lag_that_is_taken_back_ends() -> None:
    monitor = DelayMonitor()
    judged(monitor, 0.15, 30.0)
    assert monitor.alarm is not None
    (ended,) = judged(monitor, 0.0, 60.0, first=300)
    assert ended.until is not None and monitor.alarm is None


def test_a_lag_that_came_later_is_told_with_its_size() -> None:
    monitor = DelayMonitor()
    assert judged(monitor, 0.0, 60.0) == []
    (alarm,) = judged(monitor, 0.3, 30.0, first=600)
    assert float(alarm.evidence.split()[1]) == pytest.approx(0.3, abs=0.03)


def test_little_evidence_tells_nothing() -> None:
    """Few spans; or blocks with one reading each, which have no slope; or gaps all the time."""
    monitor = DelayMonitor()
    assert judged(monitor, 0.15, 5.7) == []
    for number in range(0, 2000, 2):
        for count in (3, 1):
            readings = block_of(monitor, np.full((count, 2), 2.0), np.ones((count, 2)), number)
            assert monitor.take(readings, NONE, Block(number)) == []


def test_a_boom_at_rest_has_no_lag() -> None:
    """What is predicted has noise of its own, which readings differ by: no lag makes that go away."""
    rng, monitor = np.random.default_rng(8), DelayMonitor()
    for number in range(1000):
        expected = 1.0 + np.cumsum(rng.normal(0.0, 1e-5, (RATE, 2)), axis=0)
        read = 1.0 + rng.normal(0.0, 2e-4, (RATE, 2))
        assert monitor.take(block_of(monitor, read, expected, number), NONE, Block(number)) == []


def late(seconds: float, lag: float) -> tuple[Sample, ...]:
    """Return the bundled session with the angles' stamps so late (s)."""
    moved = [
        Sample(each.stream, each.stamp + round(lag * 1e9), each.values) if each.stream is Stream.ANGLES else each
        for each in session(seconds)
    ]
    return tuple(sorted(moved, key=lambda each: each.stamp))


@pytest.mark.slow
def test_late_angles_are_told_as_that_alone_and_not_used() -> None:
    """What they show is of another time, in moves tens of millimetres off: no encoder is off its prediction by that."""
    found = run(late(40.0, 0.3))
    assert {(channel, kind) for _, channel, kind, _ in found.told()} == {("joint_angles", "late")}
