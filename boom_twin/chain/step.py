"""One time step of the boom, and many in one call."""

from __future__ import annotations

import math

from ..physics.integrators import A, V, X, finish_step, prepare, start_step
from ..physics.jit import inner, kernel
from .place import place
from .plain import plain_pass
from .program import JOINT_A, JOINT_B, Motion
from .status import NOT_CONVERGED, NOT_FINITE, OK
from .sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out

LONGEST_INCREMENT = 0.5  # rad in one pass of a time step; more means that the step has lost its way


@kernel
def advance(t, state, work, scheme, drive, drive_rate, tolerance, passes, longest, product):
    """Step the boom to drive lengths (m) and rates (m/s), both shape (n,), at the instant that `scheme` solves for.

    Newton passes on exact kinematics: place, sweep in, sweep out, until the increments are small. Kept in one function,
    because every kernel that calls this one costs seconds of compiling.

    Parameters
    ----------
    scheme : Scheme
        See `physics.integrators`; the scheme of rest gives static equilibrium next to the history's positions.
    tolerance : float
        Done once the largest increment (rad) is below it; convergence is quadratic, so the error left is about its square.
    passes : int
        At most so many; a single pass is the papers' linearised step and counts as converged.
    longest : float
        Increments are shortened so that none exceeds this (rad).
    product : Product or None
        None for the Riccati form; else room for the plain product of transfer matrices (see `chain.plain`).

    Returns
    -------
    status, passes, last increment (rad)
        On failure the histories stay as they were.
    """
    start_step(scheme, state.history, work.hat, work.offset)
    predict(t, state, scheme.reach)
    motion, operations, size = Motion(scheme.gain, scheme.rate, work.hat, work.offset), t.operations.shape[0], 0.0
    place(t, state, work)
    for k in range(passes):
        if product is None:
            clear_cut(work, FREE)
            status, _, _ = sweep_in(t, state, work, motion, drive, drive_rate, ROOT, operations, FREE)
            if status == OK:
                sweep_out(t, state, work, ROOT, operations, FREE)
        else:
            status = plain_pass(t, state, work, motion, drive, drive_rate, product)
        if status != OK:
            return reason(work, status), k + 1, size
        size = add_increments(t, state, work, longest)
        if not math.isfinite(size):
            return NOT_FINITE, k + 1, size
        place(t, state, work)
        if size < tolerance or passes == 1:
            finish_step(scheme, work.position, work.hat, work.offset, state.history)
            return OK, k + 1, size
    return NOT_CONVERGED, passes, size


@inner
def predict(t, state, reach):
    """First guess of the unknowns `reach` s ahead: x + h v + h^2 a/2 for coordinates, forces as they were."""
    x, v, a = state.history[X], state.history[V], state.history[A]
    for i in range(state.z.shape[0]):
        if t.moving[i] > 0.0:
            state.z[i] = x[i] + reach * (v[i] + 0.5 * reach * a[i])


@inner
def reason(work, status):
    """NOT_FINITE in place of `status` if the force at the cut where a sweep stopped is not finite."""
    for i in range(3):
        if not math.isfinite(work.p[i]):
            return NOT_FINITE
    return status


@inner
def add_increments(t, state, work, longest):
    """Add increments to the unknowns; returns the largest as an angle (rad), NaN if any of them is not finite."""
    z, dz, size = state.z, work.dz, 0.0
    for i in range(z.shape[0]):
        if not math.isfinite(dz[i]):
            return math.nan
        size = max(size, t.scale[i] * abs(dz[i]))
    share = 1.0
    if size > longest:
        share = longest / size
    for i in range(z.shape[0]):
        z[i] += share * dz[i]
    return size


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
        See `advance`.
    out : ndarray, shape (rows, 2 n + 9)
        See `observe`.

    Returns
    -------
    status, row, passes : int
        Status of the last step and the row it belongs to; total of Newton passes.
    jolt : float
        Sum over all steps of h^2 |a' - a| of the tip, m: what the error of a step is measured by, see `Simulation`.
    shake : float
        Sum over all steps of h^2 |a'| of the tip, m: half of `jolt` where the acceleration changes sign from step to step.
    """
    at, total, jolt, shake, a = 0, 0, 0.0, 0.0, state.history[A]
    for row in range(steps.shape[0]):
        if row == 0 or steps[row] != steps[row - 1]:
            scheme = prepare(family, parameter, steps[row], work.weights)
        for _ in range(counts[row]):
            ax, ay = a[t.tip], a[t.tip + 1]
            status, count, _ = advance(
                t, state, work, scheme, drives[at], rates[at], tolerance, passes, LONGEST_INCREMENT, product
            )
            total += count
            at += 1
            if status != OK:
                return status, row, total, jolt, shake
            jolt += steps[row] * steps[row] * math.hypot(a[t.tip] - ax, a[t.tip + 1] - ay)
            shake += steps[row] * steps[row] * math.hypot(a[t.tip], a[t.tip + 1])
        observe(t, state, out[row])
    return OK, steps.shape[0], total, jolt, shake
