"""Hydraulic cylinder: barrel, rod, and a drive in series with an oil spring and damper, between pins C and R.

d = R - C, l = |d|, e = d/l, n = e turned by 90 degrees, gamma = angle of e. Barrel centre C + b e, rod centre R - c e.

    N = k (l - l_ref) + dv (l' - l_ref')       written as a compliance, so that k -> infinity is the rigid drive:
    0 = [l - l_ref + tau (l' - l_ref') - N/k] / (1 + tau C),   tau = dv/k,   l' = C l + D.

k is a number, or follows from the oil in both chambers (`oil_compliance`) at the stroke of the drive: the oil is shut in there,
and k is therefore the same throughout a step, whatever the step solves for.

First and second derivatives by d:  dl = e.dd,  d2l = n n^T/l;  dgamma = n.dd/l,  d2gamma = -(e n^T + n e^T)/l^2;  for a
constant force s, d(s.e) = (s.n) n.dd/l and d2(s.e) = -[(s.e) n n^T + (s.n)(e n^T + n e^T)]/l^2.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...types import Array
from ..jit import inner, kernel

BARREL, ROD = 0, 1  # what a part belongs to
DRIVE_TOLERANCE, DRIVE_PASSES = 1e-13, 60  # change (m) of a drive in the last pass of `write_drives`, most passes

# Places of the ends' x in the cylinder's own system (x_C, y_C, x_R, y_R, N) and among `State.pins`; that of N.
END_C, END_R, AXIAL = 0, 2, 4

CYLINDER = np.dtype(
    [
        ("z", np.int64),  # place of N among the unknowns
        ("history", np.int64),  # place of l among the histories
        ("first_part", np.int64), ("parts", np.int64),  # rows of CYLINDER_PART
        ("first_clearance", np.int64), ("clearances", np.int64),  # rows of CLEARANCE: its rod and barrel pins
        ("closed_length", float),  # m
        ("compliance", float),  # 1/k, m/N; 0 = incompressible
        ("lag", float),  # tau = damping over stiffness, s
        ("oil", np.int64),  # row of OIL, which then gives compliance and lag; -1: they are as above
    ]
)  # fmt: skip

OIL = np.dtype(
    [
        ("bulk_modulus", float),  # Pa
        ("cap_area", float), ("rod_area", float),  # of the piston, m^2
        ("cap_line", float), ("rod_line", float),  # oil beside that in the cylinder's travel, m^3
        ("max_stroke", float),  # m
        ("damping", float),  # N s/m
    ]
)  # fmt: skip

CYLINDER_PART = np.dtype(
    [
        ("end", np.int64),  # BARREL: measured from C; ROD: from R
        ("history", np.int64),  # place of x, y, gamma among the histories
        ("com", float),  # distance of the centre from its pin, m
        ("mass", float),  # kg
        ("inertia", float),  # about the centre, kg m^2
    ]
)


@inner
def oil_compliance(oil, stroke):
    """Return 1/k (m/N) of the oil shut in at `stroke` (m): two columns, each of compliance V/(B A^2), side by side.

    Beyond the end stops, which noise of the strokes may reach, it stays as it is there.
    """
    travel = min(max(stroke.real, 0.0), oil.max_stroke)
    cap = (oil.cap_line + oil.cap_area * travel) / (oil.cap_area * oil.cap_area)
    rod = (oil.rod_line + oil.rod_area * (oil.max_stroke - travel)) / (oil.rod_area * oil.rod_area)
    return cap * rod / ((cap + rod) * oil.bulk_modulus)


@inner
def compliance_and_lag(row, oils, drive):
    """Return 1/k (m/N) and tau (s) of a cylinder whose drive is `drive` (m) long."""
    if row.oil < 0:
        return row.compliance, row.lag
    oil = oils[row.oil]
    compliance = oil_compliance(oil, drive - row.closed_length)
    return compliance, oil.damping * compliance


@inner
def near(angle, other):
    """The value of `angle` modulo 2 pi that is nearest to `other`."""
    return angle + 2.0 * math.pi * round((other - angle) / (2.0 * math.pi))


@inner
def place_cylinder(row, parts, cx, cy, rx, ry, before, position):
    """Write length, centres and angles into `position`; angles next to those in `before`, positions of the last step."""
    dx, dy = rx - cx, ry - cy
    length, angle = math.sqrt(dx * dx + dy * dy), 0.0
    ex, ey = dx / length, dy / length
    position[row.history] = length
    if row.parts:
        angle = math.atan2(dy, dx)
    for k in range(row.first_part, row.first_part + row.parts):
        part = parts[k]
        x, y, along = cx, cy, part.com
        if part.end == ROD:
            x, y, along = rx, ry, -part.com
        position[part.history] = x + along * ex
        position[part.history + 1] = y + along * ey
        position[part.history + 2] = near(angle, before[part.history + 2])


@inner
def cylinder_terms(row, parts, oils, cx, cy, rx, ry, force, drive, drive_rate, motion, gravity, position, g, h):
    """Gradient g, shape (5,), and tangent h, shape (5, 5), over (x_C, y_C, x_R, y_R, N).

    `motion` holds A, C, x_hat and D (see `boom_twin.kernels.tables.Motion`); `drive`, `drive_rate` are l_ref, l_ref'.
    """
    dx, dy = rx - cx, ry - cy
    length = math.sqrt(dx * dx + dy * dy)
    ex, ey = dx / length, dy / length
    nx, ny = -ey, ex
    d_n, d_nn, d_en = 0.0, force / length, 0.0  # by d: gradient along n, tangents in the axes e, n
    cc_ee, cc_nn, rr_ee, rr_nn, cr_nn = 0.0, 0.0, 0.0, 0.0, 0.0
    gcx, gcy, grx, gry = 0.0, 0.0, 0.0, 0.0
    for k in range(row.first_part, row.first_part + row.parts):
        part = parts[k]
        i = part.history
        inertial = part.mass * motion.gain
        fx = inertial * (position[i] - motion.hat[i]) - part.mass * gravity[0]
        fy = inertial * (position[i + 1] - motion.hat[i + 1]) - part.mass * gravity[1]
        ratio = part.com / length
        far = inertial * ratio * ratio
        close = inertial * (1.0 - ratio) * (1.0 - ratio)
        cr_nn += inertial * ratio * (1.0 - ratio)
        along = part.com
        if part.end == BARREL:
            gcx += fx
            gcy += fy
            cc_ee += inertial
            cc_nn += close
            rr_nn += far
        else:
            along = -part.com
            grx += fx
            gry += fy
            rr_ee += inertial
            rr_nn += close
            cc_nn += far
        f_e, f_n = along * (fx * ex + fy * ey), along * (fx * nx + fy * ny)
        torque = part.inertia * motion.gain * (position[i + 2] - motion.hat[i + 2])
        d_n += (f_n + torque) / length
        d_nn += (part.inertia * motion.gain - f_e) / (length * length)
        d_en -= (f_n + torque) / (length * length)
    gx, gy = force * ex + d_n * nx, force * ey + d_n * ny
    g[END_C], g[END_C + 1], g[END_R], g[END_R + 1] = gcx - gx, gcy - gy, grx + gx, gry + gy
    compliance, lag = compliance_and_lag(row, oils, drive)
    lead = 1.0 + lag * motion.rate
    speed = motion.rate * length + motion.offset[row.history] - drive_rate
    g[AXIAL] = (length - drive + lag * speed - compliance * force) / lead
    if not motion.renew:
        return
    _fill(h, END_C, END_C, ex, ey, cc_ee, d_en, cc_nn + d_nn)
    _fill(h, END_R, END_R, ex, ey, rr_ee, d_en, rr_nn + d_nn)
    _fill(h, END_C, END_R, ex, ey, 0.0, -d_en, cr_nn - d_nn)
    _fill(h, END_R, END_C, ex, ey, 0.0, -d_en, cr_nn - d_nn)
    h[AXIAL, END_C], h[AXIAL, END_C + 1], h[AXIAL, END_R], h[AXIAL, END_R + 1] = -ex, -ey, ex, ey
    h[END_C, AXIAL], h[END_C + 1, AXIAL], h[END_R, AXIAL], h[END_R + 1, AXIAL] = -ex, -ey, ex, ey
    h[AXIAL, AXIAL] = -compliance / lead


@inner
def _fill(h, i, j, ex, ey, ee, en, nn):
    """Write a symmetric 2x2 block given in the axes e, n at rows i, columns j in the model axes."""
    mixed = (ee - nn) * ex * ey + en * (ex * ex - ey * ey)
    h[i, j] = ee * ex * ex - 2.0 * en * ex * ey + nn * ey * ey
    h[i, j + 1] = mixed
    h[i + 1, j] = mixed
    h[i + 1, j + 1] = ee * ey * ey + 2.0 * en * ex * ey + nn * ex * ex


@kernel
def write_drives(cylinders: Any, oils: Any, forces: Array, lengths: Array) -> None:
    """Turn lengths (m) of cylinders under `forces` (N), both (k, n), into their drives; NaN if there are none.

    The compliance of `oil` is that at the drive. A pass leaves the share of the error that the oil's pressure is of its bulk
    modulus, a few percent.
    """
    for i in range(cylinders.shape[0]):
        closed = cylinders[i].closed_length
        for row in range(lengths.shape[0]):
            drive, change, passes = lengths[row, i], 1.0, 0
            while abs(change) >= DRIVE_TOLERANCE and passes < DRIVE_PASSES:
                change = lengths[row, i] - compliance_and_lag(cylinders[i], oils, closed + drive)[0] * forces[row, i] - drive
                drive, passes = drive + change, passes + 1
            lengths[row, i] = drive if abs(change) < DRIVE_TOLERANCE else math.nan
