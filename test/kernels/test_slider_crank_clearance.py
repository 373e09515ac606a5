"""A driven slider-crank whose wrist pin has clearance: the package's force of a pin in the oracle's mechanism."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np
import pytest
from oracle import booms
from oracle.clearance.scenes import RODS, with_pins
from oracle.clearance.slider_crank import demonstration, phases

from boom_twin.compiler.compile import compile_scene
from boom_twin.kernels.elements.pin_contact import APPROACH, CLOSED, COLUMNS, SMOOTH, Journal, bearing


@dataclass(frozen=True)
class Ours:
    """What the mechanism asks of a contact, answered by `bearing`."""

    row: Any

    def gap(self, offset):
        return abs(offset) - self.row.gap

    def force(self, offset, rate, entry):
        memory = np.zeros(COLUMNS)
        memory[CLOSED], memory[APPROACH] = entry is not None, entry or 0.0
        velocity = (rate.real, rate.imag)
        found = bearing(self.row, memory, Journal(offset.real, offset.imag, *velocity, *velocity, 0.0, 1.0, 0.0), 0.0)
        return -complex(found.x, found.y)


def mechanisms():
    """The oracle's, with its sharp contact, and with the package's of the same stiffness."""
    theirs = demonstration()
    row = compile_scene(with_pins(booms.document(), RODS[:1], theirs.contact.clearance)).tables.clearances[0]
    row.stiffness = theirs.contact.stiffness
    smooth = replace(theirs, contact=replace(theirs.contact, smoothing=SMOOTH))
    return smooth, replace(theirs, contact=Ours(row))


def test_first_touches_are_the_oracles():
    """Later ones hang on the first: the motion is chaotic."""
    theirs, ours = ([(e.start * m.speed, e.entry) for e in m.run(0.06, 11).episodes[:3]] for m in mechanisms())
    assert len(ours) >= 2
    assert np.array(ours[:2]) == pytest.approx(np.array(theirs[:2]), rel=1e-3)


def test_a_turn_shows_impacts_following_and_free_flight():
    ours = mechanisms()[1]
    period = 2.0 * pi / ours.speed
    found = phases(ours.run(2.0, 11, 1e-7), since=period)
    assert found["impacts"] > 3
    assert all(found[name] > 0.02 * period for name in ("impact", "following", "free flight"))
