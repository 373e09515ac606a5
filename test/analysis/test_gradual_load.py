"""Equilibria that the full load at once does not find: followed from no load, or refused with the share that is carried."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin import load_scene, statics
from boom_twin.analysis.equilibrium import rest_at
from boom_twin.errors import SolverError
from boom_twin.kernels.integrators import X
from boom_twin.scene.kinematics import posture_angles, strokes_of_posture
from boom_twin.validation.study import scene_changes as made


@pytest.mark.parametrize(
    "scene, posture",
    [
        (made.cylinders(load_scene(), 1e5), "arch"),
        (made.bending(load_scene(), 1e-3), "arch"),
        (made.loaded(load_scene(), 10.0), "high"),
    ],
    ids=["soft cylinders", "soft sections", "ten times its own weight"],
)
def test_a_soft_boom_hangs_and_is_stable(scene, posture):
    found = statics(scene, posture=posture)
    assert found.tip[1] < found.tip_rigid[1] - 1.0
    assert found.frequencies[0] > 0.05


def test_barrels_and_rods_at_rest_are_turned_by_less_than_half_a_turn():
    """Whatever full turns the trials on the way made: a multiple of 2 pi in their histories would cost digits."""
    soft = made.bending(load_scene(), 1e-3)
    plan, state, _ = rest_at(soft, strokes_of_posture(soft, "arch"), posture_angles(soft, "arch"))
    assert np.abs(state.history[X, plan.tables.parts.history + 2]).max() <= np.pi


def test_the_path_of_growing_load_is_one_curve():
    """The equilibrium at full load is next to that at nearly full load: nothing has jumped."""
    soft = made.cylinders(load_scene(), 1e5)
    tips = [statics(made.lighter_gravity(soft, share), posture="arch").tip for share in (0.98, 0.99, 1.0)]
    steps = np.diff(tips, axis=0)
    assert np.linalg.norm(steps, axis=1).max() < 0.1
    assert np.linalg.norm(steps[1] - steps[0]) < 0.1 * np.linalg.norm(steps[0])


def test_what_no_boom_carries_is_refused_with_the_share_that_it_does():
    beyond = made.freed(load_scene(), 1, -178.0, 0.6, -172.0)
    with pytest.raises(SolverError, match=r"carries 0\.\d+ of its weight"):
        statics(beyond, posture="case")
