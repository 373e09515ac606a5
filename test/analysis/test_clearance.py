"""A boom at rest on pins with clearance, and its small vibrations: levers, the oracle's pins, limits on ideal pins."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from analysis.resting import resting
from oracle import booms
from oracle.clearance import rigid
from oracle.clearance.free_play import lengthening, tip_shift
from oracle.clearance.scenes import PINS, RADII, RODS, with_pins
from reference.worn_pin import geometry
from reference.worn_pin.motion import freed

from boom_twin import statics
from boom_twin.kernels.elements.pin_contact import LEAST_GAP, SMOOTH
from boom_twin.validation.contact_law import Contact, stiffness

POSTURES = ["horizontal", "arch", "high", "low"]
DOCUMENT = booms.document()
LOAD = 0.5  # kg, of payload, for the change of a pin's force with the load
BARRELS = tuple(f"cylinder_{i}.barrel" for i in range(1, 5))
IDEAL = booms.scene_of(DOCUMENT)


def bush(pin, clearance):
    """The oracle's contact at `pin`, with the model's smoothing and cap of the stiffness."""
    k = stiffness(RADII.get(pin, 0.025), max(clearance, LEAST_GAP), 2.06e11, 0.3)
    return Contact(k, 0.0, clearance, smoothing=SMOOTH)


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
@pytest.mark.parametrize("pin", RODS + BARRELS)
def test_tip_shift_is_lever_times_clearance_and_penetration(posture, pin):
    """Levers of the boom under its load: its beams and its oil give way as the play moves it."""
    index, ideal = int(pin[9]) - 1, resting(IDEAL, posture)
    axis, on_rod, on_barrel = held(DOCUMENT, np.cumsum(ideal.joints), index, ideal.tension[index])
    force, axis = (on_rod, axis) if pin.endswith("rod") else (on_barrel, -axis)
    shift = resting(with_pins(DOCUMENT, [pin]), posture).tip - ideal.tip
    play, lever = lengthening(bush(pin, 1e-4), force, axis), loaded_lever(posture, index)
    assert abs(lever * play - shift) < 0.01 * abs(shift)
    if abs((force * axis.conjugate()).real) > 0.99 * abs(force * axis):  # along the cylinder: it carries more than itself
        rigid_lever = geometry.levers(DOCUMENT, np.cumsum(ideal.joints))[index]
        assert abs(rigid_lever) == pytest.approx(abs(lever), rel=0.06)


@pytest.mark.parametrize("posture, index", [*product(POSTURES, range(4))])
def test_rigid_boom_rests_as_the_oracle_has_it(posture, index):
    """Tip, force and offset of a rod's pin in a boom with one oil spring; levers of its geometry give the shift within 2 %."""
    document, contact = rigid.document(4, index), bush(RODS[index], 1e-4)
    headings, pin = np.radians(document["postures"][posture]), f"cylinder_{index + 1}.rod"
    found, ideal = resting(with_pins(document, [pin]), posture), resting(booms.scene_of(document), posture)
    drive = geometry.cylinder_length(document, headings, index)
    expected = freed(document, headings, index, contact).rest(drive, headings[index])
    smoothed = 0.5 * SMOOTH**2 / 1e-4  # r = sqrt(|delta|^2 + s^2) is longer than |delta| by this
    off = found.offsets[0] - expected.offset
    assert max(abs(off.real), abs(off.imag)) < 1.2 * smoothed
    assert abs(found.tip - expected.tip) < 60.0 * smoothed
    assert found.tension[index] == pytest.approx(expected.tension, rel=1e-5, abs=0.1)
    assert abs(found.forces[0] + expected.force) < 1e-4 * abs(expected.force) + 1.0
    if (posture, index) != ("low", 3):  # it carries little but its own cylinder
        shift = found.tip - ideal.tip
        estimate = tip_shift(document, np.cumsum(ideal.joints), index, contact, expected.force)
        assert abs(estimate - shift) < 0.02 * abs(shift)


