"""Row of results: what the kernels write of one instant of a boom, and where each quantity stands in it.

A row is flat, so that many of them are one array; nobody but this module knows its order.
"""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..types import Array
from .jit import inner

TIP = 9  # position, velocity, acceleration of the tip's x, y, orientation
PIN = 4  # x and y of the journal's offset, force, contact


class Results(NamedTuple):
    """One instant of a boom with n joints and k pins with clearance, or several with a leading axis."""

    joints: Array  # (.., n), rad
    cylinder_forces: Array  # (.., n), N
    tip: Array  # (.., 3, 3), position, velocity, acceleration; of x, y (m) and orientation (rad)
    pins: Array  # (.., k, 4), offset x, y of the journal in its bush (m), contact force (N), 1 where they touch
    lengths: Array  # (.., n), of the cylinders, pin to pin less `closed_length`, m

    def at(self, rows: NDArray[np.int64]) -> Results:
        """Some of the instants, by their numbers."""
        return Results(*(each[rows] for each in self))


class Estimates(NamedTuple):
    """Estimates added to a row: strokes (n,) in m, their variances (n,) in m^2, tip of the rigid boom (2,) in m."""

    strokes: Array
    variances: Array
    rigid_tip: Array


@inner
def row_width(joints, pins):
    """Numbers of one instant."""
    return 3 * joints + TIP + PIN * pins


@inner
def results_in(row, joints, pins):
    """The `Results` in a row, shape (row_width or more,), as views of it."""
    tip = 2 * joints
    journals = tip + TIP
    lengths = journals + PIN * pins
    return Results(
        row[:joints],
        row[joints:tip],
        row[tip:journals].reshape((3, 3)),
        row[journals:lengths].reshape((pins, PIN)),
        row[lengths : lengths + joints],
    )


@inner
def estimates_in(row, joints, pins):
    """The `Estimates` behind the results in a row, as views of it."""
    first = row_width(joints, pins)
    return Estimates(row[first : first + joints], row[first + joints : first + 2 * joints], row[first + 2 * joints :])


def prediction_width(joints: int, pins: int) -> int:
    """Numbers of one instant with the estimates behind it."""
    return int(row_width(joints, pins)) + 2 * joints + 2


class Places(NamedTuple):
    """Places of all quantities in a row with estimates."""

    joints: slice
    cylinder_forces: slice
    tip: slice
    pins: slice
    lengths: slice
    strokes: slice
    variances: slice
    rigid_tip: slice


def places_in(joints: int, pins: int) -> Places:
    """The `Places` of a boom."""
    sizes = (joints, joints, TIP, PIN * pins, joints, joints, joints, 2)
    return Places(*(slice(end - size, end) for size, end in zip(sizes, accumulate(sizes), strict=True)))


def results_of(rows: Array, joints: int, pins: int) -> Results:
    """The `Results` of rows, shape (.., row_width), with the same leading axes."""
    at, lead = places_in(joints, pins), rows.shape[:-1]
    tip, journals = rows[..., at.tip].reshape(*lead, 3, 3), rows[..., at.pins].reshape(*lead, pins, PIN)
    return Results(rows[..., at.joints], rows[..., at.cylinder_forces], tip, journals, rows[..., at.lengths])
