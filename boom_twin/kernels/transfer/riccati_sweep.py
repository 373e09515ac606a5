"""Riccati form of the transfer-matrix method: one Newton pass sweeps forces from tip to base, then increments back."""

from __future__ import annotations

from ..elements.beam import Sizes
from ..elements.beam_equations import BeamEquations, transfer_beam
from ..elements.pin_contact import BARREL_END_PIN
from ..elements.rigid_body import add_body_force, add_body_tangent, merge_outlet, pull_back
from ..jit import inner, kernel
from ..tables import (
    BEAM,
    BODY,
    FRAME_COS,
    FRAME_SIN,
    JOINT_A,
    JOINT_B,
    OFFSET,
    OK,
    ROD_PIN,
    SINGULAR,
    STATION,
    Z_FORCE_A,
    Z_SECTION,
)
from .clearance_pins import move_ends, torque_of
from .forward_kinematics import beam_part
from .six_bar import close_loop, open_loop
from .slider_crank import barrel_pin, close_base, join_rod

ROOT, FREE = 0, 3  # first operation; degrees of freedom (x, y, theta) of a cut without cylinders


@inner
def transfer_body(t, work, motion, row, c, sn):
    """Add body `row`, with its weight and inertia, to the cut at its frame (cos c, sin sn of its orientation)."""
    body, i = t.bodies[row], t.bodies[row].history
    bx, by = c * body.x - sn * body.y, sn * body.x + c * body.y
    gain, position, hat = motion.gain, work.position, motion.hat
    fx = body.mass * (gain * (position[i] - hat[i]) - t.gravity[0])
    fy = body.mass * (gain * (position[i + 1] - hat[i + 1]) - t.gravity[1])
    torque = body.inertia * gain * (position[i + 2] - hat[i + 2])
    add_body_force(work.p, bx, by, fx, fy, torque)
    if motion.renew:
        add_body_tangent(work.s, body.mass, body.inertia, bx, by, fx, fy, gain)


@inner
def beam_operation(t, state, work, motion, row, operation, c, sn, m):
    """Transfer the cut through beam part `row` and keep its gains. Return the number of negative pivots or -1."""
    beam, part, s, p = t.beams[row], beam_part(t, work, row), work.s, work.p
    gains, factors, free = work.condensed.gains[operation], work.condensed.factors[operation], work.condensed.free[operation]
    own, sizes = BeamEquations(gains, factors, free, work.local), Sizes(beam.bending, beam.axial, beam.points)
    return transfer_beam(beam, part, sizes, own, state.z, c, sn, motion, t.gravity, work.position, s, p, m)


@inner
def clear_cut(work, m):
    """Set S = 0 and p = 0 in m degrees of freedom, for a cut with nothing outboard."""
    for i in range(m):
        work.p[i] = 0.0
        for j in range(m):
            work.s[i, j] = 0.0


@kernel
def sweep_in(t, state, work, motion, drive, drive_rate, first, last, m):
    """Transfer the cut in `work` (m degrees of freedom) inwards, from the end of operation `last - 1` through `first`.

    `work.condensed` is written for `sweep_out`, `clearance_pins.coarseness` and the count of natural frequencies. Return status
    (OK or SINGULAR), negative pivots of the beams (joints: see `Condensed.blocks`), and the cut's new degrees of freedom.
    """
    s, p, negative = work.s, work.p, 0
    for k in range(last - 1, first - 1, -1):
        kind, row, c, sn = t.operations[k].kind, t.operations[k].row, state.frames[k, FRAME_COS], state.frames[k, FRAME_SIN]
        if kind == BEAM:
            count = beam_operation(t, state, work, motion, row, k, c, sn, m)
            if count < 0:
                return SINGULAR, negative, m
            negative += count
        elif kind == BODY:
            transfer_body(t, work, motion, row, c, sn)
        elif kind == OFFSET:
            bx, by = t.offsets[row].x, t.offsets[row].y
            ex, ey = c * bx - sn * by, sn * bx + c * by
            pull_back(s, p, m, 0, 1, ex, ey, motion.renew)
        elif kind == STATION:
            bx, by = t.outlets[row].x, t.outlets[row].y
            ex, ey = c * bx - sn * by, sn * bx + c * by
            merge_outlet(s, p, m, ex, ey, motion.renew)
            m -= 2
            p[2] -= torque_of(t, work, t.cylinders[t.outlets[row].cylinder], BARREL_END_PIN)
        elif kind == ROD_PIN:
            m = join_rod(t, state, work, motion, drive, drive_rate, row, c, sn, m)
        elif kind == JOINT_B:
            if not close_loop(t, state, work, motion, drive, drive_rate, row, k, m):
                return SINGULAR, negative, m
            m += 2
        elif kind == JOINT_A and not close_base(t, work, motion.renew, k):
            return SINGULAR, negative, m
    return OK, negative, m


@kernel
def sweep_out(t, state, work, first, last, m):
    """Write the increments to ADD to the unknowns of operations `first` .. `last - 1` into `work.dz`.

    The cut before them has m degrees of freedom in `work.cut`. `work.condensed` is from `sweep_in`.
    """
    cut, dz = work.cut, work.dz
    for k in range(first, last):
        kind, row, c, sn = t.operations[k].kind, t.operations[k].row, state.frames[k, FRAME_COS], state.frames[k, FRAME_SIN]
        gains, free = work.condensed.gains[k], work.condensed.free[k]
        if kind == BEAM:
            out_beam(t.beams[row], beam_part(t, work, row), gains, free, c, sn, m, cut, dz)
        elif kind == OFFSET:
            bx, by = t.offsets[row].x, t.offsets[row].y
            cut[0] -= (sn * bx + c * by) * cut[2]
            cut[1] += (c * bx - sn * by) * cut[2]
        elif kind == STATION:
            bx, by = t.outlets[row].x, t.outlets[row].y
            for i in range(m - 1, 2, -1):
                cut[i + 2] = cut[i]
            cut[3], cut[4] = cut[0] - (sn * bx + c * by) * cut[2], cut[1] + (c * bx - sn * by) * cut[2]
            m += 2
        elif kind == ROD_PIN:
            cx, cy = 0.0, 0.0
            if t.hinges.shape[0] > 0:
                m -= 1
                pin = barrel_pin(t, state)
                cx, cy = -pin[1] * cut[m], pin[0] * cut[m]
            m -= 1
            bx, by = t.outlets[row].x, t.outlets[row].y
            rx, ry = cut[0] - (sn * bx + c * by) * cut[2], cut[1] + (c * bx - sn * by) * cut[2]
            move_ends(t, work, t.cylinders[0], cx, cy, rx, ry, cut[m])
        elif kind == JOINT_B:
            m = open_loop(t, state, work, row, k, m)
        elif kind == JOINT_A:
            at = t.joints[row].z
            for i in range(2 + 2 * t.joints[row].clearances):
                dz[at + i] = -free[i]
            cut[0], cut[1] = 0.0, 0.0
            if t.joints[row].clearances:
                cut[0], cut[1] = -free[2], -free[3]
            cut[2], cut[3] = dz[at + Z_SECTION], dz[at + Z_FORCE_A]
            m = FREE + 1
            if t.hinges.shape[0] > 0:
                cut[4] = dz[t.hinges[0].z] = -free[2 + 2 * t.joints[row].clearances]
                m += 1


@inner
def out_beam(beam, part, gains, free, c, sn, m, cut, dz):
    """Write the increments of a beam part's coordinates, and update the cut to its output end."""
    psi, rho, drho, end = part.psi, part.rho, part.drho, beam.points
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
