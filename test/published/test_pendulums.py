"""Pendulums let go from the horizontal: a point mass on a rigid rod, and a strip that bends by radians while it falls.

The first, with L = m = 1: problem A01 of the MBS Benchmark library of IFToMM (M. Gonzalez, D. Dopico, U. Lugris, J. Cuadrado:
A benchmarking system for MBS simulation software, Multibody System Dynamics 16, 2006). Its positions are those of the closed
form with Jacobi's functions.

The strip: 0.5 m, 10 mm by 2 mm, E 100 MPa, 1000 kg/m^3. The places of its end to 1e-5 m were found with 32 cable elements of
the absolute nodal coordinate formulation (J. Gerstmayr, H. Irschik: On the correct representation of bending and axial
deformation in the absolute nodal coordinate formulation, J. of Sound and Vibration 318, 2008) in Exudyn 1.13, steps of 1/8 ms.
"""

from __future__ import annotations

import numpy as np
import pytest
from published import motion, scenes
from scipy.special import ellipj, ellipk

GRAVITY, DURATION, STEP = 9.81, 10.0, 4e-3
AT_TEN = (-0.2750874626, -0.9614192051)  # m
PERIOD = 2.3678419476  # s


def closed_form(times):
    """Place of the mass (m), shape (m, 2): sin(phi/2) = k sn(K - w t, k), phi from the vertical, k = sin(pi/4)."""
    sine = np.sqrt(0.5) * ellipj(ellipk(0.5) - np.sqrt(GRAVITY) * times, 0.5)[0]
    phi = -2.0 * np.arcsin(sine)
    return np.stack([np.sin(phi), -np.cos(phi)], axis=-1)


@pytest.fixture(scope="module")
def results():
    """Tip at every second, for steps of 4, 2, 1 and 0.5 ms, from (-1, 0)."""
    scene = scenes.scene([scenes.rigid(1.0, 1.0, 1.0, 0.0)], [scenes.crank(scenes.FREE)])
    return motion.halved(motion.released(scene, [np.pi]), STEP, DURATION, 10)


def test_closed_form_has_the_printed_digits():
    assert closed_form(np.array([DURATION]))[0] == pytest.approx(AT_TEN, abs=1e-10)
    assert 4.0 * ellipk(0.5) / np.sqrt(GRAVITY) == pytest.approx(PERIOD, abs=1e-10)


def test_acceleration_at_the_start(results):
    assert results[0, 0, 2, :2] == pytest.approx([0.0, -GRAVITY], abs=1e-6)


def test_second_order(results):
    errors = np.linalg.norm(results[:, 1:, 0, :2] - closed_form(np.arange(1.0, 11.0)), axis=-1).max(axis=1)
    assert motion.orders(errors) == pytest.approx(2.0, abs=0.01)


def test_position_after_ten_seconds(results):
    """1.3e-4 m at 1 ms; what is left of the step's square by extrapolation is 1e-8 m."""
    at_end = results[:, -1, 0, :2]
    assert np.linalg.norm(at_end[2] - AT_TEN) == pytest.approx(1.27e-4, rel=0.02)
    assert np.linalg.norm(motion.extrapolated(at_end) - AT_TEN) < 3e-8


LENGTH, WIDTH, HEIGHT, YOUNG, DENSITY = 0.5, 0.01, 0.002, 1e8, 1000.0
FALL, ROWS = 0.5, (1, 3, 5)  # s; rows of 0.1, 0.3 and 0.5 s
ENDS = np.array([[0.49259, -0.04594], [0.13219, -0.47966], [-0.42065, -0.26205]])  # m
HALF_DIGIT = 5e-6  # m


def strip(modes):
    """The strip as one section; each of the parts it is cut into has `modes` bending shapes."""
    area, second = WIDTH * HEIGHT, WIDTH * HEIGHT**3 / 12.0
    section = scenes.beam(LENGTH, YOUNG * area, YOUNG * second, DENSITY * area, DENSITY * second)
    return scenes.scene([section], [scenes.crank(scenes.FREE)], modes=modes)


def ends(modes, step, halvings):
    """End of the strip at the times of `ENDS`, for `step` and its halves."""
    start = motion.released(strip(modes), [0.0])
    return motion.halved(start, step, FALL, 5, halvings=halvings)[:, ROWS, 0, :2]


def test_places_of_the_end_of_a_strip():
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
    found = motion.halved(motion.released(strip(1), [0.0]), 5e-4, FALL, 50)[:, :, 0, :2]
    changes = np.linalg.norm(np.diff(found, axis=0), axis=(1, 2))
    assert motion.orders(changes) == pytest.approx(2.0, abs=0.05)
