"""Errors of a simulated motion, estimated from the same motion run again, otherwise resolved (Richardson's extrapolation).

A finer step tells what stepping adds; every second row of the drive what the curve between the rows adds. (Hairer, Norsett
and Wanner, Solving Ordinary Differential Equations I, 1993, section II.4.) The step is halved, but with clearance divided by
eight: a journal swings in its bush at some hundred Hz to some kHz, which half a step of 1 ms knows as little of as a whole one.
"""

from __future__ import annotations

import math

import numpy as np

from ..chain.status import OK
from ..records import Array
from .course import Course, Run
from .doubt import COARSE, SHORTEST, EstimatedError
from .rows import Rows

ACCELERATION, FORCE = 0.05, 0.02  # bounds of the error of acceleration and force, as shares of the largest
LEAST_ACCELERATION = 0.02  # m/s^2 that an error is measured against at least
LEAST_FORCE = 0.01  # likewise, of the largest force of all cylinders
BY_STEPS = 2.0  # error over the change that a finer step makes; by halves 4/3 for smooth motions, 2 for impacts and kinks
BY_ROWS = 1.5  # error over the change that every second row makes: 1/3 for smooth drives, 1 and more at kinks


def step_errors(course: Course, own: Run, dt: float) -> tuple[EstimatedError, ...]:
    """What steps of at most `dt` (s) added to the motion `own`; `differences` tells of what."""
    rows, finer = np.arange(len(course.times)), 8 if course.plan.pins else 2
    return _compared(course.times, own.rows, course.stepped(rows, dt, finer), BY_STEPS)


def row_errors(course: Course, own: Run) -> tuple[EstimatedError, ...]:
    """What may lie between the rows of the motion `own`; nothing for less than three rows.

    Rows are left out in both ways, the odd ones and the even ones, because a kink shows in one of them only.
    """
    last = len(course.times) - 1
    if last < 2:
        return ()
    found: list[tuple[EstimatedError, ...]] = []
    for first in (0, 1):
        rows = np.unique(np.concatenate([[0], np.arange(first, last, 2), [last]]))
        if len(rows) <= last:
            found.append(_compared(course.times[rows], own.rows.at(rows), course.stepped(rows, own.longest), BY_ROWS))
    return tuple(max(pair, key=lambda deviation: deviation.share) for pair in zip(*found, strict=True))


def _compared(times: Array, found: Rows, other: Run, factor: float) -> tuple[EstimatedError, ...]:
    """Errors of `found`; without bound where the other run failed."""
    if other.status == OK:
        return differences(times, found, other.rows, factor)
    return tuple(
        EstimatedError(what, math.inf, of, bound, float(times[other.row]))
        for what, of, bound in (TIP, TIP_ACCELERATION, ("the cylinders' forces", "their largest", FORCE))
    )


TIP = ("the tip", "its path", COARSE)
TIP_ACCELERATION = ("the tip's acceleration", "its largest", ACCELERATION)


def differences(times: Array, found: Rows, other: Rows, factor: float) -> tuple[EstimatedError, ...]:
    """Errors of the tip's place, its acceleration and the worst cylinder's force: `factor` times what `other` differs by.

    Parameters
    ----------
    times : ndarray, shape (m,)
        Of the rows, which are the same instants in both.
    """
    (tip, acceleration), (place, rate) = ((rows.tip[:, 0, :2], rows.tip[:, 2, :2]) for rows in (found, other))
    path = max(float(_lengths(tip - tip[0]).max()), SHORTEST)
    largest = max(float(_lengths(acceleration).max()), LEAST_ACCELERATION)
    sizes = np.abs(found.cylinder_forces).max(axis=0)
    sizes = np.maximum(sizes, max(LEAST_FORCE * sizes.max(), 1.0))
    forces = np.abs(other.cylinder_forces - found.cylinder_forces) / sizes
    worst = int(np.argmax(forces.max(axis=0)))
    cylinder = (f"the force of cylinder {worst + 1}", "its largest", FORCE)
    return tuple(
        EstimatedError(what, factor * float(errors.max()), of, bound, float(times[int(np.argmax(errors))]))
        for (what, of, bound), errors in (
            (TIP, _lengths(place - tip) / path),
            (TIP_ACCELERATION, _lengths(rate - acceleration) / largest),
            (cylinder, forces[:, worst]),
        )
    )


def _lengths(vectors: Array) -> Array:
    return np.asarray(np.hypot(vectors[:, 0], vectors[:, 1]))
