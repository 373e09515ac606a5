"""Substructures B1, B2, B3, six-bar: two links and a cylinder between section i-1 and section i.

Unknowns of the loop, condensed in one solve: angle of section i, angles of links L and R, force in pin Q (lambda_x, lambda_y),
force N of the cylinder. What remains are the pivot and head of section i-1, and the barrel pin C, which the sweep carries to
the place where C sits. With P the pivot, L the vector of link L from D to Q, and so on:

    closure of pin Q:   (r_D + l_L u_L) - (r_E + l_R u_R) = 0, multiplied by lambda;
    rod pin:            R = r_base + along u + left n, on link L from D, or on link R from E.

B1, B2, B3 differ in the numbers of the rod pin only (see `kernels.elements.linkage`).

Pivots and link pins with clearance: `kernels.transfer.clearance_pins`.
"""

from __future__ import annotations

from ..elements.cylinder import AXIAL, END_C, END_R, cylinder_terms
from ..elements.linkage import LINK_L
from ..elements.pin_contact import LINK_L_PIN, PIVOT, Q_PIN, ROD_END_PIN
from ..jit import inner
from ..plane_algebra import factorise, rotated, substitute
from ..tables import Z_FORCE_B, Z_LAMBDA, Z_LINK_L, Z_LINK_R, Z_OFFSETS_B, Z_SECTION
from .clearance_pins import (
    ALPHA_L,
    ALPHA_R,
    FORCE,
    HEAD,
    LAMBDA,
    PIN_C,
    SECTION,
    SIZE,
    condense_ends,
    free_pins,
    keep_rows,
    move_ends,
    take_rows,
    torque_of,
)
from .forward_kinematics import link_frame


@inner
def add_link_force(g, base, link, bx, by, wx, wy, fx, fy):
    """Add force (fx, fy) at a point of a link: pivot + (bx, by) on body `base` + (wx, wy) on `link`."""
    g[0] += fx
    g[1] += fy
    g[base] += bx * fy - by * fx
    g[link] += wx * fy - wy * fx


@inner
def add_link_tangent(h, base, link, bx, by, wx, wy, fx, fy, kxx, kxy, kyy):
    """Add tangent k and that of a force (fx, fy) at the same point."""
    base_x, base_y = bx * kxy - by * kxx, bx * kyy - by * kxy
    link_x, link_y = wx * kxy - wy * kxx, wx * kyy - wy * kxy
    h[0, 0] += kxx
    h[1, 0] += kxy
    h[1, 1] += kyy
    h[base, 0] += base_x
    h[base, 1] += base_y
    h[link, 0] += link_x
    h[link, 1] += link_y
    h[base, base] += bx * base_y - by * base_x - (bx * fx + by * fy)
    h[link, base] += bx * link_y - by * link_x
    h[link, link] += wx * link_y - wy * link_x - (wx * fx + wy * fy)


@inner
def _add_closure(joint, linkage, z, turns, renew, g, h):
    """Closure of pin Q and the forces its multiplier puts on the four bodies."""
    lx, ly = z[joint.z + Z_LAMBDA], z[joint.z + Z_LAMBDA + 1]
    for side in range(2):
        sign = 1.0 - 2.0 * side
        bx, by, c, s = link_frame(LINK_L + side, linkage, turns)
        length, base, link = linkage.length_l, HEAD, ALPHA_L
        if side == 1:
            length, base, link = linkage.length_r, SECTION, ALPHA_R
        ux, uy = length * c, length * s
        g[LAMBDA] += sign * (bx + ux)
        g[LAMBDA + 1] += sign * (by + uy)
        g[base] += sign * (bx * ly - by * lx)
        g[link] += sign * (ux * ly - uy * lx)
        if not renew:
            continue
        h[base, base] -= sign * (bx * lx + by * ly)
        h[link, link] -= sign * (ux * lx + uy * ly)
        h[LAMBDA, base] -= sign * by
        h[LAMBDA + 1, base] += sign * bx
        h[LAMBDA, link] -= sign * uy
        h[LAMBDA + 1, link] += sign * ux


@inner
def _add_link(t, joint, linkage, side, turns, motion, position, g, h):
    """Inertia and weight of the link on `side`, if it has mass."""
    for k in range(joint.first_link, joint.first_link + joint.links):
        row = t.links[k]
        if row.side != side:
            continue
        i = row.history
        bx, by, c, s = link_frame(row.side, linkage, turns)
        wx, wy = row.middle * c, row.middle * s
        inertial = row.mass * motion.gain
        fx = inertial * (position[i] - motion.hat[i]) - row.mass * t.gravity[0]
        fy = inertial * (position[i + 1] - motion.hat[i + 1]) - row.mass * t.gravity[1]
        base, link = SECTION, ALPHA_R
        if row.side == LINK_L:
            base, link = HEAD, ALPHA_L
        add_link_force(g, base, link, bx, by, wx, wy, fx, fy)
        g[link] += row.inertia * motion.gain * (position[i + 2] - motion.hat[i + 2])
        if motion.renew:
            add_link_tangent(h, base, link, bx, by, wx, wy, fx, fy, inertial, 0.0, inertial)
            h[link, link] += row.inertia * motion.gain


