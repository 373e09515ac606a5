"""Substructure A, slider-crank: cylinder 1 between the base and section 1.

At the rod pin, the inward sweep adds the cylinder to the cut, with a column for its force N. At the pivot, the section's angle
and N remain to be solved. The pivot is fixed; with clearance, the offset of its journal is solved too. The rotation of a base
on an elastic hinge has the column after that of N.

The elastic hinge is a rotational spring and damper between ground and massless base about the pivot of joint 1. With rotation
phi of the base, stiffness k, damping d and energy k phi^2 / 2,

    moment    k phi + d phi',   phi' = C phi + D;      tangent   k + d C.

C is `Motion.rate`. The barrel pin of cylinder 1 rotates with the base. With c from pivot to pin, n = c rotated by 90 degrees,

    dr_C = n dphi,   d2r_C = -c dphi^2.
"""

from __future__ import annotations

from ..elements.cylinder import AXIAL, END_C, END_R, cylinder_terms
from ..elements.pin_contact import (
    BARREL_END_PIN,
    HOLD_X,
    HOLD_Y,
    K_XX,
    K_XY,
    K_YY,
    ROD_END_PIN,
    TORQUE,
    TORQUE_TURN,
    TORQUE_X,
)
from ..jit import inner
from ..plane_algebra import factorise, rotated, substitute
from ..tables import FRAME_COS, FRAME_SIN
from .clearance_pins import condense_ends, torque_of


@inner
def hinge_moment(hinge, turn, motion):
    """Return the moment (N m) of the hinge at a rotation phi (rad)."""
    return hinge.stiffness * turn + hinge.damping * (motion.rate * turn + motion.offset[hinge.z])


@inner
def turn_barrel_force(g, cx, cy):
    """Return the derivative by phi of a work with gradient `g` over (C, R, N); (cx, cy): from pivot to barrel pin."""
    return cx * g[END_C + 1] - cy * g[END_C]


@inner
def turn_barrel_tangent(hinge, motion, g, h, cx, cy, bx, by, s, m):
    """Write row and column m (phi) of the cut from cylinder 1's gradient g and Hessian h. N has m - 1.

    Vectors (m): (cx, cy) from the pivot to the barrel pin, (bx, by) from the frame to the rod pin.
    """
    for i in range(m):
        s[m, i] = 0.0
    for i in range(2):
        s[m, i] = cx * h[END_C + 1, END_R + i] - cy * h[END_C, END_R + i]
    s[m, 2] = bx * s[m, 1] - by * s[m, 0]
    s[m, m - 1] = cx * h[END_C + 1, AXIAL] - cy * h[END_C, AXIAL]
    for i in range(m):
        s[i, m] = s[m, i]
    turned_x = cx * h[END_C + 1, END_C] - cy * h[END_C, END_C]
    turned_y = cx * h[END_C + 1, END_C + 1] - cy * h[END_C, END_C + 1]
    bend = cx * g[END_C] + cy * g[END_C + 1]
    s[m, m] = cx * turned_y - cy * turned_x - bend + hinge.stiffness + hinge.damping * motion.rate


