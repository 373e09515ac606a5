"""The oracle of worn pins: dropped balls, rest, and a boom on one pin against Lagrange's equations."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms, lagrange, segments
from oracle.clearance import rigid
from oracle.clearance.drop import PUBLISHED, rebound, restitution
from reference.contact_law import HYSTERESIS, Contact, stiffness
from reference.worn_pin import geometry
from reference.worn_pin.motion import freed

STEEL = stiffness(0.030, 1e-4, 2.06e11, 0.3)


@pytest.mark.parametrize("law, e, expected", PUBLISHED)
def test_published(law, e, expected):
    hysteresis = HYSTERESIS[law](e)
    assert restitution(hysteresis) == pytest.approx(expected, abs=6e-4)
    assert rebound(Contact(STEEL, hysteresis, 0.0), 20.0, 0.1) == pytest.approx(expected, abs=6e-4)


@pytest.mark.parametrize("law", HYSTERESIS)
@pytest.mark.parametrize("e", [0.95, 0.6, 0.3])
@pytest.mark.parametrize("exponent, mass, speed", [(1.5, 20.0, 0.1), (1.0, 0.5, 3.0), (2.2, 300.0, 0.02)])
def test_integration_meets_the_closed_form(law, e, exponent, mass, speed):
    hysteresis = HYSTERESIS[law](e)
    contact = Contact(STEEL, hysteresis, 0.0, exponent)
    assert rebound(contact, mass, speed) == pytest.approx(restitution(hysteresis), abs=1e-7)


POSTURES = ["horizontal", "arch", "high", "low"]
RADII = (0.030, 0.025, 0.025, 0.020)


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


@pytest.mark.parametrize("posture", POSTURES)
@pytest.mark.parametrize("index", range(4))
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


HEADINGS = np.array([0.5, -0.3])


# the six-bar has the same contact as the slider-crank; its flights against the model are in
# test_clearance_motion
@pytest.mark.parametrize("count", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_stiff_pin_without_play_moves_as_lagrange_has_it(count):
    """Linear contact of 2e10 N/m, no clearance: what differs from an ideal pin falls with its compliance."""
    index, headings = count - 1, HEADINGS[:count]
    document = rigid.document(count, index)
    lengths = np.array([geometry.cylinder_length(document, headings, i) for i in range(count)])
    times, own = np.linspace(0.0, 0.1, 11), rigid.move(lengths[index], 0.01, 0.08)
    chosen = np.arange(count) == index

    def drives(time):
        length, rate, bend = own(time)
        return np.where(chosen, length, lengths), np.where(chosen, rate, 0.0), np.where(chosen, bend, 0.0)

    rows = lagrange.Lagrange(booms.scene_of(document), drives).solve(times, np.diff(headings, prepend=0.0), 1e-9)
    differences = []
    for k in (1e10, 2e10):
        boom = freed(document, headings, index, Contact(k, 0.0, 0.0, exponent=1.0))
        rest = boom.rest(lengths[index], headings[index])
        found = boom.follow(own_pair(own), rest, times, [0.08])
        differences.append(found.tip - rows[:, 2 * count : 2 * count + 2])
    assert np.abs(differences[1]).max() < 1e-3 * np.ptp(rows[:, 2 * count + 1])
    assert np.abs(2.0 * differences[1] - differences[0]).max() < 0.02 * np.abs(differences[0]).max()


@pytest.mark.parametrize("law, loses", [("hertz", False), ("lankarani-nikravesh", True), ("flores", True)])
def test_energy(law, loses):
    """Thrown up out of rest, undamped oil, sharp contact: Hertz keeps the energy, the others never gain any."""
    document = rigid.document(1, 0)
    del document["joints"][0]["cylinder"]["d"]
    boom = freed(document, HEADINGS[:1], 0, Contact(STEEL, HYSTERESIS[law](0.8), 1e-4))
    drive = geometry.cylinder_length(document, HEADINGS[:1], 0)
    found = boom.follow(lambda time: (drive, 0.0), boom.rest(drive, 0.5), np.linspace(0.0, 0.06, 2001), rate=0.3)
    distance = np.hypot(*found.offset.T)
    depth, n = np.maximum(distance - boom.contact.clearance, 0.0), boom.contact.exponent
    total = found.energy + boom.contact.stiffness * depth ** (n + 1.0) / (n + 1.0)
    moving = 0.5 * boom.part.at(0.5).inertia * 0.3**2
    assert np.count_nonzero(np.diff(depth > 0.0)) >= 2, "it leaves the bush, and hits it again"
    if loses:
        assert np.diff(total).max() < 1e-5 * moving
        assert total[0] - total[-1] > 1e-3 * moving
    else:
        assert np.ptp(total) < 1e-4 * moving


def own_pair(move):
    """Length and rate alone."""
    return lambda time: move(time)[:2]
