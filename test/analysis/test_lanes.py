"""Booms side by side in the lanes of a kernel: each moves as it does alone, to the bit, whatever its neighbours do."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms

from boom_twin.analysis.batch import FEWEST_STEPS, Batch
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.lanes import WIDTH, lanes_of, numbers_of, side_by_side
from boom_twin.compiler.plan import stacked
from boom_twin.kernels.jit import LANES
from boom_twin.scene import load_scene
from boom_twin.scene.kinematics import posture_angles, strokes_of_posture

STEP, STEPS = 1e-3, 60
SCENE = load_scene()
TIMES = STEP * np.arange(1, STEPS + 1)


def plans_like(scene, count, seed):
    """Booms whose cylinders, beams, masses and gravity are up to 30 % off the scene's."""
    rng, plans = np.random.default_rng(seed), []
    for _ in range(count):
        plan = compile_scene(scene)
        t = plan.tables
        for numbers in (t.cylinders.compliance, t.stiffness, t.point_mass, t.parts.mass, t.bodies.mass, t.gravity):
            numbers *= rng.uniform(0.7, 1.3, (len(numbers), *[1] * (numbers.ndim - 1)))
        plans.append(plan)
    return plans


def moves(count, joints, seed, fastest=0.3):
    """Strokes and rates about zero, shape (count, STEPS, joints); from still to m/s^2 that need many passes."""
    rng = np.random.default_rng(seed)
    reach = rng.uniform(-1.0, 1.0, (count, 1, joints)) * np.geomspace(1e-4, fastest, count)[:, None, None]
    return reach * TIMES[:, None] ** 2, 2.0 * reach * TIMES[:, None]


def run(plans, start, angles, strokes, rates, cores=1, times=1):
    batch = Batch(plans, cores)
    batch.settle(start, angles)
    rows, begin = [], start
    for _ in range(times):
        rows.append(batch.run(STEP, begin + strokes, rates, every=3))
        begin = begin + strokes[:, -1:]
    return batch, np.concatenate(rows, axis=1)


def assert_as_alone(scene, posture, count, seed, fastest=0.3, cores=1):
    plans = plans_like(scene, count, seed)
    start, angles = strokes_of_posture(scene, posture), posture_angles(scene, posture)
    strokes, rates = moves(count, plans[0].joints, seed, fastest)
    batch, rows = run(plans, start, angles, strokes, rates, cores, times=2)
    for i in range(count):
        single, alone = run(plans[i : i + 1], start, angles, strokes[i : i + 1], rates[i : i + 1], times=2)
        assert np.array_equal(rows[i], alone[0], equal_nan=True)
        assert np.array_equal(batch._ends[i], single._ends[0])
        for many, one in zip(batch._states, single._states, strict=True):
            assert np.array_equal(many[i], one[0])
    assert np.ptp(rows[:, -1], axis=0).min() > 0.0
    return batch


@pytest.mark.parametrize("count", [2, WIDTH, 2 * WIDTH + 3])
def test_each_boom_moves_as_alone(count):
    batch = assert_as_alone(SCENE, "arch", count, seed=count)
    assert not batch.failures()


@pytest.mark.parametrize("seed", range(6))
def test_random_booms_move_as_alone(seed):
    assert_as_alone(booms.random_boom(seed), "test", WIDTH + 1, seed, fastest=0.1, cores=2)


def test_lanes_of_many_and_of_few_passes_are_each_as_alone():
    """One boom shakes, so that it makes tangents anew and needs several passes in most steps, and its neighbours do not."""
    batch = assert_as_alone(SCENE, "arch", WIDTH, seed=1, fastest=20.0)
    passes = batch._ends[:, 2]
    assert not batch.failures() and passes[0] <= STEPS + 5 and passes[-1] > 1.3 * STEPS


def test_a_lane_that_fails_leaves_the_others_as_alone():
    """Some begin with a stroke that is no number, some come to one, and one asks for more than the linkage reaches."""
    plans, start, angles = plans_like(SCENE, 2 * WIDTH, 3), strokes_of_posture(SCENE, "arch"), posture_angles(SCENE, "arch")
    strokes, rates = moves(2 * WIDTH, 4, 3)
    strokes[1, 20:], strokes[5], strokes[6, 30:] = np.nan, np.nan, 5.0
    batch, rows = run(plans, start, angles, strokes, rates)
    assert list(batch.failures()) == [1, 5, 6]
    for i in range(2 * WIDTH):
        single, alone = run(plans[i : i + 1], start, angles, strokes[i : i + 1], rates[i : i + 1])
        assert np.array_equal(rows[i], alone[0], equal_nan=True) and np.array_equal(batch._ends[i], single._ends[0])
    assert np.isfinite(rows[[0, 2, 3, 4, 7]]).all() and np.isfinite(rows[1, :6]).all() and np.isnan(rows[1, 7:]).all()


def test_short_runs_and_long_ones_join():
    """Runs of a few steps go one after the other; a motion in pieces is the same whichever way each piece goes."""
    plans, start, angles = plans_like(SCENE, 3, 4), strokes_of_posture(SCENE, "arch"), posture_angles(SCENE, "arch")
    strokes, rates = moves(3, 4, 4)
    pieces = [slice(0, FEWEST_STEPS - 1), slice(FEWEST_STEPS - 1, STEPS)]
    for i in range(3):
        together, alone = Batch(plans), Batch(plans[i : i + 1])
        for batch, of in ((together, slice(0, 3)), (alone, slice(i, i + 1))):
            batch.settle(start, angles)
            batch.rows = [batch.run(STEP, start + strokes[of, piece], rates[of, piece]) for piece in pieces]
        assert all(np.array_equal(many[i], one[0]) for many, one in zip(together.rows, alone.rows, strict=True))


def test_numbers_come_back_from_lanes():
    stack = stacked([plan.tables for plan in plans_like(SCENE, 5, 0)])
    groups = side_by_side(stack)
    for name, column in stack._asdict().items():
        if not isinstance(column, np.ndarray) or column.size == 0:
            continue
        lanes = getattr(groups, name)
        assert (len(lanes) == 2 and lanes.ctypes.data % 64 == 0) or column.dtype.kind == "i"
        for field in column.dtype.names or ():
            assert np.array_equal(numbers_of(lanes[field], 5), column[field])
        assert column.dtype.names or np.array_equal(numbers_of(lanes, 5), column)
    values = np.arange(10.0).reshape(5, 2)
    assert lanes_of(values)[LANES].tolist()[0][1] == [1.0, 3.0, 5.0, 7.0]
