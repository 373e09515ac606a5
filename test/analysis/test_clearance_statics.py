"""A boom at rest on pins with clearance: how far its tip hangs lower, which side each pin lies on, how it vibrates."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms
from oracle.clearance import rigid
from oracle.clearance.scenes import PINS, RODS, with_pins

from boom_twin.analysis.equilibrium import settle, statics
from boom_twin.compiler.compile import compile_scene
from boom_twin.kernels.elements.pin_contact import LEAST_GAP, SMOOTH
from boom_twin.scene.kinematics import posture_angles, strokes_of_posture
from boom_twin.scene.schema import IDEAL_BELOW
from boom_twin.validation.reference.worn_pin import geometry
from boom_twin.validation.reference.worn_pin.contact import HYSTERESIS, Contact
from boom_twin.validation.reference.worn_pin.motion import freed

POSTURES = ("horizontal", "arch", "high", "low")
LOAD = 0.5  # kg, of payload, for the change of a pin's force with the load


def at_rest(scene, posture):
    """Tip (2,) in m; offsets and forces of all pins with clearance, (k, 2) in m and N."""
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    settle(plan, state, work, strokes_of_posture(scene, posture), posture_angles(scene, posture))
    offsets, forces = np.zeros((len(plan.pins), 2)), np.zeros((len(plan.pins), 2))
    for k, row in enumerate(plan.tables.clearances):
        offsets[k] = state.z[row.z : row.z + 2]
        r = np.sqrt(np.sum(offsets[k] ** 2) + SMOOTH**2)
        d = 0.5 * (r - row.gap + np.hypot(r - row.gap, SMOOTH))
        forces[k] = row.stiffness * d**row.exponent * offsets[k] / r
    return state.frames[-1, :2].copy(), offsets, forces


@pytest.mark.parametrize("posture", POSTURES[:2])
@pytest.mark.parametrize("pin", PINS)
def test_the_tip_sinks_by_the_work_of_a_unit_load(pin, posture):
    """Betti: tip shift = change of the pin's force per load at the tip, times the offset. Every pin that can have clearance."""
    ideal = at_rest(booms.scene_of(booms.document()), posture)[0]
    tip, offsets, forces = at_rest(with_pins(booms.document(), [pin]), posture)
    loaded = at_rest(with_pins(booms.document() | {"tip": {"payload": LOAD}}, [pin]), posture)
    lever = (loaded[2] - forces) / (LOAD * 9.81)
    assert (tip - ideal)[1] == pytest.approx(-np.sum(lever * offsets), rel=0.01, abs=2e-6)
    assert np.hypot(*offsets[0]) > 1e-4 - 2e-6


@pytest.mark.parametrize("posture", POSTURES)
@pytest.mark.parametrize("index", range(4))
def test_the_shift_is_lever_times_clearance_and_penetration(index, posture):
    """Levers by the oracle's own geometry, at the angles at which the boom rests; one pin hardly carries anything."""
    spec = booms.document()
    ideal = statics(booms.scene_of(spec), posture=posture, modes=1)
    tip, offsets, forces = at_rest(with_pins(spec, [RODS[index]]), posture)
    stiff = statics(booms.scene_of(spec), strokes=_longer(ideal.strokes, index, 1e-4), modes=1)
    lever = (stiff.tip - ideal.tip) / 1e-4  # by a longer drive, loads and bending included
    sign = np.sign(ideal.cylinder_forces[index])
    expected = np.linalg.norm(lever) * np.hypot(*offsets[0])
    along = abs(forces[0] @ _axis(spec, posture, index)) / np.hypot(*forces[0])
    if along > 0.99:  # the force is along the cylinder, not its own weight
        assert np.dot(tip - ideal.tip, lever) / np.linalg.norm(lever) == pytest.approx(sign * expected, rel=0.02)
        own = geometry.levers(spec, np.cumsum(ideal.joints))[index]
        assert abs(own) == pytest.approx(np.linalg.norm(lever), rel=0.06)  # rigid sections and unloaded


def _longer(strokes, index, by):
    strokes = strokes.copy()
    strokes[index] += by
    return strokes


def _axis(spec, posture, index):
    barrel, rod = geometry.pins(spec, np.radians(spec["postures"][posture]), index)
    axis = (rod - barrel) / abs(rod - barrel)
    return np.array([axis.real, axis.imag])


