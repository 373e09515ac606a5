"""The oracle's slider-crank with the model's own law of the pin: its phases over a turn, and the first touches."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from oracle.clearance.slider_crank import demonstration, phases
from physics.journal import Journal, row

from boom_twin.physics import contact

LAWS = [("lankarani-nikravesh", 0.9), ("flores", 0.5), ("hertz", 1.0), ("hunt-crossley", 0.7)]
SOFTNESS = 2.0 * (1.0 - 0.3**2) / 207e9  # the demonstration's steel, 1/Pa


def both(law, restitution):
    """The demonstration with the oracle's contact, and with the model's."""
    theirs = demonstration(law, restitution)
    gap = theirs.contact.clearance
    own = Journal(row(law, restitution, gap, 0.010 - gap, SOFTNESS))
    assert own.row.stiffness == pytest.approx(theirs.contact.stiffness)
    return theirs, replace(theirs, contact=own)


def test_a_turn_shows_impacts_following_and_free_flight():
    _, mechanism = both("lankarani-nikravesh", 0.9)
    period = 2.0 * pi / mechanism.speed
    found = phases(mechanism.run(2.0, 11, 1e-7), since=period)
    assert found["impacts"] > 5
    assert all(found[name] > 0.02 * period for name in ("impact", "following", "free flight"))


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


def test_the_pin_stays_near_the_bush():
    _, mechanism = both("flores", 0.5)
    run = mechanism.run(1.0, 501, 1e-7)
    gaps = [mechanism.gap(time, state)[0] for time, state in zip(run.times, run.states, strict=True)]
    assert max(gaps) < 0.2 * mechanism.contact.row.gap
    assert np.isfinite(run.states).all()
