"""Rigid parts: a massless offset along a body, a mass on it, a second outlet. All act on a cut (S, p).

Body vector b turned by the orientation theta is (X, Y). With r_O = r_I + (X, Y):

    dx_O = dx - Y dtheta,   dy_O = dy + X dtheta,   d2 r_O / dtheta2 = -(X, Y).
"""

from __future__ import annotations

from ..jit import inner


@inner
def pull_back(s, p, m, x_of, y_of, bx, by, renew):
    """Let slots x_of, y_of be a point at (bx, by) from the frame in slots 0..2: add what it does to slot 2, turning.

    Congruence with T = 1 + (-by e_x + bx e_y) e_theta^T, and the second derivative of the point; only forces unless `renew`.
    """
    bend = bx * p[x_of] + by * p[y_of]
    p[2] += bx * p[y_of] - by * p[x_of]
    if not renew:
        return
    for i in range(m):
        s[i, 2] += bx * s[i, y_of] - by * s[i, x_of]
    for i in range(m):
        s[2, i] += bx * s[y_of, i] - by * s[x_of, i]
    s[2, 2] -= bend


@inner
def add_body_force(p, dx, dy, fx, fy, torque):
    """Mass at (dx, dy) from the frame: force -(fx, fy) = -m (a - g) and -torque = -J alpha on it."""
    p[0] += fx
    p[1] += fy
    p[2] += dx * fy - dy * fx + torque


@inner
def add_body_tangent(s, mass, inertia, dx, dy, fx, fy, gain):
    """Tangents m A and J A of the same mass."""
    inertial = mass * gain
    s[0, 0] += inertial
    s[1, 1] += inertial
    s[0, 2] -= inertial * dy
    s[2, 0] -= inertial * dy
    s[1, 2] += inertial * dx
    s[2, 1] += inertial * dx
    s[2, 2] += inertial * (dx * dx + dy * dy) - (dx * fx + dy * fy) + inertia * gain


@inner
def merge_outlet(s, p, m, bx, by, renew):
    """Slots 3, 4 are a point at (bx, by) of the frame: fold them into slots 0..2 and close the gap; forces unless `renew`."""
    pull_back(s, p, m, 3, 4, bx, by, renew)
    p[0] += p[3]
    p[1] += p[4]
    for i in range(5, m):
        p[i - 2] = p[i]
    if not renew:
        return
    for i in range(m):
        s[i, 0] += s[i, 3]
        s[i, 1] += s[i, 4]
    for i in range(m):
        s[0, i] += s[3, i]
        s[1, i] += s[4, i]
    for i in range(5, m):
        for j in range(m):
            s[i - 2, j] = s[i, j]
    for i in range(5, m):
        for j in range(m - 2):
            s[j, i - 2] = s[j, i]
