"""The two Riccati sweeps of one Newton pass: forces in, tip to base; increments out, base to tip."""

from __future__ import annotations

import numpy as np

from ..physics.beam import transfer_beam
from ..physics.jit import inner, kernel
from ..physics.rigid import add_body, merge_outlet, pull_back
from .program import BEAM, BODY, JOINT_A, JOINT_B, OFFSET, ROD_PIN, STATION
from .substructure_a import close_base, join_rod
from .substructure_b import close_loop

SWEPT, SINGULAR = 0, 2
# Slots of a cut with nothing carried, and with pin C; typed, because numba compiles once more for every literal.
SLOTS, CARRIED = np.int64(3), np.int64(5)


@inner
def transfer_body(t, work, motion, row, c, sn):
    """Add body `row`, with its weight and inertia, to the cut at its frame (cos c, sin sn of its orientation)."""
    body, i = t.bodies[row], t.bodies[row].history
    bx, by = c * body.x - sn * body.y, sn * body.x + c * body.y
    gain, position, hat = motion.gain, work.position, motion.hat
    fx = body.mass * (gain * (position[i] - hat[i]) - t.gravity[0])
    fy = body.mass * (gain * (position[i + 1] - hat[i + 1]) - t.gravity[1])
    torque = body.inertia * gain * (position[i + 2] - hat[i + 2])
    add_body(work.s, work.p, body.mass, body.inertia, bx, by, fx, fy, torque, gain)


@inner
def beam_operation(t, state, work, motion, row, operation, c, sn, m):
    """Carry the cut through beam part `row`, keeping its gains; returns the number of negative pivots or -1."""
    tables = (t.psi[row], t.weights[row], t.stiffness[row], t.point_mass[row], t.point_rotary[row])
    scratch = (work.rho[row], work.drho[row], work.turn[row], work.local, work.block)
    return transfer_beam(
        t.beams[row], tables, scratch, state.z, c, sn, motion, t.gravity, work.position, work.s, work.p, m,
        work.gains[operation], work.free[operation],
    )  # fmt: skip


@kernel
def sweep_in(t, state, work, motion, drive, drive_rate):
    """Condense all forces and tangents towards the base.

    Returns
    -------
    status, negative : int
        SWEPT or SINGULAR; the number of negative pivots in the beams (joints: see `Work.blocks`).
    """
    s, p, m, negative = work.s, work.p, SLOTS, 0
    for i in range(3):
        p[i] = 0.0
        for j in range(3):
            s[i, j] = 0.0
    for k in range(t.operations.shape[0] - 1, -1, -1):
        kind, row, c, sn = t.operations[k].kind, t.operations[k].row, state.frames[k, 3], state.frames[k, 4]
        if kind == BEAM:
            count = beam_operation(t, state, work, motion, row, k, c, sn, m)
            if count < 0:
                return SINGULAR, negative
            negative += count
        elif kind == BODY:
            transfer_body(t, work, motion, row, c, sn)
        elif kind == OFFSET:
            bx, by = t.offsets[row].x, t.offsets[row].y
            pull_back(s, p, m, 0, 1, c * bx - sn * by, sn * bx + c * by)
        elif kind == STATION:
            bx, by = t.outlets[row].x, t.outlets[row].y
            m = merge_outlet(s, p, m, c * bx - sn * by, sn * bx + c * by)
        elif kind == ROD_PIN:
            m = join_rod(t, state, work, motion, drive, drive_rate, row, c, sn, m)
        elif kind == JOINT_B:
            if not close_loop(t, state, work, motion, drive, drive_rate, row, k, state.frames[k, 2]):
                return SINGULAR, negative
            m = CARRIED
        elif kind == JOINT_A and not close_base(work, k):
            return SINGULAR, negative
    return SWEPT, negative


@kernel
def sweep_out(t, state, work):
    """Increments of all unknowns from the gains that `sweep_in` kept; fills `work.dz` with what to ADD to the unknowns."""
    cut, dz, m = work.cut, work.dz, SLOTS
    for k in range(t.operations.shape[0]):
        kind, row, c, sn = t.operations[k].kind, t.operations[k].row, state.frames[k, 3], state.frames[k, 4]
        gains, free = work.gains[k], work.free[k]
        if kind == BEAM:
            out_beam(t.beams[row], t.psi[row], work.rho[row], work.drho[row], gains, free, c, sn, m, cut, dz)
        elif kind == OFFSET:
            bx, by = t.offsets[row].x, t.offsets[row].y
            cut[0] -= (sn * bx + c * by) * cut[2]
            cut[1] += (c * bx - sn * by) * cut[2]
        elif kind == STATION:
            bx, by = t.outlets[row].x, t.outlets[row].y
            if m == 4:
                cut[5] = cut[3]
            cut[3], cut[4] = cut[0] - (sn * bx + c * by) * cut[2], cut[1] + (c * bx - sn * by) * cut[2]
            m += 2
        elif kind == ROD_PIN:
            m -= 1
        elif kind == JOINT_B:
            first = t.joints[row].z
            for i in range(6):
                value = -free[i]
                for j in range(5):
                    value -= gains[i, j] * cut[j]
                dz[first + i] = value
            cut[2] = dz[first]
            m = SLOTS
        elif kind == JOINT_A:
            first = t.joints[row].z
            dz[first], dz[first + 1] = -free[0], -free[1]
            cut[0], cut[1], cut[2], cut[3] = 0.0, 0.0, dz[first], dz[first + 1]
            m = SLOTS + 1


@inner
def out_beam(beam, psi, rho, drho, gains, free, c, sn, m, cut, dz):
    """Increments of a beam part's coordinates, and of its output end."""
    end = beam.points
    dx, dy, turn = -rho[end, 1] * cut[2], rho[end, 0] * cut[2], 0.0  # in the axes of the input end
    for a in range(beam.bending + beam.axial):
        value = -free[a]
        for i in range(m):
            value -= gains[a, i] * cut[i]
        dz[beam.z + a] = value
        dx += drho[end, a, 0] * value
        dy += drho[end, a, 1] * value
        if a < beam.bending:
            turn += psi[end, a] * value
    cut[0] += c * dx - sn * dy
    cut[1] += sn * dx + c * dy
    cut[2] += turn
