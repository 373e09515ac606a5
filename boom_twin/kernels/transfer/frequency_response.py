"""Frequency response by transfer matrices: the Riccati sweeps of a time step, with complex weights.

A time step takes accelerations and velocities as a = A (x - x_hat), v = C x + D with the integrator's weights A and C
(`kernels.integrators`), and condenses the tangent K + C D + A M of every element. Small harmonic motion x + Re(dx e^(s t)),
s = i omega, about a state at rest x has a = s^2 dx and v = s dx: the same with A = s^2, C = s, x_hat = x and D = -s x. So the
sweeps, run on complex numbers with these weights, condense the dynamic stiffness

    H(s) = K + s D + s^2 M

of the boom linearised about the state, with the geometric stiffness of weight and pin forces in K, and solve H(s) dx = load.
No part of it is a sum over natural modes.
"""

from __future__ import annotations

import numpy as np

from ..jit import inner, kernel
from ..tables import OK, Motion
from .riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out

TANGENTS, FORCES = np.bool_(True), np.bool_(False)  # typed, because numba compiles once more for every literal
TIP_FORCE = np.int64(2)  # entries of a load that are the force at the tip; those of the drives follow


@kernel
def harmonic_response(t, state, work, drive, rates, loads, increments, tip):
    """Complex amplitudes of all unknowns, and of the tip, under harmonic loads about a state at rest.

    Linear in the load, which may therefore be of any size; a large one keeps the rounding of the static forces out.

    Parameters
    ----------
    t : Tables
        Of a boom without clearance: a sweep of forces alone is for ideal pins.
    state : State
        In equilibrium, and placed in `work`.
    work : Work
        As `kernels.tables.complex_scratch` makes it.
    drive : ndarray, shape (n,)
        Drive lengths of the state, m.
    rates : ndarray of complex, shape (k,)
        s = i omega, 1/s.
    loads : ndarray of complex, shape (k, 2 + n)
        Amplitudes: force at the tip in x and y (N), then the drive of every cylinder (m).
    increments : ndarray of complex, shape (k, unknowns)
        Written, in the units of the unknowns.
    tip : ndarray of complex, shape (k, 3)
        Written: x, y (m), orientation (rad).

    Returns
    -------
    status, row : int
        OK, or SINGULAR at `rates[row]`.
    """
    operations = t.operations.shape[0]
    for k in range(rates.shape[0]):
        rate = rates[k]
        for i in range(work.position.shape[0]):
            work.offset[i] = -rate * work.position[i]
        put_load(work, drive, rate, loads[k], 0.0)
        motion = Motion(rate * rate, rate, work.position, work.offset, TANGENTS)
        status, _, _ = sweep_in(t, state, work, motion, work.drive, work.drive_rate, ROOT, operations, FREE, work.condensed)
        if status != OK:
            return status, k
        put_load(work, drive, rate, loads[k], 1.0)
        motion = Motion(rate * rate, rate, work.position, work.offset, FORCES)
        sweep_in(t, state, work, motion, work.drive, work.drive_rate, ROOT, operations, FREE, work.condensed)
        sweep_out(t, state, work, work.condensed, ROOT, operations, FREE)
        for i in range(increments.shape[1]):
            increments[k, i] = work.dz[i]
        for i in range(tip.shape[1]):
            tip[k, i] = work.cut[i]
    return OK, rates.shape[0]


@inner
def put_load(work, drive, rate, load, share):
    """The cut at the tip and the drives under `share` of a load; tangents are made without, because they hold forces too."""
    clear_cut(work, FREE)
    work.p[0], work.p[1] = -share * load[0], -share * load[1]
    for i in range(drive.shape[0]):
        work.drive[i] = drive[i] + share * load[TIP_FORCE + i]
        work.drive_rate[i] = rate * share * load[TIP_FORCE + i]
