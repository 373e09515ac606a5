"""The oracle's slider-crank with the model's own law of a pin: its touches, and their limit as the smoothing vanishes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np
import pytest
from kernels.journal import Journal, row
from oracle import booms
from oracle.clearance.scenes import RODS, with_pins
from oracle.clearance.slider_crank import demonstration, phases

from boom_twin.compiler.compile import compile_scene
from boom_twin.kernels.elements import pin_contact as contact

LAWS = [("lankarani-nikravesh", 0.9), ("flores", 0.5), ("hertz", 1.0), ("hunt-crossley", 0.7)]
SOFTNESS = 2.0 * (1.0 - 0.3**2) / 207e9  # the demonstration's steel, 1/Pa


def both(law, restitution):
    """The demonstration with the oracle's contact, and with the model's."""
    theirs = demonstration(law, restitution)
    gap = theirs.contact.clearance
    own = Journal(row(law, restitution, gap, 0.010 - gap, SOFTNESS))
    assert own.row.stiffness == pytest.approx(theirs.contact.stiffness)
    return theirs, replace(theirs, contact=own)


def touches(law, restitution):
    """Crank angle (rad), speed (m/s) and depth (m) of the first touches of both, shape (2, k, 3), measured at the rim."""
    theirs, ours = both(law, restitution)
    expected = [(theirs.speed * e.start, e.entry, e.depth) for e in theirs.run(0.15, 11).episodes[:3]]
    early = contact.NEAR  # where the model takes contact to begin
    found = [(ours.speed * (e.start + early / e.entry), e.entry, e.depth - early) for e in ours.run(0.15, 11).episodes[:3]]
    return np.array([expected, found])


@pytest.mark.parametrize("law, restitution", LAWS)
def test_first_touches_are_the_oracles(law, restitution, monkeypatch):
    """Speeds of approach differ most, for they are taken before the rim; all differences fall with the smoothing."""
    errors = []
    for share in (1.0, 0.1):
        monkeypatch.setattr(contact, "SMOOTH", share * 1e-6)
        monkeypatch.setattr(contact, "NEAR", share * 4e-6)
        expected, found = touches(law, restitution)
        assert len(expected) >= 2
        errors.append(np.abs(found / expected - 1.0).max(axis=0))
    assert np.all(errors[0] < [5e-3, 0.1, 0.015])
    assert np.all(errors[1] < 0.15 * errors[0])


@dataclass(frozen=True)
class Ours:
    """What the mechanism asks of a contact, answered by `bearing`."""

    row: Any

    def gap(self, offset):
        return abs(offset) - self.row.gap

    def force(self, offset, rate, entry):
        memory = np.zeros(contact.COLUMNS)
        memory[contact.CLOSED], memory[contact.APPROACH] = entry is not None, entry or 0.0
        velocity = (rate.real, rate.imag)
        journal = contact.Journal(offset.real, offset.imag, *velocity, *velocity, 0.0, 1.0, 0.0)
        found = contact.pin_force(self.row, memory, journal, 0.0)
        return -complex(found.x, found.y)


def compiled():
    """The oracle's, with its sharp contact, and with the package's of the same stiffness."""
    theirs = demonstration()
    row = compile_scene(with_pins(booms.document(), RODS[:1], theirs.contact.clearance)).tables.clearances[0]
    row.stiffness = theirs.contact.stiffness
    smooth = replace(theirs, contact=replace(theirs.contact, smoothing=contact.SMOOTH))
    return smooth, replace(theirs, contact=Ours(row))


def test_first_touches_are_those_of_the_oracles_smoothed_contact():
    """Later ones hang on the first: the motion is chaotic."""
    theirs, ours = ([(e.start * m.speed, e.entry) for e in m.run(0.06, 11).episodes[:3]] for m in compiled())
    assert len(ours) >= 2
    assert np.array(ours[:2]) == pytest.approx(np.array(theirs[:2]), rel=1e-3)


def test_a_turn_shows_impacts_following_and_free_flight():
    ours = compiled()[1]
    period = 2.0 * pi / ours.speed
    found = phases(ours.run(2.0, 11, 1e-7), since=period)
    assert found["impacts"] > 3
    assert all(found[name] > 0.02 * period for name in ("impact", "following", "free flight"))
