"""Elastic support: a spring without length between the end of the chain and a fixed point.

    V = k |r - a|^2/2,    dV = k (r - a).dr,    d2V = k dr.dr

r is the point of the chain, a the fixed one (m, in the axes of the base), k the stiffness (N/m).
"""

from __future__ import annotations

import numpy as np

from ..jit import inner

SUPPORT_ROW = np.dtype([("stiffness", float), ("x", float), ("y", float)])  # N/m, m, m


@inner
def add_support(row, s, p, x, y):
    """Add the support to the cut (s, p) at a frame whose origin is (x, y)."""
    p[0] += row.stiffness * (x - row.x)
    p[1] += row.stiffness * (y - row.y)
    s[0, 0] += row.stiffness
    s[1, 1] += row.stiffness
