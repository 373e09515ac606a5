"""The twin's health, end to end: the bundled session with faults of single sensors put on it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from drive_twin import PUMP_DRIVES, drive_twin
from health.recorded import NANO, Outcome, run, session, spoilt

from boom_twin import Sample, Settings, Stream, load_scene
from boom_twin.health.baseline import Baseline

DEGREE, ONSET = math.radians(1.0), 6.0
JOINTS = range(4)


@lru_cache
def healthy() -> Outcome:
    return run(session())


@lru_cache
def faulty(stream: Stream, kind: str, channel: int, onset: float = ONSET) -> Outcome:
    rng, last = np.random.default_rng(channel), {}
    change = {
        "bias": lambda v, t: v + (0.2 * DEGREE if stream is Stream.ANGLES else 2e-3),
        "stuck": lambda v, t: last.setdefault("reading", v),
        "dropout": lambda v, t: np.nan,
        "spikes": lambda v, t: v + (2.0 * DEGREE if stream is Stream.ANGLES else 0.02) * (rng.random() < 0.02),
        "noise": lambda v, t: v + rng.normal(0.0, 10.0 * Settings().angle_sigma),
    }[kind]
    return run(spoilt(session(), stream, channel, change, onset))


def with_others_slow(kinds):
    """Each kind on one joint at once, on the others in the long run."""
    return [
        pytest.param(kind, channel, marks=[] if channel == k % 4 else pytest.mark.slow)
        for k, kind in enumerate(kinds)
        for channel in JOINTS
    ]


def first_after(outcome: Outcome, onset: float) -> float:
    told = outcome.told()
    assert told and told[0][0] >= onset, "nothing before the fault"
    return told[0][0] - onset


ANGLE_KINDS = {"bias": 5.0, "stuck": 1.0, "dropout": 1.0, "spikes": 1.0, "noise": 1.0}


@pytest.mark.parametrize("kind, channel", with_others_slow(ANGLE_KINDS))
def test_an_angle_sensor(kind, channel):
    """Found in time, that sensor named and no other; what the twin predicts is the same, bit for bit."""
    outcome = faulty(Stream.ANGLES, kind, channel)
    assert first_after(outcome, ONSET) <= ANGLE_KINDS[kind]
    assert outcome.causes() == {f"joint_{channel + 1}.sensor"}
    assert {alarm.channel for _, alarm in outcome.states()} == {f"joint_{channel + 1}"}
    assert outcome.tips().tobytes() == healthy().tips().tobytes()


@pytest.mark.parametrize("channel", [0, *(pytest.param(i, marks=pytest.mark.slow) for i in (1, 2, 3))])
def test_an_angle_sensor_that_was_never_right(channel):
    """A bias from the start may be a softer cylinder as well; it is told within 5 s, and no wrong name is."""
    outcome = faulty(Stream.ANGLES, "bias", channel, 0.0)
    assert first_after(outcome, 0.0) <= 5.0
    assert outcome.causes() <= {f"joint_{channel + 1}.sensor"}


@pytest.mark.parametrize("channel", [1, *(pytest.param(i, marks=pytest.mark.slow) for i in (0, 2, 3))])
def test_a_scale_of_an_encoder_is_no_scale_of_its_stroke(channel):
    """One percent, from the start; as long as it was no hypothesis it was named as the cylinder's, with a probability of 1."""
    outcome = run(spoilt(session(60.0), Stream.ANGLES, channel, lambda v, t: 1.01 * v, -1.0))
    assert first_after(outcome, 0.0) <= 15.0
    assert outcome.causes() == {f"joint_{channel + 1}.sensor"}
    assert {alarm.kind for _, alarm in outcome.states() if alarm.cause is not None} == {"scale"}


