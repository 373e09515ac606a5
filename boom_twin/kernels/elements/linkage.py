"""Cylinder length as a function of the joint angle: rigid geometry of joint kinds A and B.

Points are in the axes of the carrier (the base for A, the section before for B), with origin in the pivot. `phi` is the angle
of the turned section against the carrier.

    A:  R = Rot(phi) (rx, ry), the rod pin on the turned section.
    B:  E = Rot(phi) (ex, ey). Q is the intersection of circles (D, lL) and (E, lR) to the left or right of D->E (`side`).
        The rod pin is on a link: R = base + along u + left n, n to the left of u.
        Link L: base = D, u = (Q - D)/lL. Link R: base = E, u = (Q - E)/lR.
        (along, left): B1 (lL, 0) on L; B2 R on L; B3 (lR - R0, -R1) on R, as the scene measures B3's R from Q to E.

Plain Python may call these with arrays of angles, under np.errstate(invalid="ignore") if links may not close.

    length = |R - C|.  Derivatives follow from (Q-D).dQ = 0 and (Q-E).(dQ-dE) = 0.
"""

from __future__ import annotations

import math

import numpy as np

from ..jit import inner, kernel
from ..plane_algebra import turned

DIRECT, LINK_L, LINK_R = 0, 1, 2

LINKAGE = np.dtype(
    [
        ("mount", np.int64),  # DIRECT: rod pin on the turned section; LINK_L, LINK_R: on that link
        ("cx", float), ("cy", float),  # barrel pin C, m
        ("dx", float), ("dy", float),  # pivot D of link L, m
        ("ex", float), ("ey", float),  # pin E of link R, or the rod pin of DIRECT, m
        ("length_l", float), ("length_r", float),  # m
        ("side", float),  # 1: Q left of D->E; -1: right of it
        ("along", float), ("left", float),  # rod pin on its link, m
    ]
)  # fmt: skip


@inner
def joint_pin(row, ex, ey):
    """Return pin Q at distance length_l from D and length_r from E on `side` of D->E; NaN if the circles do not meet."""
    vx, vy = ex - row.dx, ey - row.dy
    distance2 = vx * vx + vy * vy
    foot = (row.length_l * row.length_l - row.length_r * row.length_r + distance2) / (2.0 * distance2)
    height = row.side * np.sqrt(row.length_l * row.length_l / distance2 - foot * foot)
    return row.dx + foot * vx - height * vy, row.dy + foot * vy + height * vx


@inner
def link_angles(row, phi):
    """Return the angles of links L (D->Q) and R (E->Q) in the carrier's frame (rad); NaN if they do not close."""
    ex, ey = turned(phi, row.ex, row.ey)
    qx, qy = joint_pin(row, ex, ey)
    return np.arctan2(qy - row.dy, qx - row.dx), np.arctan2(qy - ey, qx - ex)


@inner
def cylinder_length(row, phi):
    """Return the cylinder's pin-to-pin length (m) and its derivative by phi (m/rad); NaN if the links do not close."""
    ex, ey = turned(phi, row.ex, row.ey)
    if row.mount == DIRECT:
        rx, ry, drx, dry = ex, ey, -ey, ex
    else:
        qx, qy = joint_pin(row, ex, ey)
        lx, ly = qx - row.dx, qy - row.dy
        mx, my = qx - ex, qy - ey
        # dQ = w (-ly, lx) with (Q-E).dQ = (Q-E).dE, dE = (-ey, ex)
        rate_l = (mx * -ey + my * ex) / (my * lx - mx * ly)
        if row.mount == LINK_L:
            ux, uy = lx / row.length_l, ly / row.length_l
            rx = row.dx + row.along * ux - row.left * uy
            ry = row.dy + row.along * uy + row.left * ux
            drx, dry = -rate_l * (ry - row.dy), rate_l * (rx - row.dx)
        else:
            ux, uy = mx / row.length_r, my / row.length_r
            rx = ex + row.along * ux - row.left * uy
            ry = ey + row.along * uy + row.left * ux
            dqx, dqy = -rate_l * ly, rate_l * lx
            rate_r = (ux * (dqy - ex) - uy * (dqx + ey)) / row.length_r
            drx, dry = -ey - rate_r * (ry - ey), ex + rate_r * (rx - ex)
    px, py = rx - row.cx, ry - row.cy
    length = np.hypot(px, py)
    return length, (px * drx + py * dry) / length


@inner
def angle_of_length(row, length, phi, low, high):
    """Return the angle near `phi` at which the cylinder has `length`, by Newton steps within [low, high]; NaN if none."""
    for _ in range(50):
        now, slope = cylinder_length(row, phi)
        step = (length - now) / slope
        if not math.isfinite(step):
            return math.nan
        phi = min(max(phi + min(max(step, -0.2), 0.2), low), high)
        if abs(step) < 1e-14:
            return phi
    now, slope = cylinder_length(row, phi)
    return phi if abs(length - now) < 1e-11 else math.nan


@kernel
def angles_of_lengths(rows, lengths, near, lows, highs, samples, angles):
    """Write the `angles` (n,) of n linkages whose cylinders have `lengths` (m), by `angle_of_length`.

    The search starts at `near` (n,). If that is NaN, it starts at the best of `samples` angles from `lows` to `highs`, rad.
    """
    for i in range(angles.shape[0]):
        start, least = near[i], math.inf
        if math.isnan(start):
            start = lows[i]
            for k in range(samples):
                phi = lows[i] + k * ((highs[i] - lows[i]) / (samples - 1))
                length, _ = cylinder_length(rows[i], phi)
                if abs(length - lengths[i]) < least:
                    start, least = phi, abs(length - lengths[i])
        angles[i] = angle_of_length(rows[i], lengths[i], start, lows[i], highs[i])
