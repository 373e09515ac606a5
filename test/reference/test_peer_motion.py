"""The stiff solver's motion against the transfer-matrix boom, and its own convergence."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms
from reference.segments.stiff_solver import follow

from boom_twin import load_scene
from boom_twin.analysis.methods import integrate_with
from boom_twin.analysis.motions import motion_of

DURATION, ROW = 1.0, 0.01


def drive_of(scene, motion):
    closed = np.array([joint.cylinder.closed_length for joint in scene.joints])

    def drive(time):
        strokes, rates = motion(np.array([time]))
        x = min(max(time / motion.rise, 0.0), 1.0)
        return closed + strokes[0], rates[0], 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / motion.rise**2 * motion.travel

    return drive


def rms(vectors):
    return np.sqrt(np.mean(np.sum(np.square(vectors), axis=-1)))


def columns(motion):
    """Tip (m), tip acceleration (m/s^2), joints (rad), forces (N) of a motion."""
    return motion.tip, motion.tip_acceleration, motion.joints, motion.cylinder_forces


def expected(scene):
    """The transfer-matrix boom with 6 modes."""
    motion = motion_of(scene)
    return integrate_with(scene.model_copy(update={"modes": 6}), motion, DURATION, 5e-4, 20, angles=motion.angles)


def followed(scene, fineness, tolerance=1e-5, solver="Radau"):
    motion, times = motion_of(scene), ROW * np.arange(round(DURATION / ROW) + 1)
    return columns(follow(scene, drive_of(scene, motion), motion.angles, times, fineness, tolerance, solver))


def errors(found, truth):
    """rms of the tip (m); of acceleration and forces over their own rms; largest of the joints (rad)."""
    tip, acceleration, joints, forces = (a - b for a, b in zip(found, columns(truth), strict=True))
    relative = rms(acceleration) / rms(truth.tip_acceleration), rms(forces) / rms(truth.cylinder_forces)
    return np.array([rms(tip), relative[0], np.abs(joints).max(), relative[1]])


def test_default_boom_converges_to_the_same_motion():
    """Errors fall with the square of the number of segments, to well below a millimetre."""
    truth = expected(load_scene())
    coarse, fine = (errors(followed(load_scene(), fineness), truth) for fineness in (1, 2))
    assert coarse[0] < 2e-3
    assert coarse / fine == pytest.approx(4.0, abs=1.0)
    assert np.all(fine < [5e-4, 0.02, 2e-4, 2e-3])


@pytest.mark.parametrize("seed", [3, 8, 12, 16])
def test_random_booms(seed):
    """Incompressible cylinders, parts missing, any order of joints; extrapolated from two subdivisions."""
    scene = booms.random_boom(seed)
    coarse, fine = followed(scene, 1), followed(scene, 2)
    found = errors([b + (b - a) / 3.0 for a, b in zip(coarse, fine, strict=True)], expected(scene))
    assert np.all(found < [1e-4, 0.01, 5e-5, 2e-3]), found