def test_the_shift_falls_in_proportion_to_the_clearance_down_to_the_switch():
    """And jumps there by the lever times what is left: the clearance of the switch and the penetration."""
    spec, ideal = booms.document(), at_rest(booms.scene_of(booms.document()), "arch")[0]
    found = {}
    for clearance in (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, IDEAL_BELOW, 0.99 * IDEAL_BELOW):
        tip, offsets, _ = at_rest(with_pins(spec, RODS[1:2], clearance), "arch")
        found[clearance] = np.linalg.norm(tip - ideal), (np.hypot(*offsets[0]) if len(offsets) else 0.0)
    shifts = np.array([shift / offset for shift, offset in found.values() if offset])
    assert shifts == pytest.approx(np.full(len(shifts), shifts[-1]), rel=0.02)
    assert found[0.99 * IDEAL_BELOW] == (0.0, 0.0)
    jump, depth = found[IDEAL_BELOW]
    assert IDEAL_BELOW < depth < LEAST_GAP + IDEAL_BELOW
    assert 0.5e-3 < jump < 1.5e-3  # m, of cylinder 2 at `arch`; docs/method.md states it


@pytest.mark.parametrize("block", [None, {}, {"contact": {"restitution": 0.5}}])
def test_listing_no_pin_changes_nothing(block):
    bare, listed = booms.document(), booms.document() | {"clearance": block}
    plans = [compile_scene(booms.scene_of(bare)), compile_scene(booms.scene_of(listed))]
    assert len(plans[1].tables.clearances) == 0 and plans[0].names == plans[1].names
    for one, other in zip(plans[0].tables, plans[1].tables, strict=True):
        assert np.array_equal(one, other)


def test_a_pin_at_one_joint_leaves_the_others_forces():
    ideal = statics(booms.scene_of(booms.document()), posture="horizontal", modes=1)
    worn = statics(with_pins(booms.document(), ["joint_3.Q"]), posture="horizontal", modes=1)
    assert worn.cylinder_forces[[0, 3]] == pytest.approx(ideal.cylinder_forces[[0, 3]], rel=1e-3)
    assert worn.joints[2] < ideal.joints[2] - 1e-4
    assert worn.joints[[0, 3]] == pytest.approx(ideal.joints[[0, 3]], abs=2e-5)


@pytest.mark.parametrize("index", range(4))
def test_rest_is_where_the_oracle_has_it(index):
    """Rigid sections, one cylinder with oil: own geometry, own equations, root finding.

    The model's distance of the journal is smoothed, s^2/(2 r) = 5 nm.
    """
    spec = rigid.document(4, index)
    headings = np.radians(spec["postures"]["horizontal"])
    scene = with_pins(spec, [RODS[index]])
    tip, offsets, _ = at_rest(scene, "horizontal")
    row = compile_scene(scene).tables.clearances[0]
    contact = Contact(row.stiffness, HYSTERESIS["lankarani-nikravesh"](0.9), row.gap, smoothing=SMOOTH)
    found = freed(spec, headings, index, contact).rest(geometry.cylinder_length(spec, headings, index), headings[index])
    assert [found.tip.real, found.tip.imag] == pytest.approx(tip, abs=60.0 * 5e-9)
    assert [found.offset.real, found.offset.imag] == pytest.approx(offsets[0], abs=6e-9)


def test_free_play_shows_when_the_force_of_a_pin_turns_round():
    """Gravity turned round: against ideal pins under the same loads the tip moves by both offsets through the lever."""
    for index in range(4):
        moved, offsets = [], []
        for gravity in (-9.81, 9.81):
            spec = rigid.document(4, index) | {"gravity": [0.0, gravity]}
            ideal = at_rest(booms.scene_of(spec), "horizontal")[0]
            tip, offset, _ = at_rest(with_pins(spec, [RODS[index]]), "horizontal")
            moved.append(tip - ideal)
            offsets.append(offset[0])
        lever = geometry.levers(rigid.document(4, index), np.zeros(4))[index]
        play = np.linalg.norm(moved[0] - moved[1])
        assert play == pytest.approx(abs(lever) * np.linalg.norm(offsets[0] - offsets[1]), rel=0.02)
        assert np.linalg.norm(offsets[0] - offsets[1]) > 2e-4


def test_vibration_about_a_pressed_pin_feels_its_tangent():
    """Lower than with ideal pins, by about the tangent's compliance; the linearised pin vibrates as the contact does."""
    ideal = statics(booms.scene_of(booms.document()), posture="horizontal", modes=3).frequencies
    contact = statics(with_pins(booms.document(), RODS), posture="horizontal", modes=3).frequencies
    linear = statics(with_pins(booms.document(), RODS, treatment="spring-damper"), posture="horizontal", modes=3).frequencies
    assert np.all(contact < ideal) and np.all(contact > 0.99 * ideal)
    assert linear == pytest.approx(contact, rel=5e-4)


def test_all_pins_at_once():
    tip, offsets, forces = at_rest(with_pins(booms.document(), PINS), "high")
    assert np.isfinite(tip).all()
    assert np.all(np.hypot(*offsets.T) < 2e-4) and np.all(np.hypot(*forces.T) > 0.0)