@inner
def _add_cylinder(t, state, work, index, motion, drive, drive_rate, g, h):
    """The cylinder between pin C and the rod pin on its link."""
    linkage, cylinder, pins = t.linkages[index], t.cylinders[index], state.pins[index]
    own_g, own_h = work.own_g, work.own_h
    cylinder_terms(
        cylinder, t.parts, t.oils, pins[END_C], pins[END_C + 1], pins[END_R], pins[END_R + 1], state.z[cylinder.z],
        drive[index], drive_rate[index], motion, t.gravity, work.position, own_g, own_h,
    )  # fmt: skip
    condense_ends(t, state, work, cylinder, own_g, own_h)
    bx, by, c, s = link_frame(linkage.mount, linkage, state.turns[index])
    wx, wy = rotated(c, s, linkage.along, linkage.left)
    base, link = SECTION, ALPHA_R
    if linkage.mount == LINK_L:
        base, link = HEAD, ALPHA_L
    add_link_force(g, base, link, bx, by, wx, wy, own_g[END_R], own_g[END_R + 1])
    for j in range(2):
        g[PIN_C + j] += own_g[END_C + j]
    g[FORCE] += own_g[AXIAL]
    g[link] -= torque_of(t, work, cylinder, ROD_END_PIN)
    if not motion.renew:
        return
    add_link_tangent(
        h, base, link, bx, by, wx, wy, own_g[END_R], own_g[END_R + 1],
        own_h[END_R, END_R], own_h[END_R + 1, END_R], own_h[END_R + 1, END_R + 1],
    )  # fmt: skip
    for j in range(2):  # pin C against the rod pin, and itself
        h[PIN_C + j, 0] += own_h[END_R, END_C + j]
        h[PIN_C + j, 1] += own_h[END_R + 1, END_C + j]
        turn = bx * own_h[END_R + 1, END_C + j] - by * own_h[END_R, END_C + j]
        if base > PIN_C:
            h[base, PIN_C + j] += turn
        else:
            h[PIN_C + j, base] += turn
        h[link, PIN_C + j] += wx * own_h[END_R + 1, END_C + j] - wy * own_h[END_R, END_C + j]
        for i in range(j, 2):
            h[PIN_C + i, PIN_C + j] += own_h[END_C + i, END_C + j]
        h[FORCE, PIN_C + j] += own_h[AXIAL, END_C + j]
    h[FORCE, FORCE] += own_h[AXIAL, AXIAL]
    ex, ey = own_h[AXIAL, END_R], own_h[AXIAL, END_R + 1]
    h[FORCE, 0] += ex
    h[FORCE, 1] += ey
    h[FORCE, base] += bx * ey - by * ex
    h[FORCE, link] += wx * ey - wy * ex


@inner
def _add_cut(work, m, behind, renew, g, h):
    """Section i: x, y of its pivot, its angle, and what is carried already, which stands from place `behind` on."""
    for i in range(m):
        a = i if i < 2 else SECTION if i == 2 else behind + i - 3
        g[a] += work.p[i]
        for j in range(i + 1 if renew else 0):
            h[a, j if j < 2 else SECTION if j == 2 else behind + j - 3] += work.s[i, j]


@inner
def close_loop(t, state, work, motion, drive, drive_rate, index, operation, m):
    """Condense joint B `index`: the cut of section i (m slots) becomes the cut at the head, pin C carried as slots 3 and 4.

    Returns False if the loop's system is singular (a linkage at its dead centre, no inertia).
    """
    joint, linkage, turns, g, h = t.joints[index], t.linkages[index], state.turns[index], work.g, work.h
    behind = SIZE + 2 * joint.clearances
    size = behind + m - 3
    for i in range(size):
        g[i] = 0.0
        for j in range(i + 1 if motion.renew else 0):
            h[i, j] = 0.0
    has_play = joint.clearances > 0
    for i in range(2):  # links L and R
        if has_play:
            keep_rows(work.apart, g, h, size)
        _add_link(t, joint, linkage, LINK_L + i, turns, motion, work.position, g, h)
        if linkage.mount == LINK_L + i:
            _add_cylinder(t, state, work, index, motion, drive, drive_rate, g, h)
        if has_play:
            take_rows(t, work, joint, LINK_L_PIN + i, size, g, h)
    _add_cut(work, m, behind, motion.renew, g, h)
    if has_play:
        take_rows(t, work, joint, PIVOT, size, g, h)
    _add_closure(joint, linkage, state.z, turns, motion.renew, g, h)
    if has_play:
        free_pins(t, state, work, joint, g, h)
    if motion.renew:
        return _condense_loop(work, index, operation, behind - SECTION, size)
    _condense_loop_forces(work, operation, behind - SECTION, size)
    return True


