"""Bending moments against statics of what lies outboard."""

from __future__ import annotations

import numpy as np
import pytest
from drive_twin import drive_twin

from boom_twin import Sample, Stream, load_scene
from boom_twin.analysis.bending_moments import PLACES, moments_by_unknowns, stations
from boom_twin.analysis.equilibrium import settle
from boom_twin.compiler.compile import compile_scene
from boom_twin.scene.kinematics import joint_angles_of_strokes, strokes_of_posture

SCENE = load_scene()


@pytest.fixture(scope="module")
def at_rest():
    """Moments at the stations of the last section, and the angle of that section, when the boom is level."""
    plan = compile_scene(SCENE)
    state, work = plan.state(), plan.work()
    strokes = strokes_of_posture(SCENE, "horizontal")
    settle(plan, state, work, strokes, joint_angles_of_strokes(SCENE, strokes))
    return moments_by_unknowns(plan) @ state.z, np.arctan2(*np.diff(state.frames[[-3, -1], :2], axis=0)[0, ::-1])


def test_the_last_section_carries_its_own_weight(at_rest):
    """M(s) = -g (head (c - s) + rho (l - s)^2 / 2), less by the cosine of its slope."""
    moments, slope = at_rest
    section, places = SCENE.sections[-1], stations(SCENE)
    mine = [i for i, station in enumerate(places) if station.section == 3]
    for i in mine:
        arm = section.beam[1] - places[i].place
        weight = section.head.mass * (section.head.com[0] - places[i].place) + 0.5 * section.rho_A * arm**2
        assert moments[i] == pytest.approx(-9.81 * weight * np.cos(slope), rel=5e-3, abs=0.5)


def test_one_column_for_every_station(at_rest):
    places = stations(SCENE)
    assert len(at_rest[0]) == len(places) and len(places) % len(PLACES) == 0
    assert places[0].name == "section 1 at 0.60 m"


def test_predictions_carry_them():
    twin, strokes = drive_twin(SCENE), strokes_of_posture(SCENE, "horizontal")
    prediction = twin.update(Sample(Stream.STROKES, 10**9, strokes)).prediction
    assert prediction.moments.shape == (len(stations(SCENE)),)
    assert prediction.moments[0] == pytest.approx(-33038.1, rel=1e-3)


def test_a_rigid_boom_has_no_stations():
    rigid = SCENE.model_copy(update={"modes": 0})
    assert stations(rigid) == () and moments_by_unknowns(compile_scene(rigid)).shape[0] == 0
