"""A base on an elastic hinge: closed form, Exudyn, contact in its pins, and what commands say of it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from command import main
from convergence.balances import energy_balance, momentum_balance
from default_boom import anew, motion_of, strokes_of_posture
from oracle import booms
from oracle.clearance.scenes import with_pins

from boom_twin import load_scene, simulate, statics
from boom_twin.analysis.simulate import course_of

STIFFNESS, DAMPING = 5.0e6, 5.0e4  # N m/rad, N m s/rad
RIGID = load_scene()
SCENE = booms.on_elastic_base(RIGID, STIFFNESS, DAMPING)


def turned(angle, point):
    return complex(*point) * np.exp(1j * angle)


@pytest.mark.parametrize("posture", ["horizontal", "arch"])
def test_moment_of_a_massless_cylinder_turns_the_base(posture):
    """k phi = moment of the cylinder's force about the pivot; `joint_1` is that of section 1 to the turned base."""
    spec = SCENE.model_dump(exclude_none=True)
    del spec["joints"][0]["cylinder"]["barrel"], spec["joints"][0]["cylinder"]["rod"]
    found = statics(booms.scene_of(spec), posture=posture)
    barrel = turned(found.base_turn, SCENE.base.cylinder_pin)
    rod = turned(found.base_turn + found.joints[0], SCENE.sections[0].rod_pin)
    axis = (rod - barrel) / abs(rod - barrel)
    assert abs(rod - barrel) - SCENE.joints[0].cylinder.closed_length == pytest.approx(found.lengths[0], abs=1e-9)
    assert STIFFNESS * found.base_turn == pytest.approx(found.cylinder_forces[0] * (barrel.conjugate() * axis).imag, rel=1e-9)


def test_rest_and_stop_are_those_of_exudyn():
    """Cylinder 1 starts and stops within 0.4 s; then the boom swings by 0.3 m."""
    rig = pytest.importorskip("boom_twin.validation.rig")
    strokes = strokes_of_posture(SCENE, "arch")
    resting, found = rig.at_rest(SCENE, strokes, 8, nodally_exact=True), statics(SCENE, strokes)
    drive = rig.Programme(tuple(strokes), (rig.Move(0, 0.1, 0.5, strokes[0] + 0.03),))
    rows, _ = rig.move(resting, drive, 2.0, 1e-3, 1e-3)
    moved = simulate(SCENE, rows["t"], drive(rows["t"])[0], dt=1e-3)
    tip = rows["tip"]
    assert np.abs(found.tip - tip[0]).max() < 1e-3 * np.hypot(*(found.tip - found.tip_rigid))
    assert found.joints == pytest.approx(rows["joints"][0], abs=1e-5)
    assert found.cylinder_forces == pytest.approx(resting.rows["forces"][0], rel=1e-4)
    assert np.ptp(tip[rows["t"] > 0.5, 1]) > 0.3
    assert np.linalg.norm(moved.tip[:, :2] - tip, axis=1).max() < 1e-3
    assert moved.joints[:, 0] == pytest.approx(rows["joints"][:, 0], abs=2e-5)


def test_balances_close_with_worn_pins_on_the_base():
    """Friction and contact act on base and boom alike; the hinge takes energy by its damper."""
    pins = ("cylinder_1.rod", "cylinder_1.barrel", "joint_1.pivot")
    scene = booms.on_elastic_base(with_pins(booms.document(), pins, friction=0.1), STIFFNESS, DAMPING)
    move, times = motion_of(scene), np.linspace(0.0, 0.5, 101)
    course = course_of(scene, times, move(times)[0], angles=move.angles)
    energy, momentum = energy_balance(course, 1e-3), momentum_balance(course, 1e-3)
    assert energy.contact > 1e-3 and energy.damping > 0.5 and energy.share < 1e-6
    assert momentum.linear_share < 1e-7 and momentum.angular_share < 2e-5


def test_a_session_of_the_rig_replays(tmp_path, capsys):
    """The session carries its scene; without the hinge the twin is off by its turn times the reach."""
    pytest.importorskip("exudyn")
    elastic, rigid, bag = tmp_path / "elastic.yaml", tmp_path / "rigid.yaml", str(tmp_path / "bag")
    elastic.write_text(anew(SCENE))
    rigid.write_text(anew(RIGID))
    assert main(["rig", str(elastic), "--random", "arch", "--duration", "6", "--seed", "3", "--out", bag]) == 0
    errors = []
    for own in ([], ["--scene", str(rigid)]):
        capsys.readouterr()
        assert main(["replay", bag, *own, "--json", "--out", str(tmp_path / f"out{len(errors)}")]) == 0
        found = json.loads(capsys.readouterr().out)
        errors.append((found["tip_error_rms_m"], found["tip_estimate_error_rms_m"]))
    assert max(errors[0]) < 2e-3 and min(errors[1]) > 0.03
