"""Cantilever of Euler and Bernoulli: frequencies from cos(b) cosh(b) = -1, end deflection F L^3/(3 EI).

Roots b: R. D. Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1.
"""

from __future__ import annotations

import numpy as np
import pytest
from published import scenes

from boom_twin import statics

ROOTS = np.array([1.87510407, 4.69409113, 7.85475744, 10.99554073])
LENGTH, BENDING, MASS = 3.0, 4.12e6, 40.0
WEAK = 1e-6  # m/s^2, gravity that bends next to nothing


def cantilever(mass=MASS, **extra):
    """Clamped by a rigid cylinder that stands at a right angle to its lever of 1 m; next to no strain along it."""
    section = scenes.beam(LENGTH, 1e4 * BENDING, BENDING, mass) | {"rod_pin": (0.0, 1.0)}
    joint = scenes.crank({"closed_length": 1.5, "max_stroke": 1.0})
    base = {"pivot": (0.0, 0.0), "cylinder_pin": (-2.0, 1.0)}
    return scenes.scene([section], [joint], postures={"level": (0.0,)}, **{"base": base, "gravity": (0.0, -WEAK)} | extra)


def frequency_errors(modes):
    found = statics(cantilever(modes=modes), posture="level", modes=4).frequencies
    return found / ((ROOTS / LENGTH) ** 2 * np.sqrt(BENDING / MASS) / (2.0 * np.pi)) - 1.0


def test_frequencies_of_the_default_modes():
    """Three shapes in each of the parts that a single beam is cut into; measured 1e-9, 6.6e-7, 1.2e-5, 8.6e-5."""
    assert np.all(np.abs(frequency_errors(3)) < [1e-8, 1e-6, 2e-5, 1.5e-4])


def test_frequencies_fall_to_the_printed_digits():
    """Ten and more times closer with every further shape, until the nine digits of the roots end it."""
    errors = np.array([frequency_errors(modes) for modes in (2, 3, 4, 5, 6)])
    assert np.all(errors > -5e-9) and np.all(np.diff(errors, axis=0) < 5e-9)
    assert np.abs(errors[-1]).max() < 1e-8
    assert np.all(errors[1:, 3] < errors[:-1, 3] / 4.0)


def test_end_deflection():
    """A load F at the end of a beam of next to no mass."""
    load = 50.0 * WEAK
    found = statics(cantilever(mass=1e-9, tip={"payload": 50.0}), posture="level", modes=0)
    assert found.tip_rigid[1] - found.tip[1] == pytest.approx(load * LENGTH**3 / (3.0 * BENDING), rel=1e-9)
    assert found.cylinder_forces[0] == pytest.approx(load * LENGTH, rel=1e-9)
