"""Equilibria with play: against the finite segments, against the equations of motion, against the closed form."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms, segments
from oracle.clearance import rigid
from oracle.clearance.free_play import lengthening, loaded_lever, tip_shift
from reference.worn_pin import geometry
from reference.worn_pin.motion import freed

from boom_twin.validation.contact_law import HYSTERESIS, Contact, stiffness

RADII = (0.030, 0.025, 0.025, 0.020)
POSTURES = ["horizontal", "arch", "high", "low"]
CASES = [(posture, index) for posture in POSTURES for index in range(4) if (posture, index) != ("low", 3)]
"""Without the one pin that carries little but its own cylinder: 80 N."""


def pin(index, clearance, smoothing=0.0):
    k = stiffness(RADII[index], clearance, 2.06e11, 0.3)
    return Contact(k, HYSTERESIS["lankarani-nikravesh"](0.9), clearance, smoothing=smoothing)


@pytest.mark.parametrize("posture", POSTURES)
@pytest.mark.parametrize("index", range(4))
def test_ideal_pin_meets_the_finite_segments(posture, index):
    """Masses, gravity, levers, oil: all of the rigid boom's equilibrium by another method."""
    document = rigid.document(4, index) | {"tip": {"payload": 30.0}, "line_fill": 8.0}
    document["base"] |= {"inclination": 0.1}
    headings = np.radians(document["postures"][posture])
    scene = booms.scene_of(document)
    drive = segments.Segments(scene, 0).lengths(np.diff(headings, prepend=0.0))
    tip, _, forces = np.split(segments.statics(scene, 0, drive, np.diff(headings, prepend=0.0))[:10], [2, 6])
    found = freed(document, headings, index, None).rest(drive[index], headings[index])
    assert [found.tip.real, found.tip.imag] == pytest.approx(tip, abs=1e-9)
    assert found.tension == pytest.approx(forces[index], rel=1e-7, abs=1e-3)


@pytest.mark.parametrize("posture, index", [*CASES, ("low", 3)])
@pytest.mark.parametrize("smoothing", [0.0, 5e-6])
def test_nothing_accelerates_at_rest(posture, index, smoothing):
    """The force law backwards, by which the equilibrium was found, against the law forwards in the equations of motion."""
    document = booms.document()
    headings = np.radians(document["postures"][posture])
    drive = geometry.cylinder_length(document, headings, index)
    boom = freed(document, headings, index, pin(index, 1e-4, smoothing))
    rest = boom.rest(drive, headings[index])
    state = np.array([rest.phi, rest.length, rest.psi, 0.0, 0.0, 0.0])
    accelerations = np.array(boom.rates((drive, 0.0), state, 0.0)[3:])
    assert boom.part.at(rest.phi).inertia * accelerations[0] == pytest.approx(0.0, abs=0.05)
    assert boom.cylinder.rod_mass * accelerations[1:] == pytest.approx([0.0, 0.0], abs=0.5)


@pytest.mark.parametrize("posture, index", CASES)
@pytest.mark.parametrize("clearance", [1e-4, 2e-5])
def test_tip_shift_is_lever_times_clearance_and_penetration(posture, index, clearance):
    """Within 2 % by the geometric lever, within 0.1 % by the loaded one."""
    document = booms.document()
    headings = np.radians(document["postures"][posture])
    drive, contact = geometry.cylinder_length(document, headings, index), pin(index, clearance)
    ideal = freed(document, headings, index, None)
    rest = ideal.rest(drive, headings[index])
    shift = freed(document, headings, index, contact).rest(drive, headings[index]).tip - rest.tip
    sagged = np.concatenate([headings[:index], headings[index:] + rest.phi - headings[index]])
    assert abs(tip_shift(document, sagged, index, contact, rest.force) - shift) < 0.02 * abs(shift)
    barrel, rod = geometry.pins(document, sagged, index)
    play = lengthening(contact, rest.force, rod - barrel)
    assert np.sign(play) == np.sign(rest.tension) and abs(play) > 0.9 * clearance
    assert abs(loaded_lever(ideal, drive, headings[index]) * play - shift) < 1e-3 * abs(shift)


@pytest.mark.parametrize("index", range(4))
def test_reversed_load_moves_the_tip_by_the_free_play(index):
    """Weight up instead of down, a twentieth of it: twice the clearance and both penetrations through the lever."""
    headings, shifts, depths = np.zeros(4), [], []
    document, contact = booms.document(), pin(index, 1e-4)
    drive = geometry.cylinder_length(document, headings, index)
    for weight in (-0.05, 0.05):
        document["gravity"] = [0.0, 9.81 * weight]
        with_play, ideal = (freed(document, headings, index, c).rest(drive, headings[index]) for c in (contact, None))
        shifts.append(with_play.tip - ideal.tip)
        depths.append(abs(with_play.offset) - contact.clearance)
    lever = abs(geometry.levers(document, headings)[index])
    assert abs(shifts[1] - shifts[0]) == pytest.approx(lever * (2.0 * contact.clearance + sum(depths)), rel=5e-3)
