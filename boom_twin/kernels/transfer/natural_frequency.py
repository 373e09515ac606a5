"""Natural frequencies by counting negative pivots, and the boom's response to the inertia of a motion: loops of sweeps.

What `boom_twin.analysis.modal` says of them; a start from rest needs about two hundred counts.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import inner, kernel
from ..tables import OK, Motion
from .clearance_pins import load_pins
from .forward_kinematics import place
from .riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out

NOT_COUNTED = -1
RENEW = np.bool_(True)
TRIES = 20  # frequencies, each a little beside the last, where one meets a pivot that is zero
BALANCED = 6  # times that rows of a matrix are brought to one order of magnitude
ROTATED = 50  # times at the most that all pairs of rows are turned
TINY = 1e-32  # sum of squares beside the diagonal of a balanced matrix, below which its eigenvalues are there


@kernel
def count_below(t, state, work, position, drive, still, omega, scratch):
    """Frequencies below `omega` (rad/s), plus forces among the unknowns, of a boom that was placed.

    position, drive : (histories,), (n,)
        Of its equilibrium, m.
    still : (histories,)
        Zeros.
    scratch : (inner + 1, inner)
        One row more than a joint's block has.

    Returns
    -------
    status, count, omega : int, int, float
        At the frequency that was counted for; a count of `NOT_COUNTED` if the stiffness is not finite.
    """
    status = OK
    for _ in range(TRIES):
        motion = Motion(-omega * omega, 0.0, position, still, RENEW)
        status, count = condense(t, state, work, motion, drive, still)
        if status == OK:
            joints = negative_eigenvalues(work.condensed.blocks, scratch)
            ends = negative_eigenvalues(work.condensed.ends, scratch)
            if joints == NOT_COUNTED or ends == NOT_COUNTED:
                return status, NOT_COUNTED, omega
            return status, count + joints + ends, omega
        omega = omega * (1.0 + 1e-12) + 1e-12
    return status, NOT_COUNTED, omega


@inner
def condense(t, state, work, motion, drive, still):
    """Sweep the whole boom in; status, and negative pivots of beams."""
    clear_cut(work, FREE)
    load_pins(t, state, work, motion)
    status, negative, _ = sweep_in(t, state, work, motion, drive, still, ROOT, t.operations.shape[0], FREE, work.condensed)
    return status, negative


@kernel
def bisect_frequency(t, state, work, position, drive, still, base, number, low, width, scratch):
    """The frequency (rad/s) at which `count_below`, less `base`, rises from at most `number` to more.

    Returns
    -------
    status, count, omega : int, int, float
        As `count_below`; of the middle of the last bracket, which is `width` of its upper end wide.
    """
    place(t, state, work)
    high, found = max(2.0 * low, 1.0), False
    while not found:
        status, count, at = count_below(t, state, work, position, drive, still, high, scratch)
        if count == NOT_COUNTED:
            return status, count, at
        found = count - base > number
        if not found:
            low, high = high, 2.0 * high
    while high - low > width * high:
        middle = 0.5 * (low + high)
        status, count, at = count_below(t, state, work, position, drive, still, middle, scratch)
        if count == NOT_COUNTED:
            return status, count, at
        if count - base > number:
            high = middle
        else:
            low = middle
    return OK, number, 0.5 * (low + high)


@inner
def negative_eigenvalues(blocks, scratch):
    """Of small symmetric matrices (k, m, m) whose rows differ by many orders of magnitude: balanced first, signs stay.

    `NOT_COUNTED` if one is not finite.
    """
    count, m = 0, blocks.shape[1]
    for k in range(blocks.shape[0]):
        for i in range(m):
            for j in range(m):
                scratch[i, j] = blocks[k, i, j]
        for _ in range(BALANCED):
            balance(scratch, m)
        for i in range(m):
            for j in range(m):
                if not math.isfinite(scratch[i, j]):
                    return NOT_COUNTED
        rotate_to_diagonal(scratch, m)
        for i in range(m):
            if scratch[i, i] < 0.0:
                count += 1
    return count


@inner
def balance(a, m):
    """Divide rows and columns by the roots of the largest magnitudes in the rows; the diagonal of `a` has them after."""
    for i in range(m):
        largest = 0.0
        for j in range(m):
            largest = max(largest, abs(a[i, j]))
        a[m, i] = math.sqrt(largest) if largest > 0.0 else 1.0
    for i in range(m):
        for j in range(m):
            a[i, j] /= a[m, i] * a[m, j]


@inner
def rotate_to_diagonal(a, m):
    """Jacobi's rotations, pair by pair."""
    for _ in range(ROTATED):
        beside = 0.0
        for i in range(m):
            for j in range(i):
                beside += a[i, j] * a[i, j]
        if not beside > TINY:
            return
        for i in range(m):
            for j in range(i):
                rotate(a, m, i, j)


@inner
def rotate(a, m, i, j):
    """Make the entry (i, j) of a symmetric matrix zero."""
    if a[i, j] == 0.0:
        return
    half = (a[j, j] - a[i, i]) / (2.0 * a[i, j])
    tangent = math.copysign(1.0, half) / (abs(half) + math.sqrt(1.0 + half * half))
    c = 1.0 / math.sqrt(1.0 + tangent * tangent)
    s = tangent * c
    for k in range(m):
        one, other = a[k, i], a[k, j]
        a[k, i], a[k, j] = c * one - s * other, s * one + c * other
    for k in range(m):
        one, other = a[i, k], a[j, k]
        a[i, k], a[j, k] = c * one - s * other, s * one + c * other


@kernel
def inertia_response(t, state, work, position, drive, still, omega, load, size, hat, found):
    """Write increments `found` (unknowns,) of which (K - omega^2 M) makes M `load` (histories,), up to a factor.

    They are the difference of those under loads of `size` and -`size`. `hat` (histories,) is scratch.
    """
    place(t, state, work)
    for sign in (1.0, -1.0):
        for i in range(hat.shape[0]):
            hat[i] = position[i] + (sign * size) * load[i]
        condense(t, state, work, Motion(-omega * omega, 0.0, hat, still, RENEW), drive, still)
        sweep_out(t, state, work, work.condensed, ROOT, t.operations.shape[0], FREE)
        for i in range(found.shape[0]):
            found[i] = work.dz[i] if sign > 0.0 else found[i] - work.dz[i]


@kernel
def position_change(t, state, work, z, increments, size, found):
    """Write the derivative `found` (histories,) of all positions along `increments`, by differences of `size`, about `z`."""
    for sign in (1.0, -1.0):
        for i in range(z.shape[0]):
            state.z[i] = z[i] + (sign * size) * increments[i]
        place(t, state, work)
        for i in range(found.shape[0]):
            found[i] = work.position[i] if sign > 0.0 else (found[i] - work.position[i]) / (2.0 * size)
    for i in range(z.shape[0]):
        state.z[i] = z[i]
    place(t, state, work)
