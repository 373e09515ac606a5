"""A boom at rest on pins with clearance: the tip's shift by lever and clearance, its limits, and which numbers stay."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from oracle import booms
from oracle.clearance import geometry, rigid
from oracle.clearance.booms import freed
from oracle.clearance.contact import Contact, stiffness
from oracle.clearance.free_play import lengthening, tip_shift
from oracle.pinned_scenes import ALL_PINS, CYLINDER_PINS, RADII, RODS, resting, with_clearance

from boom_twin.physics.contact import LEAST_GAP, SMOOTH
from boom_twin.scene.parts import IDEAL_BELOW

POSTURES = ["horizontal", "arch", "high", "low"]
DOCUMENT = booms.document()
IDEAL = booms.scene_of(DOCUMENT)


def bush(index, clearance):
    """The oracle's contact at a pin of cylinder `index`, with the model's smoothing and cap of the stiffness."""
    return Contact(stiffness_of(index, clearance), 0.0, clearance, smoothing=SMOOTH)


def stiffness_of(index, clearance):
    """K (N/m^1.5) with the model's cap: both the play of the radii and the bush's radius."""
    return stiffness(RADII[index], max(clearance, LEAST_GAP), 2.06e11, 0.3)


def held(document, headings, index, tension):
    """Axis of cylinder `index` (complex, m) and force of the bush on its rod's and on its barrel's pin (complex, N)."""
    oil = freed(document, headings, index, None).cylinder
    barrel, rod = geometry.pins(document, headings, index)
    axis, gravity = rod - barrel, geometry.gravity(document)
    on_rod = oil.holding(abs(axis), np.angle(axis), tension, gravity)
    return axis, on_rod, -on_rod - (oil.barrel_mass + oil.rod_mass) * gravity


def loaded_lever(posture, index, step=1e-5):
    """How the resting tip of the ideal boom moves by the length of a drive: complex, m/m."""
    one = step * (np.arange(4) == index)
    return (resting(IDEAL, posture, one).tip - resting(IDEAL, posture, -one).tip) / (2.0 * step)


@pytest.mark.parametrize("posture", POSTURES)
@pytest.mark.parametrize("pin", CYLINDER_PINS)
def test_tip_shift_is_lever_times_clearance_and_penetration(posture, pin):
    """Levers of the boom under its load: its beams and its oil give way as the play moves it."""
    index, ideal = int(pin[9]) - 1, resting(IDEAL, posture)
    axis, on_rod, on_barrel = held(DOCUMENT, np.cumsum(ideal.joints), index, ideal.tension[index])
    force, axis = (on_rod, axis) if pin.endswith("rod") else (on_barrel, -axis)
    shift = resting(with_clearance(DOCUMENT, [pin]), posture).tip - ideal.tip
    play = lengthening(bush(index, 1e-4), force, axis)
    assert abs(loaded_lever(posture, index) * play - shift) < 0.01 * abs(shift)


@pytest.mark.parametrize("posture, index", [*product(POSTURES, range(4))])
def test_rigid_boom_rests_as_the_oracle_has_it(posture, index):
    """Tip, force and offset of a rod's pin in a boom with one oil spring; levers of its geometry give the shift within 2 %."""
    document, contact = rigid.document(4, index), bush(index, 1e-4)
    headings, pin = np.radians(document["postures"][posture]), f"cylinder_{index + 1}.rod"
    found, ideal = resting(with_clearance(document, [pin]), posture), resting(booms.scene_of(document), posture)
    drive = geometry.cylinder_length(document, headings, index)
    expected = freed(document, headings, index, contact).rest(drive, headings[index])
    smoothed = 0.5 * SMOOTH**2 / 1e-4  # r = sqrt(|delta|^2 + s^2) is longer than |delta| by this
    assert abs(found.offsets[0] - expected.offset) < 2.0 * smoothed
    assert abs(found.tip - expected.tip) < 60.0 * smoothed
    assert found.tension[index] == pytest.approx(expected.tension, rel=1e-5, abs=0.1)
    assert abs(found.forces[0] + expected.force) < 1e-4 * abs(expected.force) + 1.0
    if (posture, index) != ("low", 3):  # it carries little but its own cylinder
        shift = found.tip - ideal.tip
        estimate = tip_shift(document, np.cumsum(ideal.joints), index, contact, expected.force)
        assert abs(estimate - shift) < 0.02 * abs(shift)


