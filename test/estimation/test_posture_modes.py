"""Modes on a grid of strokes: near those of the posture itself, and the same whenever they are computed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boom_twin.analysis.equilibrium import settle
from boom_twin.analysis.modal import natural_modes
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.plan import Plan
from boom_twin.estimation.deviation_modes import POSTURE_STEP
from boom_twin.estimation.posture_modes import GRID, KEPT, PostureModes
from boom_twin.kernels.tables import State
from boom_twin.scene import load_scene
from boom_twin.scene.kinematics import joint_angles_of_strokes, strokes_of_posture
from boom_twin.types import Array

SCENE = load_scene()
BAND = 2.0 * math.pi * 25.0


@pytest.fixture(scope="module")
def plan() -> Plan:
    return compile_scene(SCENE)


def at_rest(plan: Plan, strokes: Array) -> State:
    state = plan.state()
    settle(plan, state, plan.work(), strokes, joint_angles_of_strokes(SCENE, strokes))
    return state


def test_they_are_nearer_to_those_of_the_posture_itself_than_is_waited_for(plan: Plan) -> None:
    """Modes are taken anew after `POSTURE_STEP` of stroke: the grid puts them off by less than that does."""
    strokes = strokes_of_posture(SCENE, "arch")
    found = PostureModes(SCENE, plan).near(strokes)
    assert found is not None and np.abs(found[0].strokes - strokes).max() <= 0.5 * GRID
    own = natural_modes(plan, at_rest(plan, strokes), plan.work(), 3)
    moved = natural_modes(plan, at_rest(plan, strokes + POSTURE_STEP), plan.work(), 3)
    near = [each.mode for each in found[0].lowest(3, BAND)]
    off, allowed = (1.0 - np.abs([(plan.masses * a.motion) @ b.motion for a, b in zip(own, each, strict=True)])
                    for each in (near, moved))  # fmt: skip
    assert off[0] < allowed[0] and off.max() < allowed.max()
    off, allowed = (max(abs(a.frequency / b.frequency - 1.0) for a, b in zip(own, each, strict=True)) for each in (near, moved))
    assert off < allowed


def test_they_are_the_same_to_the_bit_in_whatever_order_they_are_asked_for(plan: Plan) -> None:
    strokes = strokes_of_posture(SCENE, "arch")
    one, other = PostureModes(SCENE, plan), PostureModes(SCENE, plan)
    one.prepare(strokes)
    for k in range(2 * KEPT):  # the first is not kept so long
        other.near(strokes + np.array([0.0, 0.0, 0.0, 0.021 * (k - KEPT)]))
    angles, live = joint_angles_of_strokes(SCENE, strokes), plan.state()
    again, found = (each.at(strokes, angles, live) for each in (one, other))
    found.lowest(1, BAND)
    for a, b in zip(again.lowest(4, BAND), found.lowest(4, BAND), strict=True):
        assert (a.mode.frequency, a.damping) == (b.mode.frequency, b.damping)
        assert np.array_equal(a.mode.increments, b.mode.increments) and np.array_equal(a.relative, b.relative)
    assert len(other._kept) == KEPT


def test_the_boom_as_it_is_serves_where_the_grid_has_no_equilibrium_or_one_with_joints_bent_otherwise(plan: Plan) -> None:
    strokes = strokes_of_posture(SCENE, "arch")
    live, angles, modes = at_rest(plan, strokes), joint_angles_of_strokes(SCENE, strokes), PostureModes(SCENE, plan)
    before = live.z.copy()
    assert modes.at(strokes, angles, live).strokes is modes.at(strokes, angles, live).strokes
    for own in (modes.at(strokes, angles + 1.0, live), modes.at(strokes + 100.0, angles, live)):
        exact = natural_modes(plan, live, plan.work(), 2, 1e-3)
        assert [each.mode.frequency for each in own.lowest(2, BAND)] == [each.frequency for each in exact]
    assert np.array_equal(live.z, before)
