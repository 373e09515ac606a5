"""Substructure A, slider-crank: cylinder 1 between the base and section 1.

Sweeping in, the rod pin adds the cylinder to the cut and opens a column for its force N; at the pivot, which does not move,
the section's angle and N are what is left to solve.
"""

from __future__ import annotations

from ..physics.algebra import solve
from ..physics.cylinder import cylinder_terms
from ..physics.jit import inner


@inner
def join_rod(t, state, work, motion, drive, drive_rate, row, c, sn, m):
    """Add cylinder 1 at outlet `row` of a frame (cos c, sin sn); the cut gains the column N. Returns m + 1."""
    outlet = t.outlets[row]
    pins, cylinder, s, p = state.pins[0], t.cylinders[0], work.s, work.p
    g, h = work.own_g, work.own_h
    cylinder_terms(
        cylinder, t.parts, pins[0], pins[1], pins[2], pins[3], state.z[cylinder.z], drive[0], drive_rate[0],
        motion, t.gravity, work.position, g, h,
    )  # fmt: skip
    bx, by = c * outlet.x - sn * outlet.y, sn * outlet.x + c * outlet.y
    for i in range(m + 1):
        s[m, i] = 0.0
        s[i, m] = 0.0
    for i in range(2):
        p[i] += g[2 + i]
        s[m, i] = h[4, 2 + i]
        s[i, m] = h[4, 2 + i]
    s[m, m], p[m] = h[4, 4], g[4]
    turn_x = -by * h[2, 2] + bx * h[2, 3]  # row of the turning against x, y of the rod pin
    turn_y = -by * h[3, 2] + bx * h[3, 3]
    p[2] += bx * g[3] - by * g[2]
    for i in range(2):
        for j in range(2):
            s[i, j] += h[2 + i, 2 + j]
    s[0, 2] += turn_x
    s[2, 0] += turn_x
    s[1, 2] += turn_y
    s[2, 1] += turn_y
    s[2, 2] += bx * turn_y - by * turn_x - (bx * g[2] + by * g[3])
    s[m, 2] = bx * h[4, 3] - by * h[4, 2]
    s[2, m] = s[m, 2]
    return m + 1


@inner
def close_base(work, operation):
    """Solve increments of theta and N of joint A into the gains of `operation`; False if singular."""
    s, p, a, b = work.s, work.p, work.matrix, work.right
    for i in range(2):
        b[i, 0] = p[2 + i]
        for j in range(2):
            a[i, j] = s[2 + i, 2 + j]
            work.blocks[0, i, j] = a[i, j]
    if not solve(a, b, 2, 1):
        return False
    work.free[operation, 0] = b[0, 0]
    work.free[operation, 1] = b[1, 0]
    return True