@pytest.mark.parametrize("index", range(4))
def test_the_shift_falls_linearly_down_to_the_switch_to_the_ideal_pin(index):
    """And jumps there by lever x (1 um + penetration): the penetration stays, for the stiffness is capped."""
    pin, posture, ideal = RODS[index], "horizontal", resting(IDEAL, "horizontal")
    axis, force, _ = held(DOCUMENT, np.cumsum(ideal.joints), index, ideal.tension[index])
    lever, clearances = loaded_lever(posture, index), (2e-4, 1e-4, 5e-5, 3e-5, 1e-5, 3e-6, IDEAL_BELOW)
    for clearance in clearances:
        shift = resting(with_clearance(DOCUMENT, [pin], clearance), posture).tip - ideal.tip
        play = lengthening(bush(index, clearance), force, axis)
        assert abs(lever * play - shift) < 0.02 * abs(shift), clearance
    beyond = resting(with_clearance(DOCUMENT, [pin], 0.99 * IDEAL_BELOW), posture)
    assert beyond.tip == ideal.tip and not len(beyond.forces)
    depth = (abs(force) / stiffness_of(index, IDEAL_BELOW)) ** (2.0 / 3.0)
    assert abs(shift) == pytest.approx(abs(lever) * (IDEAL_BELOW + depth), rel=0.02)


@pytest.mark.parametrize("index", range(4))
@pytest.mark.parametrize("document", [DOCUMENT, rigid.document(4, 0)], ids=["flexible", "rigid"])
def test_a_reversed_force_moves_the_tip_by_the_free_play(index, document):
    """A twentieth of the weight, up instead of down: twice the clearance and both penetrations, through the lever."""
    tips, depths, pins = [], [], [RODS[index]]
    for weight in (-0.05, 0.05):
        loaded = document | {"gravity": [0.0, 9.81 * weight]}
        one, other = resting(with_clearance(loaded, pins), "horizontal"), resting(booms.scene_of(loaded), "horizontal")
        tips.append(one.tip - other.tip)
        depths.append(abs(one.offsets[0]) - 1e-4)
    lever = abs(geometry.levers(document, np.zeros(4))[index])
    assert abs(tips[1] - tips[0]) == pytest.approx(lever * (2e-4 + sum(depths)), rel=0.02)


@pytest.mark.parametrize("posture", ["horizontal", "arch"])
@pytest.mark.parametrize("pin", ALL_PINS)
def test_reciprocity(pin, posture):
    """The tip sinks by what a unit load at the tip adds to the pin's force, times the offset (Betti), for every pin."""
    small, payload = 2e-5, 0.5
    ideal = resting(IDEAL, posture)
    light = resting(with_clearance(DOCUMENT, [pin], small), posture)
    heavy = resting(with_clearance(DOCUMENT | {"tip": {"payload": payload}}, [pin], small), posture)
    gained = (heavy.forces[0] - light.forces[0]) / (payload * 9.81)
    sinking = (gained * np.conj(light.offsets[0])).real
    assert (ideal.tip - light.tip).imag == pytest.approx(sinking, rel=0.02, abs=2e-6)


@pytest.mark.parametrize("index", range(4))
def test_play_in_a_joint_moves_no_other_joint(index):
    """Rigid sections on incompressible cylinders: the other joints follow from their own strokes alone."""
    document = rigid.document(4, 4)
    own = [pin for pin in ALL_PINS if f"_{index + 1}." in pin and pin != "joint_1.pivot"]
    found, ideal = (resting(scene, "arch") for scene in (with_clearance(document, own), booms.scene_of(document)))
    moved = np.abs(found.joints - ideal.joints) > 1e-11
    assert list(moved) == [i == index for i in range(4)]
