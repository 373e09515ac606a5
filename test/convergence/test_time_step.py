"""Order of the time integration on the default scene in smooth motion, against its own fine-step run."""

from __future__ import annotations

import numpy as np
import pytest
from convergence import motions
from default_boom import posture_angles
from reference.segments import equilibrium as segments

from boom_twin import load_scene, simulate

DURATION, SAMPLES, TRAVEL = 1.6, 40, (0.05, -0.02, 0.03, 0.02)
STEPS = (4e-3, 2e-3, 1e-3, 5e-4)
PARTS = {
    "joints": slice(0, 4),
    "forces": slice(4, 8),
    "tip": slice(8, 10),
    "velocity": slice(11, 13),
    "acceleration": slice(14, 16),
}


def moved(step, rho, scene=None):
    """Rows at SAMPLES times of the arch move with travel on all four cylinders."""
    scene, count = scene or load_scene(), round(DURATION / step)
    angles = posture_angles(scene, "arch")
    drive = motions.smooth_drive(segments.Segments(scene, 0).lengths(angles), TRAVEL, 1.2)
    return motions.follow(scene, drive, angles, step, count, count // SAMPLES, rho)


@pytest.fixture(scope="module")
def fine():
    return moved(1e-4, 0.8)


def errors(rows, fine):
    """Root mean square over all samples, for every part."""
    return np.array([np.sqrt(np.mean((rows[:, part] - fine[:, part]) ** 2)) for part in PARTS.values()])


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8, 0.9])
def test_second_order(fine, rho):
    table = np.array([errors(moved(step, rho), fine) for step in STEPS])
    slopes = np.polyfit(np.log(STEPS), np.log(table), 1)[0]
    assert np.all(np.abs(slopes - 2.0) < 0.15), dict(zip(PARTS, slopes, strict=True))


def test_error_of_the_default_step(fine):
    found = dict(zip(PARTS, errors(moved(1e-3, 0.8), fine), strict=True))
    assert found["tip"] < 1e-4 and found["joints"] < 2e-6
    assert found["acceleration"] < 2e-3 * np.sqrt(np.mean(fine[:, PARTS["acceleration"]] ** 2))


def test_steps_end_on_the_rows_whatever_their_spacing():
    """Rows at uneven times: the same as the rows of a run at even times, to the error of the steps and of PCHIP."""
    scene = load_scene()
    angles = posture_angles(scene, "arch")
    closed = np.array([joint.cylinder.closed_length for joint in scene.joints])
    drive = motions.smooth_drive(segments.Segments(scene, 0).lengths(angles), TRAVEL, 0.5)
    uneven = np.sort(np.append(np.arange(0.0, 0.6, 2e-3), np.random.default_rng(5).uniform(0.0, 0.598, 60)))
    a = simulate(scene, uneven, drive(uneven[:, None])[0] - closed, dt=1e-3, angles=angles)
    even = np.arange(0.0, 0.6, 1e-3)
    b = simulate(scene, even, drive(even[:, None])[0] - closed, dt=1e-3, angles=angles)
    common = np.isin(np.round(uneven, 9), np.round(even, 9))
    among = np.isin(np.round(even, 9), np.round(uneven, 9))
    assert common.sum() > 290
    assert a.tip[common] == pytest.approx(b.tip[among], abs=2e-4)
