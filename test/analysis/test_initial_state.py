"""Simulations that start in a given state: let go from the undeflected posture, with joint rates, or where another ended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from command import main
from default_boom import motion_of, posture_angles, strokes_of_posture
from published import scenes

from boom_twin import UsageError, load_scene, simulate, undeflected
from boom_twin.analysis.initial_state import read_state, write_state

SCENE = load_scene()
QUIET = {"estimate_errors": False}
HEADER = "t_s,stroke_1_m,stroke_2_m,stroke_3_m,stroke_4_m"


def pendulum():
    """A uniform rod of 1 kg and 1 m on a pivot that turns freely, held horizontal."""
    rod = scenes.rigid(1.0, 1.0, 0.5, 1.0 / 12.0)
    return scenes.scene([rod], [scenes.crank(scenes.FREE)])


def held(scene, posture, span=0.4, rows=201):
    strokes = strokes_of_posture(scene, posture)
    return np.linspace(0.0, span, rows), np.tile(strokes, (rows, 1)), posture_angles(scene, posture)


def test_a_pendulum_let_go_with_a_rate():
    """theta'' = -3 g cos(theta)/(2 L); what it has of energy, and thus its rate at the bottom."""
    scene, rate = pendulum(), 1.3
    first = np.hypot(0.0, 9.9) - 1.0
    times = np.linspace(0.0, 0.5, 501)
    start = undeflected(scene, np.array([first]), np.array([rate]))
    found = simulate(scene, times, np.full((501, 1), first), 1e-3, start=start, **QUIET)
    assert found.tip_acceleration[0] == pytest.approx([-(rate**2), -1.5 * 9.81, -1.5 * 9.81], abs=2e-3)
    angle, turning = found.tip[:, 2], found.tip_velocity[:, 2]
    assert turning**2 / 6.0 + 9.81 * 0.5 * np.sin(angle) == pytest.approx(rate**2 / 6.0, abs=1e-4)


def test_a_boom_let_go_falls_freely_first_and_swings_about_its_rest():
    """The papers' first move down under gravity: no force holds the undeflected boom, so all of it falls with g."""
    times, strokes, angles = held(SCENE, "horizontal", 6.0, 1201)
    found = simulate(SCENE, times, strokes, 1e-3, angles, start=undeflected(SCENE, strokes[0]), **QUIET)
    rest = simulate(SCENE, times[:1], strokes[:1], 1e-3, angles, **QUIET)
    assert found.tip_acceleration[0, :2] == pytest.approx([0.0, -9.81], abs=1e-2)
    assert np.abs(found.cylinder_forces[0]).max() < 5.0
    assert found.tip[0, :2] == pytest.approx([13.46, 0.0], abs=1e-12)
    sag = rest.tip[0, 1]
    assert found.tip[:, 1].min() < 1.7 * sag
    assert np.mean(found.tip[:, 1]) == pytest.approx(sag, rel=0.1)


@pytest.mark.parametrize("cut", [80, 200, 290])
def test_a_run_goes_on_where_another_ended(cut, tmp_path):
    move = motion_of(SCENE)
    times = np.linspace(0.0, 2.0, 401)
    strokes, _ = move(times)
    whole = simulate(SCENE, times, strokes, 1e-3, move.angles, **QUIET)
    head = simulate(SCENE, times[: cut + 1], strokes[: cut + 1], 1e-3, move.angles, **QUIET)
    write_state(tmp_path / "end.json", head.end)
    tail = simulate(SCENE, times[cut:], strokes[cut:], 1e-3, start=read_state(tmp_path / "end.json"), **QUIET)
    assert np.abs(tail.tip - whole.tip[cut:]).max() < 1e-6
    assert np.abs(tail.tip_acceleration - whole.tip_acceleration[cut:]).max() < 2e-3
    assert np.abs(tail.cylinder_forces - whole.cylinder_forces[cut:]).max() < 2.0


