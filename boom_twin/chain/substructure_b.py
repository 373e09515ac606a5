"""Substructures B1, B2, B3, six-bar: two links and a cylinder between section i-1 and section i.

Unknowns of the loop, condensed in one solve: angle of section i, angles of links L and R, force in pin Q (lambda_x, lambda_y),
force N of the cylinder. What remains are the pivot and head of section i-1, and the barrel pin C, which the sweep carries to
the place where C sits. With P the pivot, L the vector of link L from D to Q, and so on:

    closure of pin Q:   (r_D + l_L u_L) - (r_E + l_R u_R) = 0, multiplied by lambda;
    rod pin:            R = r_base + along u + left n, on link L from D, or on link R from E.

B1, B2, B3 differ in the numbers of the rod pin only (see `physics.linkage`).
"""

from __future__ import annotations

import numpy as np

from ..physics.algebra import solve
from ..physics.cylinder import cylinder_terms
from ..physics.jit import inner
from ..physics.linkage import LINK_L
from ..physics.rotation import rotated
from .place import link_frame

# places in the loop's system: pivot x, y; turn of the head; pin C x, y | section, links, lambda, N
HEAD, PIN_C, SECTION, ALPHA_L, ALPHA_R, LAMBDA, FORCE, SIZE = 2, 3, 5, 6, 7, 8, 10, 11
INNER = np.int64(6)  # typed, because numba compiles once more for every literal


@inner
def add_link_point(g, h, base, link, bx, by, wx, wy, fx, fy, kxx, kxy, kyy):
    """Add force (fx, fy) and tangent k at a point of a link: pivot + (bx, by) on body `base` + (wx, wy) on `link`."""
    g[0] += fx
    g[1] += fy
    g[base] += bx * fy - by * fx
    g[link] += wx * fy - wy * fx
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
def _add_closure(joint, linkage, z, turns, g, h):
    """Closure of pin Q and the forces its multiplier puts on the four bodies."""
    lx, ly = z[joint.z + 3], z[joint.z + 4]
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
        h[base, base] -= sign * (bx * lx + by * ly)
        h[link, link] -= sign * (ux * lx + uy * ly)
        h[LAMBDA, base] -= sign * by
        h[LAMBDA + 1, base] += sign * bx
        h[LAMBDA, link] -= sign * uy
        h[LAMBDA + 1, link] += sign * ux


@inner
def _add_links(t, joint, linkage, turns, motion, position, g, h):
    """Inertia and weight of the links that have mass."""
    for k in range(joint.first_link, joint.first_link + joint.links):
        row = t.links[k]
        i = row.history
        bx, by, c, s = link_frame(row.side, linkage, turns)
        wx, wy = row.middle * c, row.middle * s
        inertial = row.mass * motion.gain
        fx = inertial * (position[i] - motion.hat[i]) - row.mass * t.gravity[0]
        fy = inertial * (position[i + 1] - motion.hat[i + 1]) - row.mass * t.gravity[1]
        base, link = SECTION, ALPHA_R
        if row.side == LINK_L:
            base, link = HEAD, ALPHA_L
        add_link_point(g, h, base, link, bx, by, wx, wy, fx, fy, inertial, 0.0, inertial)
        g[link] += row.inertia * motion.gain * (position[i + 2] - motion.hat[i + 2])
        h[link, link] += row.inertia * motion.gain


