"""Kept tangents: a sweep of forces alone, and steps with a monitor of convergence against fully converged ones."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms

from boom_twin import load_scene
from boom_twin.analysis.drive import PASSES, STEP_TOLERANCE
from boom_twin.analysis.equilibrium import rest_at
from boom_twin.analysis.methods import Method, integrate_with
from boom_twin.compiler.plan import width_of
from boom_twin.kernels.integrators import GENERALISED_ALPHA, A
from boom_twin.kernels.plane_algebra import condense, condense_forces
from boom_twin.kernels.tables import OK, Motion
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.kept_tangent import GAIN, SHARE_LEAD
from boom_twin.kernels.transfer.riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out
from boom_twin.kernels.transfer.time_step import run
from boom_twin.scene.kinematics import posture_angles, strokes_of_posture

CONVERGED = Method(tolerance=1e-12)
DIRECTION = np.array([1.0, 0.0, 0.6, 0.0])


def beside_rest(scene, posture):
    """Plan, state, work and histories of a boom a little off its equilibrium."""
    plan, state, work = rest_at(scene, strokes_of_posture(scene, posture), posture_angles(scene, posture))
    still, rng = work.position.copy(), np.random.default_rng(0)
    state.z[:] += 1e-3 * rng.normal(size=len(state.z)) * np.where(plan.tables.moving > 0, 1.0, 1e6)
    place(plan.tables, state, work)
    return plan, state, work, still


def increments(plan, state, work, motion):
    clear_cut(work, FREE)
    end, drive = np.int64(len(plan.tables.operations)), state.drives[0]
    status, _, _ = sweep_in(plan.tables, state, work, motion, drive, state.drives[1], ROOT, end, FREE, work.condensed)
    assert status == OK
    sweep_out(plan.tables, state, work, work.condensed, ROOT, end, FREE)
    return work.dz.copy()


@pytest.mark.parametrize("name, seed", [("default", None), ("rigid", None), ("boom 4", 4), ("boom 8", 8), ("boom 18", 18)])
def test_a_sweep_of_forces_alone_gives_the_increments_of_a_whole_one(name, seed):
    scene, posture = (load_scene(), "arch") if seed is None else (booms.random_boom(seed), "test")
    if name == "rigid":
        scene = scene.model_copy(update={"modes": 0})
    plan, state, work, still = beside_rest(scene, posture)
    whole = increments(plan, state, work, Motion(1e5, 500.0, still, -500.0 * still))
    gains = work.condensed.gains.copy()
    again = increments(plan, state, work, Motion(1e5, 500.0, still, -500.0 * still, False))
    assert again == pytest.approx(whole, rel=1e-9, abs=1e-9 * np.abs(whole[plan.tables.moving > 0]).max())
    assert np.array_equal(work.condensed.gains, gains)
    moved = increments(plan, state, work, Motion(1e5, 500.0, still + 1e-5, -500.0 * still, False))
    assert np.array_equal(work.condensed.gains, gains) and not np.allclose(moved, whole, rtol=1e-6)


@pytest.mark.parametrize("seed", [None, 8])
def test_a_pass_of_forces_alone_makes_no_derivatives(seed):
    """Neither placing nor a sweep of forces works out the derivatives of a part's shape: what only tangents need stays."""
    plan, state, work, still = beside_rest(*((load_scene(), "arch") if seed is None else (booms.random_boom(seed), "test")))
    increments(plan, state, work, Motion(1e5, 500.0, still, -500.0 * still))
    kept = work.drho.copy()
    state.z[:] += 1e-3 * (plan.tables.moving > 0)
    place(plan.tables, state, work)
    increments(plan, state, work, Motion(1e5, 500.0, still, -500.0 * still, False))
    assert np.array_equal(work.drho, kept)
    increments(plan, state, work, Motion(1e5, 500.0, still, -500.0 * still))
    assert not np.array_equal(work.drho, kept)


def test_condensing_forces_does_what_condensing_all_does():
    rng = np.random.default_rng(2)
    h, g = rng.normal(size=(8, 8)), rng.normal(size=8)
    h = h + h.T
    s, p, coupling, block, force = h[:3, :3].copy(), g[:3].copy(), h[3:, :3].copy(), h[3:, 3:].copy(), g[3:].copy()
    condense(s, p, coupling, block, force, 3, 5)
    alone, inside = g[:3].copy(), g[3:].copy()
    condense_forces(alone, coupling, block, inside, 3, 5)
    assert alone == pytest.approx(p, rel=1e-12) and inside == pytest.approx(force, rel=1e-12)


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


def test_the_tangent_is_kept_over_many_steps():
    scene = load_scene()
    plan, state, work = rest_at(scene, strokes_of_posture(scene, "arch"), posture_angles(scene, "arch"))
    steps, found = 400, []
    times = 1e-3 * np.arange(1, steps + 1)
    lengths, rates = (each + base for each, base in zip(course(scene, smooth)(times), (plan.closed_lengths, 0.0), strict=True))
    out = np.zeros((1, width_of(plan)))
    for k in range(steps // 20):
        own = slice(20 * k, 20 * k + 20)
        status, *_ = run(
            plan.tables, state, work, np.array([1e-3]), np.array([20]), lengths[own], rates[own], GENERALISED_ALPHA, 0.8,
            STEP_TOLERANCE, PASSES, None, out,
        )  # fmt: skip
        assert status == OK
        found.append(np.abs(work.kept_z - state.z)[plan.tables.moving > 0].max())
    assert work.kept[GAIN] > 0.0 and work.kept[SHARE_LEAD] < 100.0
    assert np.isfinite(state.history[A]).all()
    assert np.median(found) > 2e-4, "in half of the runs the tangent is older than a few steps"
