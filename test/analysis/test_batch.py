"""A stack of booms gives what each boom gives alone, to the bit, on one core and on several."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms
from oracle.clearance.scenes import RODS, with_pins

from boom_twin.analysis.batch import Batch
from boom_twin.analysis.methods import integrate_with
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.plan import taken_apart
from boom_twin.scene import load_scene
from boom_twin.scene.kinematics import posture_angles, strokes_of_posture

STEP, STEPS = 2e-3, 60
SCENE = load_scene()
START, ANGLES = strokes_of_posture(SCENE, "arch"), posture_angles(SCENE, "arch")


def drive(times):
    return START + np.outer(times**2, [0.05, -0.02, 0.04, 0.01]), np.outer(2 * times, [0.05, -0.02, 0.04, 0.01])


def softer(factor, scene=SCENE):
    """The default scene with another oil spring in cylinder 2."""
    joint = scene.joints[1]
    cylinder = joint.cylinder.model_copy(update={"k": joint.cylinder.k * factor})
    joints = (scene.joints[0], joint.model_copy(update={"cylinder": cylinder}), *scene.joints[2:])
    return scene.model_copy(update={"joints": joints})


@pytest.mark.parametrize("cores", [1, 2])
def test_each_boom_is_stepped_as_it_is_alone(cores):
    scenes = [softer(factor) for factor in (1.0, 0.5, 0.9, 1.3, 2.0)]
    batch = Batch([compile_scene(scene) for scene in scenes], cores)
    first = batch.settle(START, ANGLES)
    rows = batch.run(STEP, *drive(STEP * np.arange(1, STEPS + 1)))
    assert rows.shape[:2] == (5, STEPS) and not batch.failures()
    for i, scene in enumerate(scenes):
        alone = integrate_with(scene, drive, STEP * STEPS, STEP, angles=ANGLES)
        assert np.array_equal(rows[i][:, :4], alone.joints[1:])
        assert np.array_equal(rows[i][:, 8:10], alone.tip[1:])
        assert np.array_equal(first[i][8:10], alone.tip[0])
    assert np.ptp(rows[:, -1, 9]) > 1e-3


def test_booms_on_worn_pins_are_stepped_as_each_is_alone():
    """Sub-steps and what pins remember are each boom's own."""
    worn = with_pins(booms.document(), [*RODS, "joint_3.Q"], friction=0.1)
    scenes = [softer(factor, worn) for factor in (1.0, 0.6, 1.7)]
    batch = Batch([compile_scene(scene) for scene in scenes], 2)
    batch.settle(START, ANGLES)
    rows = batch.run(STEP, *drive(STEP * np.arange(1, STEPS + 1)))
    assert rows.shape[:2] == (3, STEPS) and not batch.failures()
    for i, scene in enumerate(scenes):
        alone = integrate_with(scene, drive, STEP * STEPS, STEP, angles=ANGLES)
        assert np.array_equal(rows[i][:, 8:10], alone.tip[1:])
        assert np.array_equal(taken_apart(batch.plans[i], rows[i]).pins, alone.pins[1:])


def test_a_boom_that_fails_leaves_the_others_alone():
    batch = Batch([compile_scene(SCENE)] * 3)
    batch.settle(START, ANGLES)
    strokes, rates = drive(STEP * np.arange(1, STEPS + 1))
    strokes = np.repeat(strokes[None], 3, axis=0)
    strokes[1, STEPS // 2 :] = np.nan
    rows = batch.run(STEP, strokes, rates)
    assert list(batch.failures()) == [1] and "not finite" in batch.failures()[1]
    assert np.isnan(rows[1, STEPS // 2 :]).all() and np.isfinite(rows[1, : STEPS // 2]).all()
    assert np.array_equal(rows[0], rows[2]) and np.isfinite(rows[0]).all()
