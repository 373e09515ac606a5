"""Motion of a boom part on a cylinder with play: limits, energy."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms, lagrange
from oracle.clearance import rigid
from reference.worn_pin import geometry
from reference.worn_pin.motion import freed

from boom_twin.validation.contact_law import HYSTERESIS, Contact, stiffness

STEEL = stiffness(0.030, 1e-4, 2.06e11, 0.3)
HEADINGS = np.array([0.5, -0.3])


def pin(law="lankarani-nikravesh", restitution=0.9, smoothing=0.0):
    return Contact(STEEL, HYSTERESIS[law](restitution), 1e-4, smoothing=smoothing)


# the six-bar has the same contact as the slider-crank; its geometry is in test_geometry, its flights against the model in
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
    boom = freed(document, HEADINGS[:1], 0, pin(law, 0.8))
    drive = geometry.cylinder_length(document, HEADINGS[:1], 0)
    found = boom.follow(lambda time: (drive, 0.0), boom.rest(drive, 0.5), np.linspace(0.0, 0.06, 2001), rate=0.3)
    distance = np.hypot(*found.offset.T)
    depth, n = np.maximum(distance - boom.contact.clearance, 0.0), boom.contact.exponent
    total = found.energy + boom.contact.stiffness * depth ** (n + 1.0) / (n + 1.0)
    moving = 0.5 * boom.part.at(0.5).inertia * 0.3**2
    assert len(found.episodes) >= 2
    if loses:
        assert np.diff(total).max() < 1e-5 * moving
        assert total[0] - total[-1] > 1e-3 * moving
    else:
        assert np.ptp(total) < 1e-4 * moving


def own_pair(move):
    """Length and rate alone."""
    return lambda time: move(time)[:2]
