"""The twin's equilibrium and motion against the Exudyn rig on booms that neither was made for."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("exudyn")

from boom_twin import simulate, statics
from boom_twin.scene.kinematics import stroke_range
from boom_twin.validation import rig
from boom_twin.validation.rig.motion import RANGE_SAMPLES

STROKE = 0.04  # m, of every other cylinder within one second


def rms(vectors):
    return np.sqrt(np.mean(np.sum(np.square(vectors), axis=-1)))


def seeds(first, usual, last):
    """Random booms of 1 to 5 sections in turn: those below `usual` each time, the others in the long run."""
    return [pytest.param(seed, marks=[] if seed < usual else pytest.mark.slow) for seed in range(first, last)]


@pytest.mark.parametrize("seed", seeds(0, 10, 25))
def test_equilibrium(random_boom):
    scene, strokes = random_boom
    expected, found = rig.statics(scene, strokes, elements=32), statics(scene, strokes)
    sag = np.subtract(expected["tip_m"], expected["tip_rigid_m"])
    assert np.linalg.norm(found.tip - found.tip_rigid - sag) < 1e-3 * np.linalg.norm(sag)
    assert found.joints == pytest.approx(expected["joint_rad"], abs=1e-5)
    assert found.cylinder_forces == pytest.approx(expected["cylinder_force_N"], rel=1e-4)


@pytest.mark.parametrize("seed", seeds(1, 8, 15))
def test_motion(random_boom):
    scene, first = random_boom
    moves = []
    for cylinder in range(0, len(first), 2):
        room = stroke_range(scene, cylinder, RANGE_SAMPLES)[1] - first[cylinder]
        change = STROKE if room > 2 * STROKE else -STROKE
        moves.append(rig.Move(cylinder, 0.0, 1.0, first[cylinder] + change))
    drive = rig.Programme(tuple(first), tuple(moves))
    rows = rig.simulate(scene, drive, 2.0, step=1e-3)
    found = simulate(scene, rows["t_s"], drive(rows["t_s"])[0], dt=1e-3)
    number = range(1, len(first) + 1)
    tip = np.column_stack([rows["tip_x_m"], rows["tip_y_m"]])
    acceleration = np.column_stack([rows["tip_ax_m_s2"], rows["tip_ay_m_s2"]])
    joints = np.column_stack([rows[f"joint_{i}_rad"] for i in number])
    forces = np.column_stack([rows[f"cylinder_force_{i}_N"] for i in number])
    assert rms(found.tip[:, :2] - tip) < 5e-4
    assert rms(found.tip_acceleration[:, :2] - acceleration) < 0.01 * rms(acceleration)
    assert np.abs(found.joints - joints).max() < 1e-4
    assert rms(found.cylinder_forces - forces) < 5e-3 * rms(forces)
