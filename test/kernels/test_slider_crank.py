"""The oracle's slider-crank with the model's own law of a pin: its touches, and their limit as the smoothing vanishes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kernels.journal import Journal, row
from oracle.clearance.slider_crank import demonstration

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
