"""Cosine and sine of the kernels against NumPy's in long double."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boom_twin.kernels.jit import kernel
from boom_twin.kernels.plane_algebra import FAR, QUARTER, cosine_and_sine, cosines

LONGEST = 2.3e-16  # of a result up to 1: one unit in its last place


@kernel
def turns(angles, found):
    for i in range(angles.shape[0]):
        found[0, i], found[1, i] = cosine_and_sine(angles[i])


@kernel
def small_turns(angles, found):
    cosines(angles, angles.shape[0], found)


def exact(angles):
    wide = angles.astype(np.longdouble)
    return np.array([np.cos(wide), np.sin(wide)])


@pytest.mark.parametrize("reach", [1e-9, QUARTER, math.pi, 100.0, FAR])
def test_cosine_and_sine_are_right_to_their_last_place(reach):
    angles = np.concatenate([np.random.default_rng(0).uniform(-reach, reach, 5000), [0.0, reach, -reach]])
    found = np.empty((2, len(angles)))
    turns(angles, found)
    assert np.abs(found - exact(angles)).max() < LONGEST


def test_cosine_and_sine_of_what_is_far_or_no_number():
    angles, found = np.array([3.0 * FAR, -1e12, math.nan, math.inf]), np.empty((2, 4))
    turns(angles, found)
    assert np.array_equal(found[:, :2], [np.cos(angles[:2]), np.sin(angles[:2])])
    assert np.isnan(found[:, 2:]).all()


@pytest.mark.parametrize("largest", [0.1, 0.7, 0.9, 3.0])
def test_cosines_of_a_part_small_and_large(largest):
    angles, found = largest * np.array([0.0, 0.3, -1.0, 0.8, 1.0]), np.empty((2, 5))
    small_turns(angles, found)
    assert np.abs(found - exact(angles)).max() < LONGEST
    small_turns(np.append(angles[:4], math.nan), found)
    assert np.isnan(found[:, 4]).all() and np.isfinite(found[:, :4]).all()
