"""Frequency response by transfer matrices: the Riccati sweeps of a time step, with complex weights.

A time step sets a = A (x - x_hat) and v = C x + D with the integrator's weights A and C (`kernels.integrators`). It condenses
the tangent K + C D + A M of every element (there D is the damping matrix). Small harmonic motion x + Re(dx e^(s t)) with
s = i omega about a rest state x has a = s^2 dx and v = s dx. This is a time step with A = s^2, C = s, x_hat = x and D = -s x.
The sweeps on complex numbers with these weights condense the dynamic stiffness

    H(s) = K + s D + s^2 M

of the boom linearised about the state, and solve H(s) dx = load. K includes the geometric stiffness of weight and pin forces.
No sum over natural modes is used.
"""

from __future__ import annotations

import numpy as np

from ..jit import inner, kernel
from ..tables import OK, Motion
from .riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out

TANGENTS = np.bool_(True)  # typed, because numba compiles once more for every literal
TIP_FORCE = np.int64(2)  # number of leading load entries for the tip force; the drives follow


@kernel
def harmonic_response(t, state, work, drive, rates, loads, pins, increments, tip):
    """Write complex amplitudes of all unknowns and of the tip under harmonic loads about a state at rest.

    With ideal pins the response is linear in the load; a large load reduces rounding by the static forces. With clearance the
    tangents are recomputed under the load and depend on it. Use a load that is small against the static forces. The linear
    response is half the difference between the responses to the load and to its opposite.

    `state` is in equilibrium and placed in `work`, which `kernels.tables.complex_scratch` made. `drive` (n,) are its drive
    lengths, m; `rates` (k,) are s = i omega, 1/s; `loads` (k, 2 + n) the force at the tip in x and y (N), then the drive of
    every cylinder (m). `pins` (2, pins, HOLD_COLUMNS) are `Work.hold` of the journals at rest, and its derivative by s.
    `increments` (k, unknowns) and `tip` (k, 3), x, y (m) and orientation (rad), are written.

    Return status and row: OK, or SINGULAR at `rates[row]`.
    """
    operations = t.operations.shape[0]
    loaded = np.bool_(pins.shape[1] > 0)
    for k in range(rates.shape[0]):
        rate = rates[k]
        for i in range(work.position.shape[0]):
            work.offset[i] = -rate * work.position[i]
        for i in range(pins.shape[1]):
            for j in range(pins.shape[2]):
                work.hold[i, j] = pins[0, i, j] + rate * pins[1, i, j]
        put_load(work, drive, rate, loads[k], 0.0)
        motion = Motion(rate * rate, rate, work.position, work.offset, TANGENTS)
        status, _, _ = sweep_in(t, state, work, motion, work.drive, work.drive_rate, ROOT, operations, FREE, work.condensed)
        if status != OK:
            return status, k
        put_load(work, drive, rate, loads[k], 1.0)
        motion = Motion(rate * rate, rate, work.position, work.offset, loaded)
        sweep_in(t, state, work, motion, work.drive, work.drive_rate, ROOT, operations, FREE, work.condensed)
        sweep_out(t, state, work, work.condensed, ROOT, operations, FREE)
        for i in range(increments.shape[1]):
            increments[k, i] = work.dz[i]
        for i in range(tip.shape[1]):
            tip[k, i] = work.cut[i]
    return OK, rates.shape[0]


@inner
def put_load(work, drive, rate, load, share):
    """Set tip force and drives to `share` of a load; 0 for tangents, because these include forces."""
    clear_cut(work, FREE)
    work.p[0], work.p[1] = -share * load[0], -share * load[1]
    for i in range(drive.shape[0]):
        work.drive[i] = drive[i] + share * load[TIP_FORCE + i]
        work.drive_rate[i] = rate * share * load[TIP_FORCE + i]