@inner
def join_rod(t, state, work, motion, drive, drive_rate, row, c, sn, m):
    """Add cylinder 1 at outlet `row` of a frame (cos c, sin sn). Return the size of the cut, with N and the base's rotation."""
    outlet = t.outlets[row]
    pins, cylinder, s, p = state.pins[0], t.cylinders[0], work.s, work.p
    g, h = work.own_g, work.own_h
    cylinder_terms(
        cylinder, t.parts, t.oils, pins[END_C], pins[END_C + 1], pins[END_R], pins[END_R + 1], state.z[cylinder.z],
        drive[0], drive_rate[0], motion, t.gravity, work.position, g, h,
    )  # fmt: skip
    condense_ends(t, state, work, cylinder, g, h)
    bx, by = c * outlet.x - sn * outlet.y, sn * outlet.x + c * outlet.y
    for i in range(2):
        p[i] += g[END_R + i]
    p[m] = g[AXIAL]
    p[2] += bx * g[END_R + 1] - by * g[END_R] - torque_of(t, work, cylinder, ROD_END_PIN)
    turns = t.hinges.shape[0]
    if turns > 0:
        cx, cy = barrel_pin(t, state)
        moment = hinge_moment(t.hinges[0], state.z[t.hinges[0].z], motion)
        p[m + 1] = turn_barrel_force(g, cx, cy) + moment - torque_of(t, work, cylinder, BARREL_END_PIN)
    if not motion.renew:
        return m + 1 + turns
    for i in range(m + 1):
        s[m, i] = 0.0
        s[i, m] = 0.0
    for i in range(2):
        s[m, i] = h[AXIAL, END_R + i]
        s[i, m] = h[AXIAL, END_R + i]
    s[m, m] = h[AXIAL, AXIAL]
    turn_x = -by * h[END_R, END_R] + bx * h[END_R, END_R + 1]  # row of the rotation, columns x, y of the rod pin
    turn_y = -by * h[END_R + 1, END_R] + bx * h[END_R + 1, END_R + 1]
    for i in range(2):
        for j in range(2):
            s[i, j] += h[END_R + i, END_R + j]
    s[0, 2] += turn_x
    s[2, 0] += turn_x
    s[1, 2] += turn_y
    s[2, 1] += turn_y
    s[2, 2] += bx * turn_y - by * turn_x - (bx * g[END_R] + by * g[END_R + 1])
    s[m, 2] = bx * h[AXIAL, END_R + 1] - by * h[AXIAL, END_R]
    s[2, m] = s[m, 2]
    if turns > 0:
        turn_barrel_tangent(t.hinges[0], motion, g, h, cx, cy, bx, by, s, m + 1)
    return m + 1 + turns


@inner
def barrel_pin(t, state):
    """Return the vector (m) from the pivot of joint 1 to the barrel pin of cylinder 1."""
    base = state.frames[0]
    return rotated(base[FRAME_COS], base[FRAME_SIN], t.linkages[0].cx, t.linkages[0].cy)


@inner
def slot_of(unknown, offsets):
    """Return the row in the cut of an unknown of joint A: theta, N, `offsets` (journal's x, y), base's rotation."""
    if unknown < 2:
        return 2 + unknown
    return unknown - 2 if unknown < 2 + offsets else 4


@inner
def close_base(t, work, renew, operation):
    """Solve the increments of joint A and store them for `operation`, in the order of `slot_of`.

    renew : True for a new tangent. Return False if it is singular.
    """
    s, p, b, joint = work.s, work.p, work.right, t.joints[0]
    condensed, offsets = work.condensed, 2 * joint.clearances
    a, order = condensed.factors[operation], condensed.order[operation]
    size = 2 + offsets + t.hinges.shape[0]
    for i in range(size):
        of = slot_of(i, offsets)
        b[i, 0] = p[of]
        for j in range(size if renew else 0):
            a[i, j] = s[of, slot_of(j, offsets)]
    if joint.clearances:  # tangents are then new in every pass
        hold = work.hold[joint.first_clearance]
        b[0, 0] += hold[TORQUE]
        b[2, 0] += hold[HOLD_X]
        b[3, 0] += hold[HOLD_Y]
        a[2, 2] += hold[K_XX]
        a[2, 3] += hold[K_XY]
        a[3, 2] += hold[K_XY]
        a[3, 3] += hold[K_YY]
        a[0, 0] += hold[TORQUE_TURN]
        for i in range(2):
            a[0, 2 + i] += hold[TORQUE_X + i]
            a[2 + i, 0] += hold[TORQUE_X + i]
        if size > 2 + offsets:  # pin friction acts back on the base
            turn = size - 1
            b[turn, 0] -= hold[TORQUE]
            a[turn, turn] += hold[TORQUE_TURN]
            a[0, turn] -= hold[TORQUE_TURN]
            a[turn, 0] -= hold[TORQUE_TURN]
            for i in range(2):
                a[turn, 2 + i] -= hold[TORQUE_X + i]
                a[2 + i, turn] -= hold[TORQUE_X + i]
    if renew:
        for i in range(size):
            for j in range(size):
                condensed.blocks[0, i, j] = a[i, j]
        if not factorise(a, size, order):
            return False
    substitute(a, order, b, size, 1)
    for i in range(size):
        condensed.free[operation, i] = b[i, 0]
    return True
