"""A strip that bends by radians while it falls: 0.5 m, 10 mm by 2 mm, E 100 MPa, 1000 kg/m^3, let go from the horizontal.

The places of its end to 1e-5 m were found with 32 cable elements of the absolute nodal coordinate formulation (J. Gerstmayr,
H. Irschik: On the correct representation of bending and axial deformation in the absolute nodal coordinate formulation, J. of
Sound and Vibration 318, 2008) in Exudyn 1.13, steps of 0.125 ms.
"""

from __future__ import annotations

import numpy as np
import pytest
from published import motion, scenes

LENGTH, WIDTH, HEIGHT, YOUNG, DENSITY = 0.5, 0.01, 0.002, 1e8, 1000.0
TIMES, DURATION, ROWS = (0.1, 0.3, 0.5), 0.5, (1, 3, 5)
ENDS = np.array([[0.49259, -0.04594], [0.13219, -0.47966], [-0.42065, -0.26205]])  # m
HALF_DIGIT = 5e-6  # m


def strip(modes):
    """The strip as one section; each of the parts it is cut into has `modes` bending shapes."""
    area, second = WIDTH * HEIGHT, WIDTH * HEIGHT**3 / 12.0
    section = scenes.beam(LENGTH, YOUNG * area, YOUNG * second, DENSITY * area, DENSITY * second)
    return scenes.scene([section], [scenes.crank(scenes.FREE)], modes=modes)


def ends(modes, step, halvings):
    """End of the strip at the times, for `step` and its halves."""
    start = motion.released(strip(modes), [0.0])
    return motion.halved(start, step, DURATION, 5, halvings=halvings)[:, ROWS, 0, :2]


def test_places_of_the_end():
    """To half a digit of the reference, and the error of the steps as their halving shows it."""
    found = ends(6, 2.5e-4, 2)
    left = np.abs(found[-1] - found[-2]).max() / 3.0
    assert left < 1e-6
    assert np.abs(motion.extrapolated(found) - ENDS).max() < HALF_DIGIT + left


def test_more_shapes_come_closer():
    """Measured against eight shapes in each part: 5.7e-4, 9.9e-5, 2.1e-6, 1.3e-7 m."""
    best = ends(8, 1.25e-4, 0)
    errors = np.array([np.abs(ends(modes, 1.25e-4, 0) - best).max() for modes in (1, 2, 4, 6)])
    assert np.all(errors < [1e-3, 2e-4, 5e-6, 5e-7]) and np.all(errors[1:] < errors[:-1] / 3.0)


def test_second_order_once_the_steps_resolve_the_shapes():
    """One shape in each part, whole motion. More shapes ring faster, undamped, and need smaller steps for it."""
    found = motion.halved(motion.released(strip(1), [0.0]), 5e-4, DURATION, 50)[:, :, 0, :2]
    changes = np.linalg.norm(np.diff(found, axis=0), axis=(1, 2))
    assert motion.orders(changes) == pytest.approx(2.0, abs=0.05)