@pytest.mark.parametrize("bias", [0.02, 0.05])
@pytest.mark.parametrize("channel", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_large_offset_at_rest_is_not_named_by_its_size(channel, bias):
    """Encoder or stroke, without an IMU: the same in one posture, whichever is more usual to be off by so much; made up."""
    rest, rng, found = [s for s in session()[:3] if s.stream is not Stream.IMU], np.random.default_rng(channel), []
    sigma = {Stream.STROKES: Settings().stroke_sigma, Stream.ANGLES: Settings().angle_sigma}
    for k in range(3000):
        for sample in rest:
            values = sample.values + rng.normal(0.0, sigma[sample.stream], len(sample.values))
            found.append(Sample(sample.stream, sample.stamp + k * 5_000_000, values))
    outcome = run(spoilt(found, Stream.ANGLES, channel, lambda v, t: v + bias, -1.0))
    both = {f"joint_{channel + 1}.sensor", f"cylinder_{channel + 1}.sensor"}
    (alarm,) = {alarm.since: alarm for _, alarm in outcome.states()}.values()
    assert alarm.cause is None and both <= {each.cause for each in alarm.ranked} and outcome.causes() == set()


@pytest.mark.parametrize("kind, channel", with_others_slow(["bias", "stuck", "dropout", "spikes"]))
def test_a_stroke_sensor(kind, channel):
    """Named, or the cause stays open; never another. Single spikes and silence are told within 1 s."""
    outcome = faulty(Stream.STROKES, kind, channel)
    assert outcome.causes() <= {f"cylinder_{channel + 1}.sensor"}
    if kind != "stuck":
        assert first_after(outcome, ONSET) <= {"bias": 5.0, "spikes": 1.0, "dropout": 1.0}[kind]


@pytest.mark.parametrize("lasts", [0.1, 0.5, 3.0])
def test_a_stroke_that_reads_zero_for_a_while_is_a_jump_until_it_is_back(lasts):
    """Before it was held it was followed: a tip 2 m off, and no alarm."""
    found = spoilt(session(), Stream.STROKES, 1, lambda v, t: v - 0.02 if ONSET <= t < ONSET + lasts else v, -1.0)
    alarms = {alarm.since: alarm for _, alarm in run(found).states() if alarm.cause == "cylinder_2.sensor"}
    (alarm,) = alarms.values()
    assert alarm.kind == "jump" and alarm.until is not None


@pytest.mark.parametrize("channel", [1, *(pytest.param(i, marks=pytest.mark.slow) for i in (0, 2, 3))])
def test_spikes_of_a_stroke_do_not_move_the_tip(channel):
    outcome = faulty(Stream.STROKES, "spikes", channel)
    moved = np.linalg.norm(outcome.tips() - healthy().tips(), axis=1)
    assert 0.0 < moved.max() < 1e-3
    assert outcome.twin.counts["implausible"] > 10


def test_healthy_sessions_give_no_alarm():
    assert healthy().states() == []
    assert len(healthy().health) >= 10, "one a second"
    assert all((health.levels < 1.0).all() for health in healthy().health)
    assert np.all(healthy().health[-1].tip_sigmas > 1e-5) and np.all(healthy().health[-1].tip_sigmas < 0.05)


@pytest.mark.slow  # 60 s of session, against 12 s of all others
def test_innovations_of_a_right_model_are_white():
    """The bundled session with nothing learnt: model errors that could be there are not, so their variance is below 1."""
    twin, found = drive_twin(load_scene(), baseline=Baseline()), []
    for sample in session(60.0):
        twin.update(sample)
        if not found or twin.judge.residuals.surprise is not found[-1]:
            found.append(twin.judge.residuals.surprise)
    left = np.array([row for row in found if np.isfinite(row).all()])
    assert len(left) > 590
    assert np.abs(left.mean(axis=0)).max() < 4.0 / math.sqrt(len(left))
    assert left.var(axis=0).min() > 0.25 and left.var(axis=0).max() < 1.15
    assert np.abs((left[1:] * left[:-1]).mean(axis=0)).max() < 4.0 / math.sqrt(len(left))
    assert np.abs(left).max() < 4.5


def told(outcome: Outcome):
    return [(health.stamp, health.alarms, health.levels.tobytes(), health.tip_sigmas.tobytes()) for health in outcome.health]


def test_twice_is_the_same():
    again = faulty.__wrapped__(Stream.ANGLES, "bias", 0)
    assert told(again) == told(faulty(Stream.ANGLES, "bias", 0)) and again.told()


def test_the_order_of_arrival_does_not_matter():
    """Angles that come 60 ms late, each in its own order: the same is told, at most a block later."""
    samples = spoilt(session(), Stream.ANGLES, 0, lambda v, t: v + 0.2 * DEGREE)
    late = {Stream.STROKES: 0, Stream.ANGLES: 60_000_000, Stream.IMU: 35_000_000}
    shifted = sorted(samples, key=lambda sample: sample.stamp + late[sample.stream])
    assert [sample.stamp for sample in shifted] != [sample.stamp for sample in samples]
    one, other = faulty(Stream.ANGLES, "bias", 0), run(shifted)
    assert one.told() == other.told() and one.told()
    assert [health.levels.tobytes() for health in one.health] == [health.levels.tobytes() for health in other.health]


def test_pump_and_wind_are_no_fault():
    """The bundled session that pulses of 130 N and gusts shake, which no twin knows of: no alarm."""
    outcome = run(session(40.0, PUMP_DRIVES))
    assert len(outcome.health) >= 38 and outcome.states() == []


def test_a_fault_under_pump_and_wind():
    """An encoder that reads 0.5 degrees too much all of a sudden while the boom is shaken: told, and no other is accused."""
    outcome = run(spoilt(session(25.0, PUMP_DRIVES), Stream.ANGLES, 2, lambda v, t: v + 0.5 * DEGREE * min(1.0, t / 2.0), 8.0))
    assert outcome.told() and outcome.told()[0][0] >= 8.0
    assert outcome.causes() <= {"joint_3.sensor"}
    assert "joint_3.sensor" in [rank.cause for rank in outcome.states()[-1][1].ranked[:2]]


def test_a_slow_fault_is_not_another():
    """A bias that comes on over 6 s is told while it grows; no other cause is ever named."""
    outcome = run(spoilt(session(25.0), Stream.ANGLES, 1, lambda v, t: v + 0.3 * DEGREE * min(1.0, t / 6.0), 5.0))
    assert first_after(outcome, 5.0) <= 8.0
    assert outcome.causes() <= {"joint_2.sensor"}
    assert "joint_2.sensor" in [rank.cause for rank in outcome.states()[-1][1].ranked[:2]]


def test_twice_the_stated_noise_gives_no_spikes():
    rng, sigma = np.random.default_rng(5), math.sqrt(3.0) * Settings().angle_sigma
    noisy = [replace(s, values=s.values + rng.normal(0.0, sigma, 4)) if s.stream is Stream.ANGLES else s for s in session(18.0)]
    assert run(noisy).states() == []


def test_noise_of_all_sensors_at_once_is_told_as_noise():
    """Three times what is stated: angles that are as noisy as strokes are no sign that the boom is shaken."""
    rng, settings = np.random.default_rng(6), Settings()
    more = {Stream.STROKES: settings.stroke_sigma, Stream.ANGLES: settings.angle_sigma, Stream.IMU: settings.imu_sigma}
    noisy = [
        replace(s, values=s.values + rng.normal(0.0, math.sqrt(8.0) * more[s.stream], s.values.shape)) for s in session(12.0)
    ]
    assert run(noisy).health[-1].noise["noise_over_stroke_sigma"] > 1.8
    assert healthy().health[-1].noise["noise_over_stroke_sigma"] < 1.1


def test_noise_of_strokes_is_no_load() -> None:
    """Five times as noisy as stated, they put the estimate off by 30 mm and more, by a load of 500 N that was none."""
    samples, rng, sigma = session(25.0), np.random.default_rng(4), Settings().stroke_sigma
    noisy = [
        replace(each, values=each.values + 4.9 * sigma * rng.normal(size=4)) if each.stream is Stream.STROKES else each
        for each in samples
    ]
    found, quiet = (
        [report.estimate for report in run(each).reports if report.estimate is not None][600:] for each in (noisy, samples)
    )
    off = np.array([each.tip[:2] for each in found]) - [each.tip[:2] for each in quiet]
    stated = np.sqrt([each.tip_covariance[[0, 3]] for each in found])
    assert np.sqrt(np.mean(off**2)) < 3e-3
    assert np.sqrt(np.mean((off / stated) ** 2)) < 1.2
    assert np.abs([each.load for each in found]).max() < 150.0


def test_a_twin_without_a_baseline_tells_nothing():
    twin = drive_twin(load_scene())
    outcome = run(session(3.0), twin=twin)
    assert outcome.health == [] and twin.judge is None
    assert outcome.tips().tobytes() == healthy().tips()[: len(outcome.tips())].tobytes()


def test_another_load_is_asked_for():
    """40 kg that are not there: an alarm; taken back, it is over and all is well again."""
    samples, start = session(18.0), session()[0].stamp
    twin, alarms = drive_twin(load_scene(), baseline=Baseline()), []
    for sample in samples:
        time = (sample.stamp - start) * NANO
        if sample.stream is Stream.STROKES and abs(time - 5.0) < 0.0025:
            twin.requests.tune({"payload": 40.0})
        if sample.stream is Stream.STROKES and abs(time - 15.0) < 0.0025:
            twin.requests.tune({"payload": -1.0})
        health = twin.update(sample).health
        alarms += [] if health is None else [(time, alarm) for alarm in health.alarms]
    assert twin.counts["load"] == 2
    times = [time for time, _ in alarms]
    assert 5.0 < min(times) < 13.0 and max(times) < 16.0
    assert {alarm.cause for _, alarm in alarms} <= {None, "tip.payload"}


def test_after_a_gap_it_begins_anew():
    """6 s of silence: started again from rest, without an alarm of its own; later faults are found."""
    samples = spoilt(session(18.0), Stream.ANGLES, 0, lambda v, t: v + 0.2 * DEGREE, 15.0)
    start = samples[0].stamp
    kept = [sample for sample in samples if not 5.0 < (sample.stamp - start) * NANO < 11.0]
    outcome = run(kept)
    assert outcome.twin.counts["restart"] == 1
    assert first_after(outcome, 15.0) <= 5.0 and outcome.causes() == {"joint_1.sensor"}


def test_without_an_imu():
    """Angles alone tell a sensor that jumps; the IMU's channels are silent."""
    samples = [s for s in faulty_samples() if s.stream is not Stream.IMU]
    outcome = run(samples)
    assert outcome.causes() == {"joint_2.sensor"}
    assert not np.isfinite(outcome.twin.judge.residuals.surprise[-2:]).any()


def faulty_samples() -> list[Sample]:
    return spoilt(session(), Stream.ANGLES, 1, lambda v, t: v + 0.2 * DEGREE, 6.0)


def test_an_alarm_ends_with_its_fault():
    """The bias goes after 3 s: its alarm ends, and nothing else is told."""
    samples = spoilt(session(18.0), Stream.ANGLES, 1, lambda v, t: v + 0.2 * DEGREE * (t < 3.0), 6.0)
    outcome = run(samples)
    assert outcome.causes() == {"joint_2.sensor"}
    assert any(alarm.until is not None for _, alarm in outcome.states())
    assert outcome.health[-1].alarms == ()


def test_the_end_of_a_fault_without_a_name_is_told():
    """Of a stroke's offset of 0.5 mm that may be the encoder's as well; without an IMU its alarm lasted on, as a load."""
    samples = [sample for sample in session(36.0) if sample.stream is not Stream.IMU]
    outcome = run(spoilt(samples, Stream.STROKES, 3, lambda v, t: v + 5e-4 * (t < 20.0), 5.0))
    assert first_after(outcome, 5.0) <= 5.0 and outcome.causes() == set()
    assert max(time for time, alarm in outcome.states() if alarm.until is None) < 30.0
    assert outcome.states()[-1][1].until is not None


@pytest.mark.parametrize("end", [18.0, 21.0])
def test_the_end_does_not_wait_for_evidence_that_began_before_it(end):
    """It comes in the midst of what was collected afresh, and the next one was judged 4.4 s after it."""
    samples = [sample for sample in session(36.0) if sample.stream is not Stream.IMU]
    outcome = run(spoilt(samples, Stream.STROKES, 3, lambda v, t: v + 5e-4 * (t < end), 5.0))
    assert 0.0 < max(time for time, alarm in outcome.states() if alarm.until is None) - 5.0 - end < 4.0


def test_a_drift_that_is_over_is_no_jump():
    """The encoder wanders by 0.1 degrees a second for 10 s and is right again at once: no alarm lasts, nor begins."""
    outcome = run(spoilt(session(30.0), Stream.ANGLES, 1, lambda v, t: v + 0.1 * DEGREE * t * (t < 10.0), 5.0))
    assert "jump" not in {alarm.kind for _, alarm in outcome.states()}
    assert first_after(outcome, 5.0) < 10.0
    assert max(time for time, alarm in outcome.states() if alarm.until is None) < 23.0
