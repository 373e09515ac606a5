"""The twin's health, end to end: the bundled session with faults of single sensors put on it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from health.recorded import NANO, PUMP, Outcome, run, session, spoilt

from boom_twin import Settings, Stream

DEGREE, ONSET = math.radians(1.0), 6.0


@lru_cache
def healthy() -> Outcome:
    return run(session())


@lru_cache
def faulty(stream: Stream, kind: str, channel: int, onset: float = ONSET) -> Outcome:
    rng, last = np.random.default_rng(channel), {}
    change = {
        "stuck": lambda v, t: last.setdefault("reading", v),
        "dropout": lambda v, t: np.nan,
        "spikes": lambda v, t: v + (2.0 * DEGREE if stream is Stream.ANGLES else 0.02) * (rng.random() < 0.02),
        "noise": lambda v, t: v + rng.normal(0.0, 10.0 * Settings().angle_sigma),
    }[kind]
    return run(spoilt(session(), stream, channel, change, onset))


def first_after(outcome: Outcome, onset: float) -> float:
    told = outcome.told()
    assert told and told[0][0] >= onset, "nothing before the fault"
    return told[0][0] - onset


def test_health_has_the_stamps_of_strokes():
    strokes = {sample.stamp for sample in session() if sample.stream is Stream.STROKES}
    assert len(healthy().health) >= 12 and {health.stamp for health in healthy().health} <= strokes


def test_an_imu_that_falls_silent():
    first = session()[0].stamp
    heard = [each for each in session() if each.stream is not Stream.IMU or not 5.0 < (each.stamp - first) * NANO < 8.0]
    ((time, channel, kind, cause),) = run(heard).told()
    assert 5.5 <= time < 6.0 and (channel, kind, cause) == ("tip_imu", "dropout", "tip_imu.sensor")


@pytest.mark.parametrize("kind, channel", [("stuck", 0), ("dropout", 1), ("spikes", 2), ("noise", 3)])
def test_an_angle_sensor(kind, channel):
    """Found within a second, that sensor named and no other; what the twin predicts is the same, bit for bit."""
    outcome = faulty(Stream.ANGLES, kind, channel)
    assert first_after(outcome, ONSET) <= 1.0
    assert outcome.causes() == {f"joint_{channel + 1}.sensor"}
    assert {alarm.channel for _, alarm in outcome.states()} == {f"joint_{channel + 1}"}
    assert outcome.tips().tobytes() == healthy().tips().tobytes()


@pytest.mark.parametrize("kind, channel", [("dropout", 0), ("spikes", 1)])
def test_a_stroke_sensor(kind, channel):
    """Told within a second by its own readings, and no other cause is named."""
    outcome = faulty(Stream.STROKES, kind, channel)
    assert first_after(outcome, ONSET) <= 1.0
    assert outcome.causes() == {f"cylinder_{channel + 1}.sensor"}


@pytest.mark.parametrize("lasts", [0.1, 0.5, 3.0])
def test_a_stroke_that_reads_zero_for_a_while_is_a_jump_until_it_is_back(lasts):
    found = spoilt(session(), Stream.STROKES, 1, lambda v, t: v - 0.02 if ONSET <= t < ONSET + lasts else v, -1.0)
    alarms = {alarm.since: alarm for _, alarm in run(found).states() if alarm.cause == "cylinder_2.sensor"}
    (alarm,) = alarms.values()
    assert alarm.kind == "jump" and alarm.until is not None


def test_spikes_of_a_stroke_do_not_move_the_tip():
    outcome = faulty(Stream.STROKES, "spikes", 1)
    moved = np.linalg.norm(outcome.tips() - healthy().tips(), axis=1)
    assert 0.0 < moved.max() < 5e-3  # the angle sensor replaces the transducer: its noise is 2 mm at the tip
    assert outcome.twin.counts["implausible"] > 0  # until the transducer is left out


def test_healthy_sessions_give_no_alarm():
    assert healthy().states() == []
    assert len(healthy().health) >= 10, "one a second"
    assert np.all(healthy().health[-1].tip_sigmas > 1e-5) and np.all(healthy().health[-1].tip_sigmas < 0.05)


def test_the_order_of_arrival_does_not_matter():
    """Angles that come 60 ms late, each in its own order: the same is told, at most a block later."""
    samples = spoilt(session(), Stream.ANGLES, 0, lambda v, t: 1.0)
    late = {Stream.STROKES: 0, Stream.ANGLES: 60_000_000, Stream.IMU: 35_000_000}
    shifted = sorted(samples, key=lambda sample: sample.stamp + late[sample.stream])
    assert [sample.stamp for sample in shifted] != [sample.stamp for sample in samples]
    one, other = run(samples), run(shifted)
    assert one.told() == other.told() and one.told()


def test_pump_and_wind_are_no_fault():
    """The bundled session that pulses of 130 N and gusts shake, which no twin knows of: no alarm."""
    outcome = run(session(30.0, PUMP))
    assert len(outcome.health) >= 28 and outcome.states() == []


def test_noise_of_all_sensors_at_once_is_told_as_noise():
    """Three times what is stated: angles that are as noisy as strokes are no sign that the boom is shaken."""
    rng, settings = np.random.default_rng(6), Settings()
    more = {Stream.STROKES: settings.stroke_sigma, Stream.ANGLES: settings.angle_sigma, Stream.IMU: settings.imu_sigma}
    noisy = [
        replace(s, values=s.values + rng.normal(0.0, math.sqrt(8.0) * more[s.stream], s.values.shape)) for s in session(12.0)
    ]
    assert run(noisy).health[-1].noise["noise_over_stroke_sigma"] > 1.8
    assert healthy().health[-1].noise["noise_over_stroke_sigma"] < 1.1


def test_after_a_gap_it_begins_anew():
    """6 s of silence: started again from rest, without an alarm of its own; later faults are found."""
    samples = spoilt(session(18.0), Stream.ANGLES, 0, lambda v, t: 1.0, 15.0)
    start = samples[0].stamp
    kept = [sample for sample in samples if not 5.0 < (sample.stamp - start) * NANO < 11.0]
    outcome = run(kept)
    assert outcome.twin.counts["restart"] == 1
    assert first_after(outcome, 15.0) <= 1.0 and outcome.causes() == {"joint_1.sensor"}


def test_an_alarm_ends_with_its_fault():
    """The encoder jumps by 0.2 degrees, and back after 3 s: its alarm ends, and nothing else is told."""
    outcome = run(spoilt(session(18.0), Stream.ANGLES, 1, lambda v, t: v + 0.2 * DEGREE * (t < 3.0), 6.0))
    assert outcome.causes() == {"joint_2.sensor"} and {alarm.kind for _, alarm in outcome.states()} == {"jump"}
    assert any(alarm.until is not None for _, alarm in outcome.states())
    assert outcome.health[-1].alarms == ()
