"""A force at the tip in `simulate`: against statics, compliance and balances; what the command says. See test_steady_state."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import main
from convergence.balances import energy_balance, momentum_balance
from default_boom import parameter, strokes_of_posture, with_parameters
from oracle import booms
from studies.clearance.scenes import treated, with_play

from boom_twin import UsageError, frequency_response, load_scene, simulate, statics
from boom_twin.analysis.doubts import joint_doubts
from boom_twin.analysis.simulate import course_of
from boom_twin.scene.kinematics import gravity_in_base
from boom_twin.scene.pump_pulses import ease

SCENE = load_scene()
STROKES = strokes_of_posture(SCENE, "arch")
TIMES = np.linspace(0.0, 2.0, 101)
PUSH = np.array([30.0, -140.0])


def held(times):
    return np.tile(STROKES, (len(times), 1))


@pytest.mark.parametrize("make", [load_scene, lambda: booms.random_boom(31)], ids=["default", "inclined"])
def test_a_force_from_the_start_is_a_payload(make):
    """20 kg more at the tip of a boom at rest; the second boom stands on an inclined base."""
    scene = make()
    posture = next(iter(scene.postures))
    heavier = with_parameters(scene, {"tip.payload": parameter(scene, "tip.payload") + 20.0})
    strokes = np.tile(strokes_of_posture(scene, posture), (3, 1))
    rows = np.array([[7.0, *(20.0 * gravity_in_base(scene))]])
    found, expected = simulate(scene, np.arange(3.0), strokes, 0.1, force=rows), statics(heavier, posture)
    assert found.tip[:, :2] == pytest.approx(np.tile(expected.tip, (3, 1)), abs=1e-8) and found.doubts == ()
    assert found.cylinder_forces[-1] == pytest.approx(expected.cylinder_forces, rel=1e-8)


def test_a_small_force_deflects_as_the_compliance_says():
    response = frequency_response(SCENE, np.zeros(1), posture="arch", tip_force=tuple(PUSH)).tip[0].real
    there, back = (simulate(SCENE, TIMES[:1], held(TIMES[:1]), force=side * PUSH[None] / 10.0).tip[0, :2] for side in (1, -1))
    assert there - back == pytest.approx(0.2 * response, rel=2e-3)  # the response bends beams in two more shapes


@pytest.mark.parametrize("worn", [False, True])
def test_balances_are_closed_with_it(worn):
    """A force that comes and goes while the boom moves, at rows of its own: its work, and its moment about the base."""
    scene = treated(with_play(SCENE), "contact") if worn else SCENE
    times = TIMES[:31] if worn else TIMES
    force = np.column_stack([TIMES, np.outer(np.sin(4.0 * TIMES), 3.0 * PUSH)])[::5]
    drives = STROKES + 0.02 * ease(np.minimum(times, 1.0))[:, None]
    own = course_of(scene, times, drives, force=force)
    energy, momentum = energy_balance(own, 1e-3), momentum_balance(own, 1e-3)
    without = energy_balance(course_of(scene, times, drives), 1e-3)
    assert abs(energy.work - without.work) > 5.0 and energy.share < (2e-3 if worn else 2e-5)
    assert momentum.linear_share < 2e-5 and momentum.angular_share < 2e-5


def test_it_goes_between_rows_as_strokes_do_and_stays_behind_them():
    """At the drive's rows or at its own it is one motion; with lengths in place of drives the forces meet it too."""
    rows = ease(np.minimum(TIMES, 1.0))[:, None] * PUSH
    options = {"estimate_errors": False, "dt": 0.01}
    one = simulate(SCENE, TIMES, held(TIMES), force=rows, **options)
    other = simulate(SCENE, TIMES, held(TIMES), force=np.column_stack([TIMES, rows])[TIMES <= 1.0], **options)
    assert np.array_equal(one.tip, other.tip) and not np.array_equal(one.tip[0], one.tip[-1])
    by_lengths = simulate(SCENE, TIMES, lengths=one.lengths, force=rows, **options)
    assert by_lengths.tip[:, :2] == pytest.approx(one.tip[:, :2], abs=2e-4)


@pytest.mark.parametrize(
    "force, told",
    [
        (np.zeros((5, 2)), "force = array of shape \\(5, 2\\)"),
        ([[0.0, 1.0, np.nan]], "row 1 of the force: .* tip_fy_N = nan"),
        ([[0.0, 1.0, 2e7]], "at most 1e\\+07 N"),
        ([[0.0, 1.0, 1.0], [0.0, 1.0, 1.0]], "row 2 of the force: not after row 1"),
    ],
)
def test_forces_refused(force, told):
    with pytest.raises(UsageError, match=told):
        simulate(SCENE, TIMES, held(TIMES), force=np.array(force))


def csv(path: Path, header: str, rows: np.ndarray) -> str:
    np.savetxt(path, rows, delimiter=",", header=header, comments="")
    return str(path)


def test_the_command(tmp_path, capsys):
    """`--force` with drives; a joint that leaves its range and a missing column are told."""
    strokes = "t_s,stroke_1_m,stroke_2_m,stroke_3_m,stroke_4_m"
    drive = csv(tmp_path / "drive.csv", strokes, np.column_stack([TIMES[:21], held(TIMES[:21])]))
    force = csv(tmp_path / "force.csv", "t_s,tip_fx_N,tip_fy_N", np.array([[0.0, 0.0, 0.0], [0.4, *PUSH]]))
    out = tmp_path / "out.csv"
    command = ["simulate", "--drive", drive, "--out", str(out), "--dt", "0.01"]
    assert main([*command, "--force", force]) == 0
    table = np.genfromtxt(out, delimiter=",", names=True)
    rows = np.array([[0.0, 0.0, 0.0], [0.4, *PUSH]])
    expected = simulate(SCENE, TIMES[:21], held(TIMES[:21]), 0.01, estimate_errors=False, force=rows)
    assert table["tip_y_m"] == pytest.approx(expected.tip[:, 1], abs=1e-11)
    assert main([*command, "--force", drive]) == 1 and "no column tip_fx_N, tip_fy_N" in capsys.readouterr().err


def test_joints_out_of_range_and_dead_centres_are_told():
    """Joint 2 leaves a range that ends just beyond its posture; with all angles it can have, links and cylinder stretch."""
    joint, angle = SCENE.joints[1], float(np.degrees(statics(SCENE, "arch").joints[1]))
    narrow = joint.model_copy(update={"range_deg": (angle - 5.0, angle + 1.0)})
    scene = SCENE.model_copy(update={"joints": (SCENE.joints[0], narrow, *SCENE.joints[2:])})
    drives = held(TIMES)
    drives[:, 1] += 0.05 * ease(TIMES / 2.0)
    options = {"dt": 0.02, "estimate_errors": False}
    assert simulate(scene, TIMES, held(TIMES), **options).doubts == ()
    beyond = [doubt for doubt in simulate(scene, TIMES, drives, **options).doubts if doubt.startswith("joint_2 is at")]
    assert len(beyond) == 1 and "s, outside its range_deg -46.2218 to -40.2218" in beyond[0]
    angles = np.tile(statics(SCENE, "arch").joints, (721, 1))
    angles[:, 1] = np.radians(np.linspace(-179.0, 179.0, 721))
    told = " ".join(joint_doubts(SCENE, np.arange(721.0), angles))
    assert "dead centre of its links" in told and "dead centre of its cylinder" in told
