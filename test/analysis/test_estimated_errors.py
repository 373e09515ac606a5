"""Errors that `simulate` states of its own steps and rows, each with its bound."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import posture_angles, strokes_of_posture, with_rigid_cylinders

from boom_twin import load_scene, simulate
from boom_twin.scene.schema import Clearance

SCENE = load_scene()
ARCH, ANGLES = strokes_of_posture(SCENE, "arch"), posture_angles(SCENE, "arch")
RIGID = with_rigid_cylinders(SCENE)


def worn(gap: float):
    """The default scene with so much radial clearance (m) in two rod pins."""
    pins = [{"at": f"cylinder_{i}.rod", "pin_radius": 0.03, "radial_clearance": gap} for i in (1, 2)]
    return SCENE.model_copy(update={"clearance": Clearance.model_validate({"pins": pins})})


def strokes(times, added, cylinder=0):
    """The posture's strokes with something added to one of them."""
    rows = np.tile(ARCH, (len(times), 1))
    rows[:, cylinder] += added
    return rows


def gentle(t):
    x = np.clip(t / 1.5, 0.0, 1.0)
    return 0.05 * (10 * x**3 - 15 * x**4 + 6 * x**5)


def stop(t):
    return 0.1 * np.where(t < 0.3, t**2 / 0.6, np.minimum(t, 0.5) - 0.15)


def swing(t):
    return 0.004 * np.sin(60.0 * t * t)


def shares(one, other):
    """Real errors of tip, acceleration and worst force of `one`, by those of `other` at the same instants."""

    def largest(errors, sizes):
        return float(np.linalg.norm(errors, axis=1).max() / np.linalg.norm(sizes, axis=1).max())

    forces = np.abs(one.cylinder_forces - other.cylinder_forces).max(axis=0) / np.abs(other.cylinder_forces).max(axis=0)
    return np.array(
        [
            largest((one.tip - other.tip)[:, :2], (other.tip - other.tip[0])[:, :2]),
            largest((one.tip_acceleration - other.tip_acceleration)[:, :2], other.tip_acceleration[:, :2]),
            forces.max(),
        ]
    )


@pytest.mark.parametrize("every", [0.001, 0.005, 0.01])
def test_a_gentle_motion_raises_no_doubt(every):
    times = np.arange(0.0, 2.0 + 1e-9, every)
    assert simulate(SCENE, times, strokes(times, gentle(times)), angles=ANGLES).doubts == ()


@pytest.mark.parametrize("step", [4e-3, 1e-2, 2e-2])
def test_the_error_of_a_coarse_step_is_stated(step):
    times = np.arange(0.0, 1.0 + 1e-9, 0.02)
    found = simulate(SCENE, times, strokes(times, swing(times)), step, ANGLES)
    fine = simulate(SCENE, times, strokes(times, swing(times)), step / 10, ANGLES)
    stated = np.array([error.share for error in found.step_errors])
    assert np.all((stated > shares(found, fine)) & (stated < 4.0 * shares(found, fine)))


@pytest.mark.parametrize("scene", [SCENE, RIGID], ids=["oil", "incompressible"])
def test_the_error_of_sparse_rows_is_stated(scene):
    """Rows 50 ms apart of a cylinder that stops: the tip is nearly right, acceleration and forces are not."""
    times, dense = np.arange(0.0, 0.8 + 1e-9, 0.05), np.arange(0.0, 0.8 + 1e-9, 0.001)
    found = simulate(scene, times, strokes(times, stop(times)), angles=ANGLES)
    whole = simulate(scene, dense, strokes(dense, stop(dense)), angles=ANGLES)
    rows = np.searchsorted(dense, times - 1e-6)
    here = np.linalg.norm((found.tip_acceleration - whole.tip_acceleration[rows])[:, :2], axis=1).max()
    real = here / np.linalg.norm(found.tip_acceleration[:, :2], axis=1).max()
    assert found.row_errors[1].share > 0.8 * real > 0.04
    assert any("the rows of the drive" in doubt and "tip's acceleration" in doubt for doubt in found.doubts)
    assert any("the rows of the drive" in doubt and "force of cylinder" in doubt for doubt in found.doubts)


@pytest.mark.parametrize(
    ("scene", "added"),
    [(SCENE, lambda t: 0.1 * (t >= 0.2)), (RIGID, stop), (worn(3e-3), stop), (worn(1e-2), swing)],
    ids=["jump of 10 cm", "incompressible stop", "clearance 3 mm", "clearance 10 mm"],
)
def test_acceleration_and_force_are_doubted_where_they_are_wrong(scene, added):
    times = np.arange(0.0, 0.6 + 1e-9, 0.002)
    found = simulate(scene, times, strokes(times, added(times)), angles=ANGLES)
    fine = simulate(scene, times, strokes(times, added(times)), 1e-4, ANGLES)
    said = " ".join(found.doubts)
    for error, what in zip(shares(found, fine)[1:], ("acceleration", "force"), strict=True):
        assert what in said or error < 0.05
    assert "acceleration" in said or "force" in said


def test_strokes_faster_than_a_cylinder_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    times = np.arange(0.0, 0.3, 0.01)
    rows = np.column_stack([times, strokes(times, 0.7 * np.clip(times - 0.1, 0.0, 0.1))])
    header = "t_s," + ",".join(f"stroke_{i}_m" for i in range(1, 5))
    np.savetxt(tmp_path / "in.csv", rows, delimiter=",", header=header, comments="")
    given = ["--posture", "arch", "--drive", str(tmp_path / "in.csv"), "--out", str(tmp_path / "out.csv")]
    assert main(["simulate", *given]) == 0
    said = capsys.readouterr().err
    assert "stroke_1 moves at 0.7 m/s" in said and "0.5 m/s (stroke_rate)" in said
