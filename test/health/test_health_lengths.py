"""Deviations from the prediction on lengths: told in the unit of the channel without a cause, and ended with the deviation."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from boom_twin import Sample, Settings, Stream, Twin, load_scene, statics
from boom_twin.health.deviations import TipLoadMonitor
from boom_twin.types import Alarm

STEP, ONSET, END = 5_000_000, 600, 1800  # ns; samples
OFF = {  # of a channel that reads too much for 6 s
    "joint_2": (Stream.ANGLES, 1, 4e-3),
    "cylinder_force_2": (Stream.FORCES, 1, 9e3),
}


@lru_cache
def rest() -> tuple[np.ndarray, dict[Stream, np.ndarray]]:
    """Return cylinder lengths, and what other sensors read, of a boom at rest."""
    found = statics(load_scene(), posture="arch")
    first = Twin(load_scene()).update(Sample(Stream.STROKES, 0, np.array(found.lengths))).prediction
    pitch = first.tip_angle
    gravity = 9.81 * np.array([np.sin(pitch), np.cos(pitch)])
    others = {Stream.ANGLES: np.array(found.joints), Stream.IMU: gravity, Stream.FORCES: np.array(found.cylinder_forces)}
    return np.array(found.lengths), others


def alarms(stream: Stream, channel: int, shift: float, settings: Settings | None = None, ramp: int = 0) -> list[Alarm]:
    """Return every alarm that began or ended while a boom rests and a channel reads `shift` too much, after a `ramp`."""
    rng, found, sigmas = np.random.default_rng(5), [], {Stream.ANGLES: 1.745e-4, Stream.IMU: 0.05, Stream.FORCES: 100.0}
    lengths, others = rest()
    twin = Twin(load_scene(), settings, health=True)
    for k in range(4800):
        share = 1.0 if ramp == 0 else min(1.0, (k - ONSET) / ramp, (END - k) / ramp)
        readings = {Stream.STROKES: lengths + rng.normal(0.0, 2e-5, 4)}
        readings |= {each: others[each] + rng.normal(0.0, sigmas[each], len(others[each])) for each in others}
        readings[stream][channel] += shift * share if ONSET <= k < END else 0.0
        for each, values in readings.items():
            health = twin.update(Sample(each, 10**18 + k * STEP, values)).health
            found += [] if health is None else health.alarms
    return found


def test_a_healthy_boom_raises_none() -> None:
    assert alarms(Stream.STROKES, 0, 0.0) == []


@pytest.mark.parametrize("name", OFF)
def test_a_channel_that_is_off_is_told_in_its_unit_and_ends(name: str) -> None:
    """A sensor that drifts within a second, which is no jump."""
    stream, channel, shift = OFF[name]
    found = alarms(stream, channel, shift, ramp=200)
    assert {(alarm.channel, alarm.kind, alarm.cause) for alarm in found} == {(name, "deviation", None)}
    since, until = ((stamp - 10**18) * 1e-9 for stamp in (found[0].since, found[-1].until))
    assert 3.0 <= since < 8.0 and 9.0 <= until < 18.0  # a mean over 2 s falls from 52 mm to half of 5 mm in 6 s
    assert found[0].evidence.startswith("+") and found[0].ranked == ()


def test_a_stroke_transducer_that_is_off_shows_in_its_joint() -> None:
    found = [alarm for alarm in alarms(Stream.STROKES, 1, 1e-3) if alarm.kind == "deviation"]
    assert {alarm.channel for alarm in found} == {"joint_2"} and found[-1].until is not None


@pytest.mark.parametrize("name, limit", [("joint_2", "tip_deviation"), ("cylinder_force_2", "force_deviation")])
def test_limits_are_settings(name: str, limit: str) -> None:
    stream, channel, shift = OFF[name]
    larger = {"tip_deviation": 0.1, "force_deviation": 1e4}[limit]
    assert alarms(stream, channel, shift, Settings(**{limit: larger}), ramp=200) == []


def test_a_load_at_the_tip_above_its_limit_is_told_and_ends() -> None:
    """Estimates ten times a second: blows of 900 N half a second apart for 4 s, and pulses below the limit before and after."""
    monitor, news = TipLoadMonitor(500.0), list[Alarm]()
    for k in range(200):
        size = (900.0 if 50 <= k < 90 else 400.0) * (k % 5 == 0)
        by_lengths = np.array([0.0, -0.8 * size])
        news += monitor.take(k * 100_000_000, np.array([by_lengths, [0.0, -size]]), np.array([[1e6, 1e4], [1e4, 2500.0]]))
    began, ended = news
    assert (began.channel, began.cause, began.since, began.until) == ("tip", "tip.load", 5_000_000_000, None)
    assert "+900 N (+- 50), tip_load_limit" in began.evidence and ended.until == 8_500_000_000 and monitor.alarm is None


def test_a_load_that_lengths_contradict_is_no_load() -> None:
    """The estimate has 900 N, by late readings; lengths alone know that the load is 100 N, within 100 N."""
    monitor, loads = TipLoadMonitor(500.0), np.array([[0.0, -100.0], [0.0, -900.0]])
    assert [monitor.take(k * 100_000_000, loads, np.full((2, 2), 1e4)) for k in range(50)] == [[]] * 50
