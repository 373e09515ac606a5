"""The twin's equilibrium and motion against the Exudyn rig on random booms that neither was made for."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("exudyn")

from analysis.reference_errors import rms
from default_boom import strokes_of_angles
from oracle import booms

from boom_twin import Scene, simulate, statics
from boom_twin.scene.kinematics import stroke_range
from boom_twin.validation import rig
from boom_twin.validation.rig.motion import RANGE_SAMPLES

STROKE = 0.04  # m, of every other cylinder within one second


@pytest.fixture
def random_boom(seed: int) -> tuple[Scene, np.ndarray]:
    """The scene of a test's parameter `seed`, every third on an elastic base; strokes (m), shape (n,), inside its ranges."""
    scene = booms.milder_boom(seed)
    if seed % 3 == 2:
        rng = np.random.default_rng([seed, 2])
        scene = booms.on_elastic_base(scene, 10.0 ** rng.uniform(6.5, 8.0), 10.0 ** rng.uniform(4.0, 5.0))
    return scene, random_strokes(scene, seed)


def random_strokes(scene: Scene, seed: int) -> np.ndarray:
    """Strokes (m), shape (n,), of joint angles well inside their ranges."""
    rng = np.random.default_rng(seed + 10_000)
    low, high = np.radians([joint.range_deg for joint in scene.joints]).T
    inside = [rng.uniform(a + 0.1 * (b - a), b - 0.1 * (b - a)) for a, b in zip(low, high, strict=True)]
    return strokes_of_angles(scene, np.array(inside))


def seeds(first, usual, last):
    """Random booms of 1 to 5 sections in turn: those below `usual` each time, the others in the long run."""
    return [pytest.param(seed, marks=[] if seed < usual else pytest.mark.slow) for seed in range(first, last)]


@pytest.mark.parametrize("seed", seeds(0, 10, 25))
def test_equilibrium(random_boom):
    scene, strokes = random_boom
    expected, found = rig.statics(scene, strokes, elements=32), statics(scene, strokes)
    assert np.linalg.norm(found.tip - expected["tip"]) < 1e-3 * np.linalg.norm(expected["tip"] - found.tip_rigid)
    assert found.joints == pytest.approx(expected["joints"], abs=1e-5)
    assert found.cylinder_forces == pytest.approx(expected["forces"], rel=1e-4)


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
    found = simulate(scene, rows["t"], drive(rows["t"])[0], dt=1e-3)
    acceleration, forces = rows["tip_acc"], rows["forces"]
    assert rms(found.tip[:, :2] - rows["tip"]) < 5e-4
    assert rms(found.tip_acceleration[:, :2] - acceleration) < 0.01 * rms(acceleration)
    assert np.abs(found.joints - rows["joints"]).max() < 1e-4
    assert rms(found.cylinder_forces - forces) < 5e-3 * rms(forces)
