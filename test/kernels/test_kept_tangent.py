"""Kept tangents: steps with a monitor of convergence against fully converged ones."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import posture_angles, strokes_of_posture

from boom_twin import load_scene
from boom_twin.analysis.methods import Method, integrate_with

CONVERGED = Method(tolerance=1e-12)
DIRECTION = np.array([1.0, 0.0, 0.6, 0.0])


def course(scene, push):
    """A drive from rest along DIRECTION by `push` (t -> m, m/s)."""
    start = strokes_of_posture(scene, "arch")

    def drive(times):
        position, speed = push(times)
        return start + np.outer(position, DIRECTION), np.outer(speed, DIRECTION)

    return drive


def smooth(t):
    x = np.clip(t / 1.5, 0.0, 1.0)
    return 0.05 * (10 * x**3 - 15 * x**4 + 6 * x**5), 0.05 * 30 * (x**2 - 2 * x**3 + x**4) / 1.5


def stops(t):
    """Up to 40 mm/s, and within 20 ms to nothing, five times."""
    u = t % 0.4
    speed = 0.04 * np.where(u < 0.2, np.sin(np.pi * u / 0.4) ** 2, np.clip((0.22 - u) / 0.02, 0.0, 1.0))
    return np.cumsum(speed) * t[-1] / len(t), speed


@pytest.mark.parametrize("push", [smooth, stops])
@pytest.mark.parametrize("modes", [3, 0])
def test_numbers_are_those_of_fully_converged_steps(push, modes):
    """To 1e-9 of the range in tip and joints at 1 ms; the tip's acceleration is the place's error over the step's square."""
    scene = load_scene().model_copy(update={"modes": modes})
    drive, angles = course(scene, push), posture_angles(scene, "arch")
    kept = integrate_with(scene, drive, 2.0, 1e-3, angles=angles)
    exact = integrate_with(scene, drive, 2.0, 1e-3, angles=angles, method=CONVERGED)

    def off(one, other):
        return np.abs(one - other).max() / np.ptp(other, axis=0).max()

    assert off(kept.tip, exact.tip) < 1e-9 and off(kept.joints, exact.joints) < 1e-9
    assert off(kept.cylinder_forces, exact.cylinder_forces) < 1e-8
    assert off(kept.tip_acceleration, exact.tip_acceleration) < 2e-6
    assert kept.passes < exact.passes


@pytest.mark.parametrize("push", [smooth, stops])
@pytest.mark.parametrize("step", [5e-3, 10e-3, 20e-3])
@pytest.mark.parametrize("modes", [3, 0])
def test_what_long_steps_leave_is_small_beside_their_own_error(push, step, modes):
    """Root mean squares of tip and acceleration: a five-hundredth of what half the step changes, in few passes."""
    scene = load_scene().model_copy(update={"modes": modes})
    drive, angles = course(scene, push), posture_angles(scene, "arch")
    kept = integrate_with(scene, drive, 2.0, step, angles=angles)
    exact = integrate_with(scene, drive, 2.0, step, angles=angles, method=CONVERGED)
    finer = integrate_with(scene, drive, 2.0, step / 2, angles=angles, method=CONVERGED)
    for name in ("tip", "tip_acceleration"):
        left, own = getattr(kept, name) - getattr(exact, name), getattr(finer, name)[::2] - getattr(exact, name)
        assert np.sqrt((left**2).mean()) < 2e-3 * np.sqrt((own**2).mean())
    assert kept.passes < exact.passes
