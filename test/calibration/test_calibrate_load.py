"""Calibration of a boom that a load shakes which nobody told: its parameters, and how strong the load is."""

from __future__ import annotations

import numpy as np
import pytest
from calibration.sessions import ENCODERS, off
from drive_twin import drive_readings, note_drives
from scipy.linalg import solve_discrete_lyapunov

from boom_twin import load_scene
from boom_twin.analysis.equilibrium import settle
from boom_twin.analysis.modal import natural_modes
from boom_twin.bag.session_files import write_session
from boom_twin.calibration import Choice, calibrate, load_modes
from boom_twin.calibration.forward_model import ForwardModel
from boom_twin.calibration.load_filter import (
    ORDER,
    STROKES,
    LoadPrior,
    StrokeError,
    filter_model,
    gained_variance,
    innovations,
    tilted,
)
from boom_twin.calibration.load_modes import modes_along, posture_path
from boom_twin.calibration.sessions import SessionCourse, smoothed
from boom_twin.compiler.compile import compile_scene
from boom_twin.deviation.sensor_model import specific_force
from boom_twin.scene.edit import parameter, with_parameters
from boom_twin.scene.kinematics import joint_angles_of_strokes, strokes_of_posture
from boom_twin.scene.pump_pulses import ease
from boom_twin.types import Stream
from boom_twin.validation import rig
from boom_twin.validation.rig import loads

SHAKEN = ("pump:0.43:130", "wind:15")


def shaken(path, truth, posture, duration, seed, zeros=0.0):
    """A session of the virtual rig under pump and wind."""
    programme = rig.random_programme(truth, posture, duration, seed)
    load = loads.tip_load(truth, [loads.parse(text) for text in SHAKEN], duration, seed)
    session = rig.record(truth, programme, duration, seed=seed, load=load)
    strokes, joints = drive_readings(session), session.joints + zeros
    write_session(path, session.stamps, strokes, joints, session.imu, {"origin": "synthetic, a test"})
    note_drives(path)
    return path


def values_of(found):
    return {each.unknown.name: each.value for each in found.estimates}


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


def resting_then_moving(scene):
    """Ten seconds: a hold in posture arch, a move of cylinder 1 by 71 mm, a hold."""
    times = np.arange(0.0, 10.0, 0.01)
    strokes = np.tile(strokes_of_posture(scene, "arch"), (len(times), 1))
    strokes[:, 0] += 0.071 * ease((times - 3.0) / 3.0)
    is_moving = ((times > 3.0) & (times < 6.0))[:, None] & (np.arange(4) == 0)
    return SessionCourse(0, 0.01, strokes, np.arange(len(times)) * 10_000_000, 1.0, is_moving.astype(float))


def test_a_force_that_stays_bends_the_boom_as_weight_does():
    """Joint angles under a vertical force of 1 N, of the boom and of one with another cylinder and payload."""
    scene = load_scene()
    strokes = strokes_of_posture(scene, "arch")
    course = resting_then_moving(scene)
    booms = [with_parameters(scene, {"tip.payload": 1.0}), with_parameters(scene, {"tip.payload": 1.0, "cylinder_4.k": 5.9e6})]
    for boom in booms:
        model = filter_model(
            modes_along(boom, posture_path(boom, course)), np.arange(6), 20.0, LoadPrior(np.ones(2), 1.0), 0.01
        )
        free = slice(STROKES + 2 * ORDER * 4, None)
        turn = model.turn[0]
        still = np.linalg.solve(np.eye(len(turn[free])) - turn[free, free], turn[free, 3])  # under 1 N along y
        weighed = ForwardModel(boom, [{"tip.payload": 0.5}, {"tip.payload": 1.5}]).rest(strokes)[Stream.ANGLES][:, 0]
        turned = model.read[0, :4, free] @ still + model.read[0, :4, 3]
        np.testing.assert_allclose(turned, (weighed[0] - weighed[1]) / 9.81, rtol=0.02)


def test_frequencies_are_those_of_the_very_postures_that_are_held():
    """A load that shakes the boom near resonance tells a thousandth of a frequency from none."""
    scene = load_scene()
    course = resting_then_moving(scene)
    path = posture_path(scene, course)
    modes = modes_along(scene, path)
    for row in (100, 900):
        plan = compile_scene(scene)
        state, work = plan.state(), plan.work()
        settle(plan, state, work, course.strokes[row], joint_angles_of_strokes(scene, course.strokes[row]))
        right = [mode.frequency for mode in natural_modes(plan, state, work, 4, 1e-6)]
        assert path.places[row] == pytest.approx(round(path.places[row]), abs=1e-3)
        found = np.sqrt(np.linalg.eigvalsh(modes.stiffness[round(path.places[row])])) / (2.0 * np.pi)
        np.testing.assert_allclose(found, right, rtol=1e-5)