@inner
def _add_cylinder(t, state, work, index, motion, drive, drive_rate, g, h):
    """The cylinder between pin C and the rod pin on its link."""
    linkage, cylinder, pins = t.linkages[index], t.cylinders[index], state.pins[index]
    own_g, own_h = work.own_g, work.own_h
    cylinder_terms(
        cylinder, t.parts, pins[0], pins[1], pins[2], pins[3], state.z[cylinder.z], drive[index], drive_rate[index],
        motion, t.gravity, work.position, own_g, own_h,
    )  # fmt: skip
    bx, by, c, s = link_frame(linkage.mount, linkage, state.turns[index])
    wx, wy = rotated(c, s, linkage.along, linkage.left)
    base, link = SECTION, ALPHA_R
    if linkage.mount == LINK_L:
        base, link = HEAD, ALPHA_L
    add_link_point(g, h, base, link, bx, by, wx, wy, own_g[2], own_g[3], own_h[2, 2], own_h[3, 2], own_h[3, 3])
    for j in range(2):  # pin C against the rod pin, and itself
        g[PIN_C + j] += own_g[j]
        h[PIN_C + j, 0] += own_h[2, j]
        h[PIN_C + j, 1] += own_h[3, j]
        turn = bx * own_h[3, j] - by * own_h[2, j]
        if base > PIN_C:
            h[base, PIN_C + j] += turn
        else:
            h[PIN_C + j, base] += turn
        h[link, PIN_C + j] += wx * own_h[3, j] - wy * own_h[2, j]
        for i in range(j, 2):
            h[PIN_C + i, PIN_C + j] += own_h[i, j]
        h[FORCE, PIN_C + j] += own_h[4, j]
    g[FORCE] += own_g[4]
    h[FORCE, FORCE] += own_h[4, 4]
    ex, ey = own_h[4, 2], own_h[4, 3]
    h[FORCE, 0] += ex
    h[FORCE, 1] += ey
    h[FORCE, base] += bx * ey - by * ex
    h[FORCE, link] += wx * ey - wy * ex


@inner
def close_loop(t, state, work, motion, drive, drive_rate, index, operation, m):
    """Condense joint B `index`: the cut of section i (m slots) becomes the cut at the head, pin C carried as slots 3 and 4.

    Returns False if the loop's system is singular (a linkage at its dead centre, no inertia).
    """
    joint, linkage, turns, g, h = t.joints[index], t.linkages[index], state.turns[index], work.g, work.h
    size = SIZE + m - 3
    for i in range(size):
        g[i] = 0.0
        for j in range(i + 1):
            h[i, j] = 0.0
    for i in range(m):  # slots: x, y of the pivot, the section's angle, and what is carried already
        a = i if i < 2 else SECTION if i == 2 else SIZE + i - 3
        g[a] = work.p[i]
        for j in range(i + 1):
            h[a, j if j < 2 else SECTION if j == 2 else SIZE + j - 3] = work.s[i, j]
    _add_closure(joint, linkage, state.z, turns, g, h)
    _add_links(t, joint, linkage, turns, motion, work.position, g, h)
    _add_cylinder(t, state, work, index, motion, drive, drive_rate, g, h)
    return _condense_loop(work, index, operation, size)


@inner
def _condense_loop(work, index, operation, size):
    """Solve the six inner unknowns for all others; gains and block are kept, the cut is rewritten."""
    s, p, g, h, right, matrix = work.s, work.p, work.g, work.h, work.right, work.matrix
    block, gains, free, others = work.blocks[index], work.gains[operation], work.free[operation], size - INNER
    for i in range(INNER):
        for j in range(5):
            right[i, j] = h[5 + i, j]
        for j in range(SIZE, size):
            right[i, j - INNER] = h[j, 5 + i]
        right[i, others] = g[5 + i]
        for j in range(i + 1):
            block[i, j], matrix[i, j] = h[5 + i, 5 + j], h[5 + i, 5 + j]
            block[j, i], matrix[j, i] = h[5 + i, 5 + j], h[5 + i, 5 + j]
    if not solve(matrix, right, INNER, others + 1):
        return False
    for i in range(INNER):
        for j in range(others):
            gains[i, j] = right[i, j]
        free[i] = right[i, others]
    for i in range(others):
        a = i if i < 5 else i + INNER
        p[i] = g[a]
        for j in range(i + 1):
            s[i, j] = h[a, j if j < 5 else j + INNER]
        for k in range(INNER):
            coupling = h[5 + k, a] if a < 5 else h[a, 5 + k]
            p[i] -= coupling * free[k]
            for j in range(i + 1):
                s[i, j] -= coupling * gains[k, j]
        for j in range(i):
            s[j, i] = s[i, j]
    return True
