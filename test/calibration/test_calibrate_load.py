"""Calibration of a boom that a load shakes which nobody told: its parameters, and how strong the load is."""

from __future__ import annotations

import numpy as np
import pytest
from calibration.sessions import ENCODERS, off

from boom_twin import load_scene
from boom_twin.bag.session_files import write_session
from boom_twin.calibration import Choice, calibrate
from boom_twin.calibration.forward_model import ForwardModel
from boom_twin.calibration.load_filter import StrokeError, filter_model
from boom_twin.calibration.load_modes import modes_along
from boom_twin.calibration.sessions import SessionCourse
from boom_twin.scene.edit import parameter, with_parameters
from boom_twin.scene.kinematics import gravity_in_base, strokes_of_posture
from boom_twin.types import Stream
from boom_twin.validation import rig
from boom_twin.validation.rig import loads

SHAKEN = ("pump:0.43:130", "wind:15")


def shaken(path, truth, posture, duration, seed, zeros=0.0):
    """A session of the virtual rig under pump and wind."""
    programme = rig.random_programme(truth, posture, duration, seed)
    load = loads.tip_load(truth, [loads.parse(text) for text in SHAKEN], duration, seed)
    session = rig.record(truth, programme, duration, seed=seed, load=load)
    write_session(path, session.stamps, session.strokes, session.joints + zeros, session.imu, {"origin": "synthetic, a test"})
    return path


def values_of(found):
    return {each.unknown.name: each.value for each in found.estimates}


SHORT = pytest.mark.xfail(reason="cylinder 3 comes out 2.3 % too soft, 2 % are wanted: see docs/calibrate.md")


@pytest.mark.slow
def test_two_sections_under_pump_and_wind(two_sections, tmp_path):
    truth = off(two_sections, 0.92, 1.1)
    found = calibrate([shaken(tmp_path / "bag", truth, "arch", 30.0, 4)], two_sections, Choice(zeros="angles"))
    assert found.misfit < 1.2
    assert any("load at the tip that the scene does not know was taken into account: " in remark for remark in found.remarks)
    assert not any("do not use" in remark or "times what noise explains" in remark for remark in found.remarks)
    for estimate in found.estimates:
        if estimate.unknown.name.endswith(".k"):
            right = parameter(truth, estimate.unknown.name)
            assert estimate.value == pytest.approx(right, rel=0.02)
            assert abs(estimate.value - right) < estimate.high - estimate.low


def test_a_force_that_stays_bends_the_boom_as_weight_does():
    """Joint angles under a vertical force of 1 N, of the boom and of one with another cylinder and payload."""
    scene = load_scene()
    strokes = strokes_of_posture(scene, "arch")
    course = SessionCourse(0, 0.01, np.tile(strokes, (101, 1)), np.arange(101) * 10_000_000, 1.0)
    booms = [with_parameters(scene, {"tip.payload": 1.0}), with_parameters(scene, {"tip.payload": 1.0, "cylinder_4.k": 5.9e6})]
    modes, _ = modes_along(booms, course)
    for number, boom in enumerate(booms):
        model = filter_model(modes, number, gravity_in_base(boom), np.arange(6), StrokeError(0.0, 20.0), 1.0, 0.01)
        free = slice(4 + 2 * 4, None)
        turn = model.turn[0]
        still = np.linalg.solve(np.eye(len(turn[free])) - turn[free, free], turn[free, 3])  # under 1 N along y
        weighed = ForwardModel(boom, [{"tip.payload": 0.5}, {"tip.payload": 1.5}]).rest(strokes)[Stream.ANGLES][:, 0]
        turned = model.read[0, :4, free] @ still + model.read[0, :4, 3]
        np.testing.assert_allclose(turned, (weighed[0] - weighed[1]) / 9.81, rtol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("posture", "seed"), [pytest.param("arch", 40, marks=SHORT), ("high", 41)])
def test_pump_and_wind_shake_the_default_boom(posture, seed, tmp_path):
    """One session of 60 s of the independent model."""
    truth = off(load_scene(), 1.1, 0.9, 1.08, 0.92, **{"tip.payload": 15.0})
    bag = shaken(tmp_path / "bag", truth, posture, 60.0, seed, ENCODERS)
    found = calibrate([bag], load_scene(), Choice(load="payload", zeros="angles"))
    values = values_of(found)
    for i, bound in enumerate((0.02, 0.02, 0.02, 0.05), start=1):
        assert values[f"cylinder_{i}.k"] == pytest.approx(parameter(truth, f"cylinder_{i}.k"), rel=bound)
    assert values["tip.payload"] == pytest.approx(15.0, abs=2.0)
    assert not any("do not use" in remark for remark in found.remarks)
