"""Small vibrations about an equilibrium on pins with clearance: the oracle's, and their limit on ideal pins."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms
from oracle.clearance import rigid
from oracle.clearance.scenes import PINS, RADII, RODS, with_pins
from reference.worn_pin import geometry
from reference.worn_pin.motion import freed

from boom_twin import statics
from boom_twin.kernels.elements.pin_contact import SMOOTH
from boom_twin.validation.contact_law import Contact, stiffness

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