@pytest.mark.parametrize("posture", POSTURES[:2])
@pytest.mark.parametrize("pin", PINS)
def test_the_tip_sinks_by_the_work_of_a_unit_load(pin, posture):
    """Betti: tip shift = change of the pin's force per load at the tip, times the offset. Every pin that can have clearance."""
    found, loaded = (resting(with_pins(each, [pin]), posture) for each in (DOCUMENT, DOCUMENT | {"tip": {"payload": LOAD}}))
    lever = (loaded.forces[0] - found.forces[0]) / (LOAD * 9.81)
    work = (lever * found.offsets[0].conjugate()).real
    assert (found.tip - resting(IDEAL, posture).tip).imag == pytest.approx(-work, rel=0.01, abs=2e-6)
    assert abs(found.offsets[0]) > 1e-4 - 2e-6


CLEARANCE, STEP = 1e-4, 1e-9


def undamped(index):
    """A rigid boom with the oil spring of cylinder `index` alone, without its damper."""
    document = rigid.document(4, index)
    del document["joints"][index]["cylinder"]["d"]
    return document


def linearised(document, headings, index):
    """Natural frequencies (Hz, ascending) of the oracle's three coordinates, from differences of its accelerations."""
    contact = Contact(stiffness(RADII[RODS[index]], CLEARANCE, 2.06e11, 0.3), 0.0, CLEARANCE, smoothing=SMOOTH)
    boom, drive = freed(document, headings, index, contact), geometry.cylinder_length(document, headings, index)
    rest = boom.rest(drive, headings[index])
    at = np.array([rest.phi, rest.length, rest.psi, 0.0, 0.0, 0.0])
    sides = [[boom.rates((drive, 0.0), at + side * one, 0.0)[3:] for one in np.eye(6)[:3]] for side in (STEP, -STEP)]
    return np.sort(np.sqrt(-np.linalg.eigvals(np.subtract(*sides) / (2.0 * STEP)).real)) / (2.0 * np.pi)


@pytest.mark.parametrize("posture", ["horizontal", "arch"])
@pytest.mark.parametrize("index", range(4))
def test_frequencies_on_a_pin_in_contact_are_the_oracles(posture, index):
    """All three of a rigid boom; linearised, the pin is as stiff along its force, so the lowest is the same."""
    document = undamped(index)
    expected = linearised(document, np.radians(document["postures"][posture]), index)
    found = statics(with_pins(document, [RODS[index]], CLEARANCE), posture=posture).frequencies
    assert found == pytest.approx(expected, rel=1e-4)
    linear = statics(with_pins(document, [RODS[index]], CLEARANCE, "spring-damper"), posture=posture)
    assert linear.frequencies[0] == pytest.approx(expected[0], rel=5e-4)


@pytest.mark.parametrize("pins", [RODS, PINS], ids=["rods", "all"])
def test_frequencies_go_to_those_of_ideal_pins_as_contact_gets_stiff(pins):
    """Clearance of 1 um, rigid sections, and a steel that is stiffer in the pins alone: off by its power -2/3, then -1.

    The tangent of a Hertzian contact goes with K^(2/3) F^(1/3); once it is smaller than the smoothing the penetration makes
    it linear.
    """
    off = []
    for factor in (1.0, 1e2, 1e4, 1e6):
        document = booms.document()
        document["sections"] = [section | {"modes": 0} for section in document["sections"]]
        document["material"]["E"] *= factor
        found, ideal = (
            statics(scene, posture="arch", modes=4).frequencies
            for scene in (with_pins(document, pins, 1e-6), booms.scene_of(document))
        )
        off.append(1.0 - found / ideal)
    assert np.all(np.array(off) > 0.0)
    ratios = np.array(off[1:]) / off[:-1]
    assert np.all(ratios[0] < 0.1) and np.all(ratios[1:] < 0.05)
    assert np.all(off[-1] < 1e-6)
