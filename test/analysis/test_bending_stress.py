"""Stresses at stations: against geometrically exact beams of an independent code, and by a load at the tip."""

from __future__ import annotations

import numpy as np
import pytest
from analysis.resting import at_rest
from default_boom import motion_of, strokes_of_posture

from boom_twin import load_scene, simulate
from boom_twin.analysis.bending_stress import BendingStressModel, increments_by_tip_force, moments_by_unknowns, stations
from boom_twin.validation.rig import solve
from boom_twin.validation.rig.system import Boom, section_frames

SCENE = load_scene()
ELEMENTS = 24
LOADED = 3e6  # Pa; less is not looked at by its share


def peer_moments(boom: Boom):
    """Moment (N m) in the middle of every beam element of the peer, and where it begins."""
    import exudyn

    torque, position = exudyn.OutputVariableType.TorqueLocal, exudyn.OutputVariableType.Position
    now, undeformed, system = exudyn.ConfigurationType.Current, exudyn.ConfigurationType.Reference, boom.system
    for number in range(system.systemData.NumberOfObjects()):
        if system.GetObject(number)["objectType"].removeprefix("Object") == "BeamGeometricallyExact2D":
            moment = system.GetObjectOutputBody(number, torque, [0.0, 0.0, 0.0], now)
            start = system.GetObjectOutputBody(number, position, [0.0, 0.0, 0.0], undeformed)
            yield float(np.ravel(moment)[-1]), np.array(start[:2])


def at_stations(boom, strokes):
    """Moments of the peer at this model's stations: inside the parts between the middles of elements, at ends beyond them."""
    frames, wanted, elements = section_frames(SCENE, strokes), stations(SCENE), list(peer_moments(boom))
    found = np.full(len(wanted), np.nan)
    for k, station in enumerate(wanted):
        places = np.array([frames[station.section].local(place) for _, place in elements])
        low, high = (wanted[i].place for i in (3 * (k // 3), 3 * (k // 3) + 2))
        own = np.flatnonzero((np.abs(places[:, 1]) < 1e-6) & (places[:, 0] > low) & (places[:, 0] < high))
        x, m = places[own, 0], np.array([elements[i][0] for i in own])
        near = np.argsort(np.abs(x - station.place))[:4]
        found[k] = np.polyval(np.polyfit(x[near] - station.place, m[near], 2), 0.0)
    return found


@pytest.mark.parametrize("posture", ["horizontal", "arch"])
def test_stresses_at_rest_are_those_of_exact_beams(posture):
    plan, state, _ = at_rest(SCENE, posture)
    model = BendingStressModel(SCENE)
    own = moments_by_unknowns(plan) @ state.z / model.moduli
    strokes = strokes_of_posture(SCENE, posture)
    peer = at_stations(solve.at_rest(SCENE, strokes, ELEMENTS).boom, strokes) / model.moduli
    loaded = np.abs(peer) > LOADED
    assert loaded.sum() >= 6
    assert own[loaded] == pytest.approx(peer[loaded], rel=0.01)


def test_stresses_in_a_move_are_those_of_exact_beams():
    """When a fast move has stopped halfway through its swing."""
    course, span = motion_of(SCENE, "arch"), 0.6
    resting = solve.at_rest(SCENE, course.first, ELEMENTS)
    solve.move(resting, course, span, 1e-3, 0.1)
    model = BendingStressModel(SCENE)
    peer = at_stations(resting.boom, course.first) / model.moduli
    times = np.linspace(0.0, span, 301)
    last = simulate(SCENE, times, course(times)[0], 1e-3, course.angles, estimate_errors=False).end
    twin = moments_by_unknowns(at_rest(SCENE, "arch")[0]) @ last.z / model.moduli
    loaded = np.abs(peer) > LOADED
    assert loaded.sum() >= 3
    assert twin[loaded] == pytest.approx(peer[loaded], rel=0.01)


def test_the_last_section_carries_its_own_weight():
    """M(s) = -g (head (c - s) + rho (l - s)^2 / 2), less by the cosine of its slope, when the boom is level."""
    plan, state, _ = at_rest(SCENE, "horizontal")
    slope = np.arctan2(*np.diff(state.frames[[-3, -1], :2], axis=0)[0, ::-1])
    section, moments = SCENE.sections[-1], moments_by_unknowns(plan) @ state.z
    for station, moment in zip(stations(SCENE), moments, strict=True):
        if station.section == 3:
            arm = section.beam[1] - station.place
            weight = section.head.mass * (section.head.com[0] - station.place) + 0.5 * section.rho_A * arm**2
            assert moment == pytest.approx(-9.81 * weight * np.cos(slope), rel=5e-3, abs=0.5)


def test_a_force_at_the_tip_bends_as_a_payload_does():
    """The weight of half a kilogram is a force down."""
    plan, state, work = at_rest(SCENE, "arch")
    influence = moments_by_unknowns(plan) @ increments_by_tip_force(plan, state, work)
    heavy = type(SCENE).model_validate(SCENE.model_dump(exclude_none=True) | {"tip": {"payload": 0.5}})
    loaded, moved, _ = at_rest(heavy, "arch")
    more = moments_by_unknowns(loaded) @ moved.z - moments_by_unknowns(plan) @ state.z
    assert influence @ [0.0, -0.5 * 9.81] == pytest.approx(more, rel=2e-3, abs=0.02)