def response(scene, course, loads):
    """Of joint angles and IMU to loads (m, 2) at the instants of a course, by the matrices of knots as near as one likes."""
    path = posture_path(scene, course)
    model = filter_model(modes_along(scene, path), np.arange(6), 20.0, LoadPrior(np.ones(2), 1.0), course.step)
    paces, x, found = np.gradient(path.places, course.step), np.zeros(len(model.start)), []
    for place, pace, load in zip(path.places, paces, loads, strict=True):
        left = min(int(place), len(path.strokes) - 2)
        turn, read = ((1.0 - place + left) * m[left] + (place - left) * m[left + 1] for m in (model.turn, model.read))
        x[:STROKES] = 0.0
        x[2:STROKES] = load
        x = turn @ x
        found.append((read + pace * model.passing[left]) @ x)
    return np.array(found)


def test_a_load_shakes_a_boom_that_moves_without_steps(monkeypatch):
    """Knots a quarter as far apart leave the same motion: nothing is left for the filter but what a load as free may make."""
    scene = load_scene()
    course = resting_then_moving(scene)
    loads = 100.0 * np.column_stack([np.zeros(1000), np.arange(1000) // 120 % 2])
    path = posture_path(scene, course)
    modes = modes_along(scene, path)
    monkeypatch.setattr(load_modes, "TRAVEL", load_modes.TRAVEL / 4.0)
    readings = response(scene, course, loads)
    jumps = 1e6 * (np.abs(np.diff(loads, axis=0, prepend=loads[:1])) > 0.0)
    prior = LoadPrior(np.full(2, 0.1), 100.0, jumps)
    model = filter_model(modes, np.arange(6), 20.0, prior, course.step)
    gained = gained_variance(model, prior, StrokeError(0.0, 20.0), course.moving, course.step)
    noise = np.tile(np.array([1e-5] * 4 + [0.005] * 2) ** 2, (1000, 1))
    paces = np.gradient(path.places, course.step)
    found = innovations(model, path.places, paces, noise, gained, np.zeros((1000, 6)), readings[:, None])
    assert np.sqrt(np.mean(found.values[:, 0] ** 2 / found.variances)) < 0.3
    np.testing.assert_allclose(found.loads[100::120], loads[100::120], atol=2.0)


def test_noise_that_a_smoother_leaves_in_moving_strokes_is_that_of_the_filter():
    """Covariance of the smoothed noise over time, against the stationary one of the filter's states; none where they hold."""
    rng, step, corner, variance = np.random.default_rng(2), 0.005, 3.85, 4e-10
    noise = smoothed(np.sqrt(variance) * rng.standard_normal((400_000, 1)), step, corner)[:, 0]
    scene = load_scene()
    modes = modes_along(scene, posture_path(scene, resting_then_moving(scene)))
    strokes, length = StrokeError(variance * step, 2.0 * np.pi * corner), 0.01
    prior = LoadPrior(np.ones(2), 1.0)
    model = filter_model(modes, np.arange(6), strokes.corner, prior, length)
    gained = gained_variance(model, prior, strokes, np.array([[1.0] * 4, [0.0] * 4]), length)
    assert not gained[1].any()
    part = slice(STROKES, STROKES + 2 * ORDER * 4)
    turn = model.turn[0][part, part]
    covariance = solve_discrete_lyapunov(turn, turn @ np.diag(gained[0, part]) @ turn.T)
    for lag in (0, 5, 10, 20):  # blocks
        model_covariance = (np.linalg.matrix_power(turn, lag) @ covariance)[0, 0]
        measured = np.mean(noise[2 * lag :] * noise[: len(noise) - 2 * lag])
        assert model_covariance == pytest.approx(measured, abs=0.03 * np.mean(noise**2))


def test_an_imu_on_a_turned_tip_reads_along_other_axes_whatever_acts_there():
    force, turn = np.array([[0.3, 9.1]]), 1e-4
    measured = np.column_stack([np.zeros((1, 4)), force])
    x, z = specific_force(force[:, 0], force[:, 1], np.cos(turn), np.sin(turn))
    np.testing.assert_allclose(tilted(measured, 4)[:, 4:] * turn, np.column_stack([x, z]) - force, atol=1e-7)
    assert not tilted(measured, 4)[:, :4].any()
    assert tilted(measured[:, :4], 4).shape == (1, 4)
    assert not tilted(np.full((1, 6), np.nan), 4).any()


@pytest.mark.slow
@pytest.mark.parametrize(("posture", "seed"), [("arch", 40), ("high", 41)])
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
