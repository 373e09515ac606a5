"""Booms of up to 200 sections: a dense solve of the same step confirms the results."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import posture_angles, strokes_of_posture
from kernels.dense import NUDGE, Dense
from studies.roundoff.exact_step import one_step

from boom_twin.analysis.equilibrium import settle
from boom_twin.compiler.compile import compile_scene
from boom_twin.kernels.integrators import GENERALISED_ALPHA, HAT, OFFSET, OLD, prepare
from boom_twin.kernels.tables import Motion
from boom_twin.kernels.transfer.time_step import advance
from boom_twin.validation.study.scenes import long_boom

STEP, RHO, STEPS = 1e-3, 0.8, 20
LENGTH = 20.0  # m, of every boom
EPS = np.finfo(float).eps
SPEED, BEGIN = 1e-2, 5e-2  # travels of a cylinder per second; s from rest to it


def boom(count):
    """A boom of `count` sections with six-bars of all kinds."""
    return long_boom(count, kinds=("B1", "B2", "B3"))


@pytest.mark.parametrize("count", [2, 10, 100, pytest.param(200, marks=pytest.mark.slow)])
def test_sweeps_round_off_no_more_than_elimination_of_the_whole(count):
    """One linear step from rest; LU with pivoting of all unknowns at once, and an exact solution of the same system.

    Measured up to 200 sections: at most 1.4 times the error of LU, which is 3e-13 of the tip's increment there.
    """
    scene = boom(count)
    found = one_step(scene, posture_angles(scene, "test"), STEP, RHO)
    assert found.exact < 1e-15
    assert found.riccati < 5.0 * found.dense + 1e-14
    assert found.riccati < 1e-12


@pytest.mark.parametrize("count", [2, 10, 100, pytest.param(200, marks=pytest.mark.slow)])
def test_a_step_in_motion_solves_the_equations_of_all_unknowns(count):
    """Bent, loaded and moving: what is left of the forces is the rounding of positions.

    Positions are rounded to `EPS * LENGTH`. The witness divides that by its nudge, times forces of cylinders; accelerations
    multiply it by the gain, times masses.
    """
    scene = boom(count)
    plan, strokes = compile_scene(scene), strokes_of_posture(scene, "test")
    state, work = plan.state(), plan.work()
    settle(plan, state, work, strokes, posture_angles(scene, "test"))
    scheme = prepare(GENERALISED_ALPHA, RHO, STEP, work.weights)
    speeds = SPEED * np.array([joint.cylinder.max_stroke for joint in scene.joints])
    for now in STEP * np.arange(1, STEPS + 1):
        drive, rate = plan.closed_lengths + strokes + speeds * now**2 / (2.0 * BEGIN), speeds * now / BEGIN
        hat, offset = scheme.weights[[HAT, OFFSET], OLD:] @ state.history
        status, _, size = advance(plan.tables, state, work, scheme, drive, rate, 1e-11, np.int64(20), 0.5, None, False)
        assert status == 0
    assert size < 2e-12  # rad: increments of the last pass, all of them rounding
    motion = Motion(scheme.gain, scheme.rate, hat, offset)
    left = np.abs(Dense(plan, motion, drive, rate).residual(state.z.copy()))
    moving = plan.tables.moving > 0
    forces, inertia = np.abs(state.z[~moving]).max() / NUDGE, scheme.gain * plan.masses.sum() * LENGTH
    assert left[moving].max() < EPS * LENGTH * (forces + inertia)  # N m
    assert left[~moving].max() < 50 * EPS * LENGTH  # m; pins that meet, lengths of cylinders
