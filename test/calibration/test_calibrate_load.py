"""Calibration of a boom that a load shakes which nobody told: its parameters, and how strong the load is."""

from __future__ import annotations

import numpy as np
import pytest
from calibration.sessions import off

from boom_twin import load_scene
from boom_twin.bag.session_files import write_session
from boom_twin.calibration import Choice, calibrate
from boom_twin.calibration.forward_model import ForwardModel
from boom_twin.calibration.load_response import ModesAlong, modes_along, response
from boom_twin.calibration.sessions import SessionCourse
from boom_twin.scene.edit import parameter
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.types import Stream
from boom_twin.validation import rig

RATE, FINE = 200, 1000  # Hz, of the sensors and of the integration
SLOW = 2.0 * np.pi * 15.0  # rad/s; faster modes follow a force at once
PULSES, HEIGHT = 0.43, 130.0  # Hz, N


def shaken(made, seed):
    """What the rig's sensors see, and what vertical pulses at the tip add to it: stamps, strokes, angles, IMU, force."""
    seen = rig.observe(made.truth, made.programme, made.rows, rig.Sensors(), seed)
    count = (len(seen.stamps) - 1) * FINE // RATE + 1
    course = SessionCourse(0, 1.0 / RATE, seen.strokes, seen.stamps, 1.0)
    every = modes_along(made.truth, course, np.arange(count) / FINE)
    slow = every.omega[0] < SLOW
    modes, fast = (ModesAlong(*(each[:, which] for each in every)) for which in (slow, ~slow))
    flank = 0.05 * FINE
    force = HEIGHT * np.convolve((np.arange(count) / FINE * PULSES) % 1.0 < 0.5, np.ones(int(flank)) / flank)[:count]
    position, rate = np.zeros((2, modes.omega.shape[1]))
    rows = []
    for k in range(count):
        acceleration = modes.tip[k, :, 1] * force[k] - modes.decay[k] * rate - modes.omega[k] ** 2 * position
        rate = rate + acceleration / FINE
        position = position + rate / FINE
        if k % (FINE // RATE) == 0:
            row = modes.readings[k].T @ position + fast.readings[k].T @ (fast.tip[k, :, 1] * force[k] / fast.omega[k] ** 2)
            row[-2:] += modes.felt[k].T @ acceleration
            rows.append(row)
    added = np.array(rows)
    return seen.stamps, seen.strokes, seen.joints + added[:, :-2], seen.imu + added[:, -2:], force


def test_a_boom_shaken_by_pulses(short, two_sections, tmp_path):
    *session, force = shaken(short, 2)
    write_session(tmp_path / "bag", *session, {"origin": "synthetic, a test"})
    found = calibrate([tmp_path / "bag"], two_sections, Choice(zeros="angles"))
    assert found.misfit < 1.5
    assert found.load > 0.5 * np.sqrt(np.mean(force**2))
    assert any(f"load of about {found.load:.0f} N rms" in remark for remark in found.remarks)
    for i in (1, 2):
        estimate = next(each for each in found.estimates if each.unknown.name == f"cylinder_{i}.k")
        wrong = abs(estimate.value / parameter(short.truth, f"cylinder_{i}.k") - 1.0)
        assert wrong < 0.03
        assert wrong * parameter(short.truth, f"cylinder_{i}.k") < estimate.high - estimate.low
    assert np.all(found.after.spread[:2] < 1.5) and np.all(found.before.spread[:2] > found.after.spread[:2])


def test_a_force_for_ever_bends_the_boom_at_rest():
    """Joint angles under a force of 1 N are those of the load of as much weight."""
    scene = load_scene()
    strokes = strokes_of_posture(scene, "arch")
    course = SessionCourse(0, 0.01, np.tile(strokes, (101, 1)), np.zeros(1, np.int64), 1.0)
    modes = modes_along(scene, course, 0.01 * np.arange(100))
    shown = response(modes, 0.05, 5)[1:40:2].sum(axis=0)
    weighed = ForwardModel(scene, [{"tip.payload": 1e-3}, {"tip.payload": 1.001}]).rest(strokes)[Stream.ANGLES][:, 0]
    np.testing.assert_allclose(shown[-1, :4], -(weighed[1] - weighed[0]) / 9.81, rtol=0.02)
    np.testing.assert_allclose(shown, np.tile(shown[:1], (20, 1)), rtol=1e-6, atol=1e-12)


@pytest.mark.slow
def test_pump_and_wind_of_the_virtual_rig(tmp_path):
    """One session of 60 s of the independent model."""
    loads = pytest.importorskip("boom_twin.validation.rig.loads")
    truth = off(load_scene(), 1.1, 0.9, 1.08, 0.92, **{"tip.payload": 15.0})
    pushed = [loads.parse("pump:0.43:130"), loads.parse("wind:15")]
    programme = rig.random_programme(truth, "arch", 60.0, 11)
    session = rig.record(truth, programme, 60.0, seed=11, load=loads.tip_load(truth, pushed, 60.0, 11))
    write_session(tmp_path / "bag", session.stamps, session.strokes, session.joints, session.imu, {})
    found = calibrate([tmp_path / "bag"], load_scene(), Choice(load="payload", zeros="angles"))
    values = {each.unknown.name: each.value for each in found.estimates}
    for i, bound in enumerate((0.02, 0.02, 0.02, 0.05), start=1):
        assert values[f"cylinder_{i}.k"] == pytest.approx(parameter(truth, f"cylinder_{i}.k"), rel=bound)
    assert values["tip.payload"] == pytest.approx(15.0, abs=2.0)
    assert not any("do not use" in remark for remark in found.remarks)
