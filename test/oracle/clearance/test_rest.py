"""Equilibria with play: against the finite segments, and against the equations of motion."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms, segments
from oracle.clearance import rigid
from reference.worn_pin import geometry
from reference.worn_pin.motion import freed

from boom_twin.validation.contact_law import HYSTERESIS, Contact, stiffness

RADII = (0.030, 0.025, 0.025, 0.020)
POSTURES = ["horizontal", "arch", "high", "low"]


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
