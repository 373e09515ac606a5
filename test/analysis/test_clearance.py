"""A boom at rest on pins with clearance, and its small vibrations: the oracle, the work of a unit load, ideal pins as limit."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from analysis.resting import resting
from oracle import booms
from oracle.clearance.scenes import PINS, RADII, RODS, rigid_document, with_pins
from reference.contact_law import Contact, stiffness
from reference.worn_pin import geometry
from reference.worn_pin.motion import freed

from boom_twin import statics
from boom_twin.kernels.elements.pin_contact import LEAST_GAP, SMOOTH

POSTURES = ["horizontal", "arch", "high", "low"]
DOCUMENT = booms.document()
LOAD = 0.5  # kg, of payload, for the change of a pin's force with the load
IDEAL = booms.scene_of(DOCUMENT)


def bush(pin, clearance):
    """The oracle's contact at `pin`, with the model's smoothing and cap of the stiffness."""
    k = stiffness(RADII.get(pin, 0.025), max(clearance, LEAST_GAP), 2.06e11, 0.3)
    return Contact(k, 0.0, clearance, smoothing=SMOOTH)


@pytest.mark.parametrize("posture, index", [*product(POSTURES, range(4))])
def test_rigid_boom_rests_as_the_oracle_has_it(posture, index):
    """Tip, force and offset of a rod's pin in a boom with one oil spring."""
    document, contact = rigid_document(4, index), bush(RODS[index], 1e-4)
    headings, pin = np.radians(document["postures"][posture]), f"cylinder_{index + 1}.rod"
    found = resting(with_pins(document, [pin]), posture)
    drive = geometry.cylinder_length(document, headings, index)
    expected = freed(document, headings, index, contact).rest(drive, headings[index])
    smoothed = 0.5 * SMOOTH**2 / 1e-4  # r = sqrt(|delta|^2 + s^2) is longer than |delta| by this
    off = found.offsets[0] - expected.offset
    assert max(abs(off.real), abs(off.imag)) < 1.2 * smoothed
    assert abs(found.tip - expected.tip) < 60.0 * smoothed
    assert found.tension[index] == pytest.approx(expected.tension, rel=1e-5, abs=0.1)
    assert abs(found.forces[0] + expected.force) < 1e-4 * abs(expected.force) + 1.0


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
    document = rigid_document(4, index)
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
