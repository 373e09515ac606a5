"""Small vibrations about a state at rest by transfer matrices: the Riccati sweeps of a time step, with weights of their own.

A time step sets a = A (x - x_hat) and v = C x + D with the integrator's weights A and C (`kernels.integrators`). It condenses
the tangent K + C D + A M of every element (there D is the damping matrix). Small harmonic motion x + Re(dx e^(s t)) with
s = i omega about a rest state x has a = s^2 dx and v = s dx. This is a time step with A = s^2, C = s, x_hat = x and D = -s x.
The sweeps on complex numbers with these weights condense the dynamic stiffness

    H(s) = K + s D + s^2 M

of the boom linearised about the state, and solve H(s) dx = load. K includes the geometric stiffness of weight and pin forces.
No sum over natural modes is used.

Without damping H(s) is real, and its negative pivots tell how many natural frequencies lie below omega: see
`boom_twin.analysis.modal`. A start from rest needs about two hundred counts.
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
RENEW = np.bool_(True)  # typed: numba compiles once more for a named tuple that holds a literal
TIP_FORCE = 2  # number of leading load entries for the tip force; the drives follow


@kernel
def harmonic_response(t, state, work, drive, rates, loads, increments, tip):
    """Write complex amplitudes of all unknowns and of the tip under harmonic loads about a state at rest, with ideal pins.

    The response is linear in the load; a large load reduces rounding by the static forces.

    `state` is in equilibrium and placed in `work`, which `kernels.tables.complex_scratch` made. `drive` (n,) are its drive
    lengths, m; `rates` (k,) are s = i omega, 1/s; `loads` (k, 2 + n) the force at the tip in x and y (N), then the drive of
    every cylinder (m). `increments` (k, unknowns) and `tip` (k, 3), x, y (m) and orientation (rad), are written.

    Return status and row: OK, or SINGULAR at `rates[row]`.
    """
    operations = t.operations.shape[0]
    for k in range(rates.shape[0]):
        rate = rates[k]
        for i in range(work.position.shape[0]):
            work.offset[i] = -rate * work.position[i]
        for share in range(2):  # tangents without the load, because these include forces; then forces with it
            put_load(work, drive, rate, loads[k], share)
            motion = Motion(rate * rate, rate, work.position, work.offset, np.bool_(share == 0))
            status, _, _ = sweep_in(t, state, work, motion, work.drive, work.drive_rate, ROOT, operations, FREE)
            if status != OK:
                return status, k
        sweep_out(t, state, work, ROOT, operations, FREE)
        for i in range(increments.shape[1]):
            increments[k, i] = work.dz[i]
        for i in range(tip.shape[1]):
            tip[k, i] = work.cut[i]
    return OK, rates.shape[0]


@inner
def put_load(work, drive, rate, load, share):
    """Set tip force and drives to `share` of a load."""
    clear_cut(work, FREE)
    work.p[0], work.p[1] = -share * load[0], -share * load[1]
    for i in range(drive.shape[0]):
        work.drive[i] = drive[i] + share * load[TIP_FORCE + i]
        work.drive_rate[i] = rate * share * load[TIP_FORCE + i]


@kernel
def count_below(t, state, work, position, drive, still, omega, scratch):
    """Count frequencies below `omega` (rad/s), plus forces among the unknowns, of a boom that was placed.

    `position` (histories,) and `drive` (n,) are of its equilibrium, m; `still` (histories,) zeros; `scratch` (inner + 1,
    inner) has one row more than a joint's block. Return status, count and the frequency that was counted for; the count is
    `NOT_COUNTED` if the stiffness is not finite.
    """
    status = OK
    for _ in range(20):  # each a little beside the last, where one meets a pivot that is zero
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
    """Sweep the whole boom in; return status, and negative pivots of beams."""
    clear_cut(work, FREE)
    load_pins(t, state, work, motion)
    status, negative, _ = sweep_in(t, state, work, motion, drive, still, ROOT, t.operations.shape[0], FREE)
    return status, negative


@kernel
def bisect_frequency(t, state, work, position, drive, still, base, number, low, width, scratch):
    """Return the frequency (rad/s), above `low`, at which `count_below`, less `base`, rises from at most `number` to more.

    Status, count and omega as of `count_below`; omega is the middle of the last bracket, which is `width` of its upper end
    wide.
    """
    place(t, state, work)
    high = max(2.0 * low, 1.0)
    status, count, at = count_below(t, state, work, position, drive, still, high, scratch)
    found = count - base > number
    while count != NOT_COUNTED and not found:
        low, high = high, 2.0 * high
        status, count, at = count_below(t, state, work, position, drive, still, high, scratch)
        found = count - base > number
    if count == NOT_COUNTED:
        return status, count, at
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
    """Return the number of negative eigenvalues of small symmetric matrices (k, m, m); `NOT_COUNTED` if one is not finite.

    Their rows differ by many orders of magnitude. They are balanced first, which keeps the signs.
    """
    count, m = 0, blocks.shape[1]
    for k in range(blocks.shape[0]):
        for i in range(m):
            for j in range(m):
                scratch[i, j] = blocks[k, i, j]
        for _ in range(6):
            balance(scratch, m)
        for i in range(m):
            for j in range(m):
                if not math.isfinite(scratch[i, j]):
                    return NOT_COUNTED
        count += negative_pivots(scratch, m)
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
def negative_pivots(a, m):
    """Negative eigenvalues of a symmetric matrix, as many as its pivots have: eliminated from the largest on; `a` is lost.

    A pivot is an entry of the diagonal, or two rows where one beside it is larger by 1/0.64: that block has one of each sign
    (Bunch and Parlett, SIAM Journal on Numerical Analysis 8, 1971).
    """
    count = 0
    while m > 0:
        largest, at, beside, row, column = 0.0, 0, 0.0, 0, 0
        for i in range(m):
            if abs(a[i, i]) > largest:
                largest, at = abs(a[i, i]), i
            for j in range(i):
                if abs(a[i, j]) > beside:
                    beside, row, column = abs(a[i, j]), i, j
        if largest == 0.0 and beside == 0.0:
            return count
        if largest >= 0.64 * beside:
            m -= 1
            exchange(a, at, m, m + 1)
            if a[m, m] < 0.0:
                count += 1
            for i in range(m):
                share = a[i, m] / a[m, m]
                for j in range(m):
                    a[i, j] -= share * a[m, j]
        else:
            m -= 2
            exchange(a, row, m + 1, m + 2)
            exchange(a, column, m, m + 2)
            count += 1
            first, both, second = a[m, m], a[m, m + 1], a[m + 1, m + 1]
            size = first * second - both * both
            for i in range(m):
                one = (a[i, m] * second - a[i, m + 1] * both) / size
                other = (a[i, m + 1] * first - a[i, m] * both) / size
                for j in range(m):
                    a[i, j] -= one * a[m, j] + other * a[m + 1, j]
    return count


@inner
def exchange(a, i, j, m):
    """Exchange rows and columns i and j of the first m."""
    for k in range(m):
        a[i, k], a[j, k] = a[j, k], a[i, k]
    for k in range(m):
        a[k, i], a[k, j] = a[k, j], a[k, i]


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
        sweep_out(t, state, work, ROOT, t.operations.shape[0], FREE)
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
