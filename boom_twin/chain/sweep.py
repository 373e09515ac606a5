"""The two Riccati sweeps of one Newton pass: forces in, tip to base; increments out, base to tip."""

from __future__ import annotations

import numpy as np

from ..physics.beam import transfer_beam
from ..physics.jit import kernel
from ..physics.rigid import add_body, merge_outlet, pull_back, turned_by
from .program import BEAM, BODY, JOINT_A, JOINT_B, OFFSET, ROD_PIN, STATION
from .substructure_a import close_base, join_rod
from .substructure_b import close_loop

SWEPT, SINGULAR = 0, 2
SLOTS = np.int64(3)  # of a cut with nothing carried; typed, because numba compiles once more for every literal


@kernel
def transfer_body(t, state, work, motion, row, theta):
    """Add body `row`, with its weight and inertia, to the cut at its frame."""
    body, i = t.bodies[row], t.bodies[row].history
    bx, by = turned_by(theta, body.x, body.y)
    gain, position, hat = motion.gain, work.position, motion.hat
    fx = body.mass * (gain * (position[i] - hat[i]) - t.gravity[0])
    fy = body.mass * (gain * (position[i + 1] - hat[i + 1]) - t.gravity[1])
    torque = body.inertia * gain * (position[i + 2] - hat[i + 2])
    add_body(work.s, work.p, body.mass, body.inertia, bx, by, fx, fy, torque, gain)


@kernel
def beam_operation(t, state, work, motion, row, operation, theta, m):
    """Carry the cut through beam part `row`, keeping its gains; returns the number of negative pivots or -1."""
    beam = t.beams[row]
    tables = (t.psi[row], t.weights[row], t.stiffness[row], t.point_mass[row], t.point_rotary[row])
    scratch = (work.rho[row], work.drho[row], work.turn[row], work.local)
    negative = transfer_beam(
        beam, tables, scratch, state.z, theta, motion, t.gravity, work.position, work.s, work.p, m, work.g, work.h
    )
    gains = work.gains[operation]
    for a in range(beam.bending + beam.axial):
        for i in range(m):
            gains[a, i] = work.h[m + a, i]
        gains[a, 6] = work.g[m + a]
    return negative


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
        kind, row, theta = t.operations[k].kind, t.operations[k].row, state.frames[k, 2]
        if kind == BEAM:
            count = beam_operation(t, state, work, motion, row, k, theta, m)
            if count < 0:
                return SINGULAR, negative
            negative += count
        elif kind == BODY:
            transfer_body(t, state, work, motion, row, theta)
        elif kind == OFFSET:
            bx, by = turned_by(theta, t.offsets[row].x, t.offsets[row].y)
            pull_back(s, p, m, 0, 1, bx, by)
        elif kind == STATION:
            bx, by = turned_by(theta, t.outlets[row].x, t.outlets[row].y)
            m = merge_outlet(s, p, m, bx, by)
        elif kind == ROD_PIN:
            m = join_rod(t, state, work, motion, drive, drive_rate, row, theta, m)
        elif kind == JOINT_B:
            if not close_loop(t, state, work, motion, drive, drive_rate, row, k, theta):
                return SINGULAR, negative
            m = 5
        elif kind == JOINT_A and not close_base(t, work, k):
            return SINGULAR, negative
    return SWEPT, negative


@kernel
def sweep_out(t, state, work):
    """Increments of all unknowns from the gains that `sweep_in` kept; fills `work.dz` with what to ADD to the unknowns."""
    cut, dz, gains, m = work.cut, work.dz, work.gains, SLOTS
    for k in range(t.operations.shape[0]):
        kind, row, theta = t.operations[k].kind, t.operations[k].row, state.frames[k, 2]
        if kind == BEAM:
            out_beam(t.beams[row], t.psi[row], work.rho[row], work.drho[row], gains[k], theta, m, cut, dz)
        elif kind == OFFSET:
            bx, by = turned_by(theta, t.offsets[row].x, t.offsets[row].y)
            cut[0] -= by * cut[2]
            cut[1] += bx * cut[2]
        elif kind == STATION:
            bx, by = turned_by(theta, t.outlets[row].x, t.outlets[row].y)
            if m == 4:
                cut[5] = cut[3]
            cut[3], cut[4] = cut[0] - by * cut[2], cut[1] + bx * cut[2]
            m += 2
        elif kind == ROD_PIN:
            m -= 1
        elif kind == JOINT_B:
            first = t.joints[row].z
            for i in range(6):
                dz[first + i] = -gains[k, i, 6]
                for j in range(5):
                    dz[first + i] -= gains[k, i, j] * cut[j]
            cut[2] = dz[first]
            m = 3
        elif kind == JOINT_A:
            first = t.joints[row].z
            dz[first], dz[first + 1] = -gains[k, 0, 6], -gains[k, 1, 6]
            cut[0], cut[1], cut[2], cut[3] = 0.0, 0.0, dz[first], dz[first + 1]
            m = 4


@kernel
def out_beam(beam, psi, rho, drho, gains, theta, m, cut, dz):
    """Increments of a beam part's coordinates, and of its output end."""
    end = beam.points
    ex, ey = turned_by(theta, rho[end, 0], rho[end, 1])
    dx, dy, turn = -ey * cut[2], ex * cut[2], 0.0
    for a in range(beam.bending + beam.axial):
        value = -gains[a, 6]
        for i in range(m):
            value -= gains[a, i] * cut[i]
        dz[beam.z + a] = value
        bx, by = turned_by(theta, drho[end, a, 0], drho[end, a, 1])
        dx += bx * value
        dy += by * value
        if a < beam.bending:
            turn += psi[end, a] * value
    cut[0] += dx
    cut[1] += dy
    cut[2] += turn