def test_coordinates_that_leave_a_loop_open_are_refused():
    times, strokes, angles = held(SCENE, "arch", 0.1, 3)
    start = undeflected(SCENE, strokes[0], None, angles)
    place = start.names.index("alpha_L_3")
    off = replace(start, values=start.values + 1e-3 * (np.arange(len(start.names)) == place))
    with pytest.raises(UsageError, match=r"joint_3\.Q, . *: .* m apart at the start"):
        simulate(SCENE, times, strokes, 1e-3, angles, start=off, **QUIET)


def test_a_stiff_cylinder_must_go_as_fast_as_its_drive():
    cylinder = SCENE.joints[2].cylinder.model_copy(update={"k": None, "d": None})
    joints = tuple(joint if i != 2 else joint.model_copy(update={"cylinder": cylinder}) for i, joint in enumerate(SCENE.joints))
    scene = SCENE.model_copy(update={"joints": joints})
    times, strokes, angles = held(scene, "arch", 0.1, 3)
    with pytest.raises(UsageError, match=r"cylinder_3 and its drive: .* parting at"):
        simulate(scene, times, strokes, 1e-3, angles, start=undeflected(scene, strokes[0], np.array([0, 0, 0.1, 0])), **QUIET)
    simulate(scene, times, strokes, 1e-3, angles, start=undeflected(scene, strokes[0], np.array([0.1, 0, 0, 0])), **QUIET)


def test_the_state_of_another_boom_is_refused(tmp_path):
    times, strokes, angles = held(SCENE, "arch", 0.1, 3)
    with pytest.raises(UsageError, match="of another boom"):
        simulate(SCENE, times, strokes, 1e-3, angles, start=undeflected(pendulum(), np.array([8.9])), **QUIET)
    for text, told in (
        ('{"coordinates": 3}', "save-state"),
        ("[" * 100_000, "save-state"),
        ('{"coordinates": {"theta_1": [true, false]}, "pins": []}', r"theta_1 = \[True, False\]: must be 2 numbers"),
        ('{"coordinates": {"theta_1": ["a", 0]}, "pins": []}', "theta_1 = .* must be 2 numbers"),
        ('{"coordinates": {"theta_1": [1, 0], "theta_1": [2, 0]}, "pins": []}', "theta_1 is given twice"),
        ('{"coordinates": {}}', "no 'pins'"),
    ):
        (tmp_path / "odd.json").write_text(text)
        with pytest.raises(UsageError, match=told):
            read_state(tmp_path / "odd.json")


def test_the_command_starts_undeflected_saves_and_goes_on(tmp_path, capsys):
    times, strokes, _ = held(SCENE, "horizontal", 0.2, 21)
    table = np.column_stack([times, strokes])
    drive, end = tmp_path / "drive.csv", tmp_path / "end.json"
    np.savetxt(drive, table, delimiter=",", comments="", header=HEADER)
    common = ["simulate", "--posture", "horizontal", "--drive", str(drive), "--no-error-estimate"]
    begun = [*common, "--out", str(tmp_path / "a.csv"), "--start", "undeflected", "--joint-rates", "0,0,0,0.1"]
    assert main([*begun, "--save-state", str(tmp_path / "." / "a.csv")]) == 1
    assert "--out writes this file too" in capsys.readouterr().err and not (tmp_path / "a.csv").exists()
    assert main([*begun, "--save-state", str(end), "--check"]) == 0
    assert "The balance is open by" in capsys.readouterr().out
    far = table[:, 1:] + np.array([0.02, 0.0, 0.0, 0.0])  # of no posture's strokes, as where a move was interrupted
    np.savetxt(tmp_path / "far.csv", np.column_stack([times, far]), delimiter=",", comments="", header=HEADER)
    bare = ["simulate", "--drive", str(tmp_path / "far.csv"), "--no-error-estimate", "--out", str(tmp_path / "d.csv")]
    assert main([*bare, "--start", str(end)]) == 1
    assert "Begin the drive where the state was taken" in capsys.readouterr().err
    assert main(bare) == 0  # at rest in its first row
    assert main([*common, "--out", str(tmp_path / "b.csv"), "--start", str(end)]) == 0
    first, second = (np.genfromtxt(tmp_path / name, delimiter=",", names=True) for name in ("a.csv", "b.csv"))
    assert second["tip_y_m"][0] == pytest.approx(first["tip_y_m"][-1], abs=1e-9)
