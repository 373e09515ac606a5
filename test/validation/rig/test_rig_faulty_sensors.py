"""Sensor faults: each does what it says, from its onset on, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from recordings import samples_in_rows

pytest.importorskip("exudyn")

from boom_twin import Stream
from boom_twin.validation.rig.faults import SPIKE_SHARE, parse, spoil
from boom_twin.validation.rig.session import EPOCH, RigSession

ONSET = 4.0
ARRAYS = ("stamps", "strokes", "joints", "imu", "angle_stamps")


@pytest.fixture(scope="module")
def healthy():
    rng = np.random.default_rng(5)
    times = (np.arange(2000) + 0.5) / 200.0
    true = {"t": times, "strokes": 0.2 + 0.01 * np.outer(times, [1, 2, 3]), "joints": 0.1 * np.outer(times, [3, 2, 1])}
    noisy = {name: true[name] + 1e-4 * rng.standard_normal((2000, 3)) for name in ("strokes", "joints")}
    stamps = EPOCH + np.rint(times * 1e9).astype(np.int64)
    true["forces"] = 1e4 * np.outer(1.0 + times, [1, -2, 3])
    imu, forces = rng.standard_normal((2000, 2)), true["forces"] + 100.0 * rng.standard_normal((2000, 3))
    return RigSession(stamps, noisy["strokes"], noisy["joints"], imu, stamps, forces, true)


def spoilt(healthy, text, seed=1):
    """The session with the fault, and its readings of that sensor after the onset, with those of before."""
    fault = parse(f"{text}@{ONSET:g}")
    session = spoil(healthy, [fault], seed)
    name = "joints" if fault.cause.startswith("joint") else "strokes"
    after = healthy.truth["t"] >= ONSET
    column = fault.number - 1
    return session, getattr(session, name)[after, column], getattr(healthy, name)[after, column]


@pytest.mark.parametrize(("owner", "name"), [("joint", "joints"), ("cylinder", "strokes"), ("cylinder_force", "forces")])
@pytest.mark.parametrize("kind", ["bias:0.01", "drift:0.01", "scale:0.02", "stuck", "noisy:3", "spikes:0.1", "dropout:0.3"])
def test_one_reading_alone_is_wrong_and_from_the_onset_on(healthy, owner, name, kind):
    session, before = spoil(healthy, [parse(f"{owner}_2.sensor:{kind}@{ONSET:g}")], 1), healthy.truth["t"] < ONSET
    for other in {*ARRAYS, "forces"} - {name}:
        assert np.array_equal(getattr(session, other), getattr(healthy, other)), other
    changed = getattr(session, name) != getattr(healthy, name)
    assert not changed[:, [0, 2]].any() and not changed[before].any() and changed[:, 1].any()
    assert session.truth is healthy.truth


def test_size_of_a_fault_is_what_it_says(healthy):
    after = healthy.truth["t"] >= ONSET
    true, since = healthy.truth["joints"][after, 0], healthy.truth["t"][after] - ONSET
    _, read, was = spoilt(healthy, "joint_1.sensor:bias:0.01")
    assert read - was == pytest.approx(0.01, abs=1e-15)
    _, read, was = spoilt(healthy, "joint_1.sensor:drift:-0.02")
    assert read - was == pytest.approx(-0.02 * since, abs=1e-15)
    _, read, was = spoilt(healthy, "cylinder_3.sensor:scale:0.05")
    assert read == pytest.approx(1.05 * was, abs=1e-15)
    _, read, _ = spoilt(healthy, "joint_1.sensor:stuck")
    assert np.all(read == healthy.joints[~after, 0][-1])
    _, read, was = spoilt(healthy, "joint_1.sensor:noisy:4")
    assert read - true == pytest.approx(4.0 * (was - true), abs=1e-12)
    assert spoil(healthy, [parse("cylinder_2.drive:drift:0.001@1")], 1) is healthy  # the boom has followed it already


def test_spikes_and_dropouts_come_as_often_as_they_say(healthy):
    _, read, was = spoilt(healthy, "cylinder_1.sensor:spikes:0.3")
    hit = read != was
    assert np.abs(read - was)[hit] == pytest.approx(0.3) and {-1.0, 1.0} == set(np.sign(read - was)[hit])
    assert hit.mean() == pytest.approx(SPIKE_SHARE, abs=0.015)
    _, read, _ = spoilt(healthy, "cylinder_1.sensor:dropout:0.4")
    assert np.isnan(read).mean() == pytest.approx(0.4, abs=0.06)
    assert np.isnan(spoilt(healthy, "joint_1.sensor:dropout:1")[1]).all()


def test_faults_come_on_over_their_ramp_and_go(healthy):
    times = healthy.truth["t"]
    share = np.interp(times, [2.0, 4.0, 6.0, 8.0], [0.0, 1.0, 1.0, 0.0])
    session = spoil(healthy, [parse("joint_1.sensor:bias:0.01@2+2..6")], 1)
    assert session.joints[:, 0] - healthy.joints[:, 0] == pytest.approx(0.01 * share, abs=1e-12)
    session = spoil(healthy, [parse("joint_1.sensor:noisy:4@2+2..6")], 1)
    error = session.joints[:, 0] - healthy.truth["joints"][:, 0]
    assert error == pytest.approx((1 + 3 * share) * (healthy.joints - healthy.truth["joints"])[:, 0], abs=1e-12)
    for text in ("joint_1.sensor:drift:0.01@2..6", "joint_1.sensor:stuck@2..6", "joint_1.sensor:dropout:0.5@2+1..6"):
        changed = spoil(healthy, [parse(text)], 1).joints[:, 0] != healthy.joints[:, 0]
        assert changed.any() and not changed[(times < 2.0) | (times >= 7.0)].any(), text
    late = spoil(healthy, [parse("joint_angles.delay:late:0.03@2+2..6")], 1).angle_stamps - healthy.angle_stamps
    assert late == pytest.approx(3e7 * share, abs=1)


@pytest.mark.parametrize("cause, stream", [("joint_angles", Stream.ANGLES), ("cylinder_strokes", Stream.STROKES)])
def test_missing_messages_are_not_there(healthy, cause, stream):
    session = spoil(healthy, [parse(f"{cause}.dropout:missing:0.5@{ONSET:g}")], 1)
    rows = {Stream.STROKES: session.strokes, Stream.ANGLES: session.joints, Stream.IMU: session.imu}
    kept = [s for s in samples_in_rows(session.stamps, rows, session.angle_stamps) if s.stream is stream]
    assert all(np.isfinite(sample.values).all() for sample in kept)
    assert len(kept) == pytest.approx(800 + 0.5 * 1200, abs=80)


def test_seed_repeats(healthy):
    faults = [parse("joint_1.sensor:spikes:0.1"), parse("joint_2.sensor:dropout:0.5"), parse("cylinder_2.k:softer:0.3")]
    one, same, other = (spoil(healthy, faults, seed).joints for seed in (3, 3, 4))
    assert np.array_equal(one, same, equal_nan=True) and not np.array_equal(one, other, equal_nan=True)
    alone = spoil(healthy, faults[:1], 3).joints
    assert np.array_equal(one[:, 0], alone[:, 0])