@inner
def _condense_loop(work, index, operation, count, size):
    """Solve the `count` inner unknowns for all others; gains and block are kept, the cut is rewritten.

    A Newton pass wants H d + g = 0. With the inner unknowns q and all others x,

        H_qq dq + H_qx dx + g_q = 0,    H_xq dq + H_xx dx + g_x = 0.

    The first gives dq = -free - gains dx, free = H_qq^-1 g_q, gains = H_qq^-1 H_qx; put into the second,

        (H_xx - H_xq gains) dx + (g_x - H_xq free) = 0,

    the new cut (S, p): S is the Schur complement of H_qq. H has as many negative eigenvalues as H_qq and S together
    (Haynsworth 1968), so the blocks H_qq are kept for counting natural frequencies. Only the lower triangle of `h` is filled:
    the five others before SECTION meet q in its rows, those behind it in its columns.
    """
    s, p, g, h, right = work.s, work.p, work.g, work.h, work.right
    condensed = work.condensed
    matrix, order, block = condensed.factors[operation], condensed.order[operation], condensed.blocks[index]
    gains, free, others = condensed.gains[operation], condensed.free[operation], size - count
    for i in range(count):
        for j in range(SECTION):
            right[i, j] = h[SECTION + i, j]
        for j in range(SECTION, others):
            right[i, j] = h[j + count, SECTION + i]
        right[i, others] = g[SECTION + i]
        for j in range(i + 1):
            block[i, j] = matrix[i, j] = h[SECTION + i, SECTION + j]
            block[j, i] = matrix[j, i] = h[SECTION + i, SECTION + j]
    if not factorise(matrix, count, order):
        return False
    substitute(matrix, order, right, count, others + 1)
    for i in range(count):
        for j in range(others):
            gains[i, j] = right[i, j]
        free[i] = right[i, others]
    for i in range(others):
        a = i if i < SECTION else i + count
        p[i] = g[a]
        for j in range(i + 1):
            s[i, j] = h[a, j if j < SECTION else j + count]
        for k in range(count):
            coupling = h[SECTION + k, a] if a < SECTION else h[a, SECTION + k]
            p[i] -= coupling * free[k]
            for j in range(i + 1):
                s[i, j] -= coupling * gains[k, j]
        for j in range(i):
            s[j, i] = s[i, j]
    return True


@inner
def _condense_loop_forces(work, operation, count, size):
    """Condense forces as `_condense_loop` does, by the gains and the factors that it left."""
    p, g, right, others, gains = work.p, work.g, work.right, size - count, work.condensed.gains[operation]
    for i in range(others):
        p[i] = g[i if i < SECTION else i + count]
        for k in range(count):
            p[i] -= gains[k, i] * g[SECTION + k]
    for i in range(count):
        right[i, 0] = g[SECTION + i]
    substitute(work.condensed.factors[operation], work.condensed.order[operation], right, count, 1)
    for i in range(count):
        work.condensed.free[operation, i] = right[i, 0]


@inner
def open_loop(t, state, work, index, operation, m):
    """Increments of joint B `index` from the cut at its head (m slots), which becomes that of section i; returns its slots."""
    joint, cut, dz = t.joints[index], work.cut, work.dz
    gains, free = work.condensed.gains[operation], work.condensed.free[operation]
    for i in range(Z_OFFSETS_B + 2 * joint.clearances):
        value = -free[i]
        for j in range(m):
            value -= gains[i, j] * cut[j]
        dz[joint.z + i] = value
    if t.cylinders[index].clearances:
        _move_cylinder(t, state, work, index)
    for k in range(joint.clearances):
        if t.clearances[joint.first_clearance + k].place == PIVOT:
            cut[0] += dz[joint.z + Z_OFFSETS_B + 2 * k]
            cut[1] += dz[joint.z + Z_OFFSETS_B + 2 * k + 1]
    cut[HEAD] = dz[joint.z + Z_SECTION]
    for i in range(SECTION, m):
        cut[i - 2] = cut[i]
    return m - 2


@inner
def _move_cylinder(t, state, work, index):
    """Increments of the ends of a six-bar's cylinder from those of its pins."""
    joint, linkage, cut, dz = t.joints[index], t.linkages[index], work.cut, work.dz
    bx, by, c, s = link_frame(linkage.mount, linkage, state.turns[index])
    wx, wy = rotated(c, s, linkage.along, linkage.left)
    base, link = cut[HEAD], dz[joint.z + Z_LINK_L]
    rx, ry = cut[0], cut[1]
    if linkage.mount != LINK_L:
        base, link = dz[joint.z + Z_SECTION], dz[joint.z + Z_LINK_R]
    for k in range(joint.clearances):
        place, at = t.clearances[joint.first_clearance + k].place, joint.z + Z_OFFSETS_B + 2 * k
        if (place == LINK_L_PIN) == (linkage.mount == LINK_L) and place != Q_PIN:
            rx, ry = rx + dz[at], ry + dz[at + 1]
    rx, ry = rx - by * base - wy * link, ry + bx * base + wx * link
    move_ends(t, work, t.cylinders[index], cut[PIN_C], cut[PIN_C + 1], rx, ry, dz[joint.z + Z_FORCE_B])
