"""Time steps of a boom under a force at the tip: the model's sweeps inside a generalised-alpha loop of their own."""

from __future__ import annotations

import numpy as np
from analysis.resting import at_rest

from boom_twin.analysis.modal import drive_at_rest
from boom_twin.kernels.tables import OK, Motion
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out

RHO = 0.9
PASSES = 2


def tip_under(scene, posture, step, forces):
    """Displacement of the tip (m, 2) from rest, after every step (s); the forces (m, 2), in N, are those at the steps' ends."""
    plan, state, work = at_rest(scene, posture)
    t, still, end = plan.tables, np.zeros(plan.joints), np.int64(len(plan.tables.operations))
    drive = drive_at_rest(plan, state, work)
    am, af = (2.0 * RHO - 1.0) / (RHO + 1.0), RHO / (RHO + 1.0)
    gamma = 0.5 + af - am
    beta = 0.25 * (gamma + 0.5) ** 2
    gain, rate = (1.0 - am) / ((1.0 - af) * beta * step**2), gamma / (beta * step)
    place(t, state, work)
    x = work.position.copy()
    v, a, p = np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
    start, found = x[t.tip : t.tip + 2].copy(), []
    for force in forces:
        ahead = x + step * v + (0.5 - beta) * step**2 * p
        hat = ahead - (am * p - af * a) / ((1.0 - af) * gain)
        offset = v + step * (1.0 - gamma) * p - rate * ahead
        for _ in range(PASSES):
            clear_cut(work, FREE)
            work.p[:2] = -force
            status, _, _ = sweep_in(
                t, state, work, Motion(gain, rate, hat, offset), drive, still, ROOT, end, FREE, work.condensed
            )
            assert status == OK
            sweep_out(t, state, work, work.condensed, ROOT, end, FREE)
            state.z[:] += work.dz
            place(t, state, work)
        before, x = a, work.position.copy()
        a, v = gain * (x - hat), rate * x + offset
        p = ((1.0 - af) * a + af * before - am * p) / (1.0 - am)
        found.append(x[t.tip : t.tip + 2] - start)
    return np.array(found)
