"""One time step of the boom, and many in one call."""

from __future__ import annotations

import numpy as np

from ..physics.integrators import A, V, X, finish_step, prepare, start_step
from ..physics.jit import inner, kernel
from .newton import OK, newton
from .program import JOINT_A, JOINT_B, Motion

LONGEST_INCREMENT = 0.5  # rad in one pass of a time step; more means that the step has lost its way


@inner
def predict(t, state, reach):
    """First guess of the unknowns `reach` s ahead: x + h v + h^2 a/2 for coordinates, forces as they were."""
    x, v, a = state.history[X], state.history[V], state.history[A]
    for i in range(state.z.shape[0]):
        if t.moving[i] > 0.0:
            state.z[i] = x[i] + reach * (v[i] + 0.5 * reach * a[i])


@kernel
def advance(t, state, work, scheme, drive, drive_rate, tolerance, passes, product):
    """Step the boom by `scheme` to drive lengths (m) and rates (m/s), both shape (n,), at the instant it solves for.

    Returns status, passes, last increment (rad). On failure the histories stay as they were.
    """
    start_step(scheme, state.history, work.hat, work.offset)
    predict(t, state, scheme.reach)
    motion = Motion(scheme.gain, scheme.rate, work.hat, work.offset)
    status, count, size = newton(t, state, work, motion, drive, drive_rate, tolerance, passes, LONGEST_INCREMENT, product)
    if status == OK:
        finish_step(scheme, work.position, work.hat, work.offset, state.history)
    return status, count, size


@kernel
def rest(state, work):
    """Let the boom be at rest where it is: histories hold the present positions, no velocity, no acceleration."""
    for k in range(state.history.shape[0]):
        for i in range(state.history.shape[1]):
            state.history[k, i] = 0.0
    for k in range(0, state.history.shape[0] - 2, 2):  # x now, and x of earlier steps where they are kept
        for i in range(state.history.shape[1]):
            state.history[k, i] = work.position[i]


@kernel
def observe(t, state, out):
    """Write one row of results: joint angles (n), cylinder forces (n), then x, v, a of tip x, y, theta (9)."""
    n, at = t.joints.shape[0], 0
    for k in range(t.operations.shape[0]):
        row = t.operations[k].row
        if t.operations[k].kind == JOINT_A or t.operations[k].kind == JOINT_B:
            out[at] = state.z[t.joints[row].z] - state.frames[k, 2]
            at += 1
    for i in range(n):
        out[n + i] = state.z[t.cylinders[i].z]
    for j in range(3):
        out[2 * n + j], out[2 * n + 3 + j] = state.history[X, t.tip + j], state.history[V, t.tip + j]
        out[2 * n + 6 + j] = state.history[A, t.tip + j]


@kernel
def run(t, state, work, steps, counts, drives, rates, family, parameter, tolerance, passes, product, out):
    """Follow drive lengths through many rows.

    Parameters
    ----------
    steps : ndarray, shape (rows,)
        Step (s) that leads to each row.
    counts : ndarray of int, shape (rows,)
        Number of such steps; `drives`, `rates` hold all of them one after the other.
    drives, rates : ndarray, shape (sum of counts, n)
        Drive lengths (m) and rates (m/s) at the end of every step, or where the scheme solves.
    family, parameter : int, float
        See `physics.integrators.prepare`.
    product : Product or None
        See `newton`.
    out : ndarray, shape (rows, 2 n + 9)
        See `observe`.

    Returns
    -------
    status, row, passes : int
        Status of the last step and the row it belongs to; total of Newton passes.
    """
    at, total = 0, 0
    for row in range(steps.shape[0]):
        scheme = prepare(family, parameter, steps[row], work.weights)
        for _ in range(counts[row]):
            status, count, _ = advance(t, state, work, scheme, drives[at], rates[at], tolerance, passes, product)
            total += count
            at += 1
            if status != OK:
                return status, row, total
        observe(t, state, out[row])
    return OK, steps.shape[0], total


def motion_at_rest(size: int) -> Motion:
    """No inertia, no damping: the equations are statics. Work arrays of `size` histories."""
    return Motion(0.0, 0.0, np.zeros(size), np.zeros(size))
