"""Elastic hinge between ground and massless base about the pivot of joint 1: rotational spring and damper.

With rotation phi of the base, stiffness k, damping d and energy k phi^2 / 2,

    moment    k phi + d phi',   phi' = C phi + D;      tangent   k + d C.

C is `Motion.rate`. The barrel pin of cylinder 1 rotates with the base. With c from pivot to pin, n = c rotated by 90 degrees,

    dr_C = n dphi,   d2r_C = -c dphi^2.
"""

from __future__ import annotations

import numpy as np

from ..jit import inner
from .cylinder import AXIAL, END_C, END_R

HINGE = np.dtype(
    [
        ("z", np.int64),  # index of phi among the unknowns
        ("stiffness", float),  # N m/rad
        ("damping", float),  # N m s/rad
    ]
)


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
