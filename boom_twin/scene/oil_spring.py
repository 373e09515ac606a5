"""Oil spring of a cylinder: its stiffness k, given as a number or by the oil in both chambers over the stroke.

    k(s) = B (A_c^2 / (V_c + A_c s) + A_r^2 / (V_r + A_r (s_max - s)))

B bulk modulus, A_c, A_r areas of the piston on the cap side and on the rod side, V_c, V_r oil in lines and dead space, s the
stroke of the drive, s_max the cylinder's `max_stroke`.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from ..kernels.elements.cylinder import OIL, oil_compliance
from .schema import Cylinder

STATIONS = (0.0, 0.25, 0.5, 0.75, 1.0)  # shares of the full stroke at which k is told


def oil_record(cylinder: Cylinder) -> np.record:
    """Return the oil and chambers of a cylinder with `oil`, as one record of `OIL`."""
    oil = cylinder.oil
    assert oil is not None
    row = np.zeros(1, OIL).view(np.recarray)
    row["bulk_modulus"], row["max_stroke"], row["damping"] = oil.bulk_modulus, cylinder.max_stroke, cylinder.d or 0.0
    row["cap_area"], row["rod_area"] = oil.cap_area, oil.rod_area
    row["cap_line"], row["rod_line"] = oil.cap_line, oil.rod_line
    return cast(np.record, row[0])


def stiffness(cylinder: Cylinder, stroke: float) -> float:
    """Return k (N/m) at a stroke (m); infinite where the cylinder is incompressible."""
    if cylinder.oil is None:
        return math.inf if cylinder.k is None else cylinder.k
    compliance = float(oil_compliance(oil_record(cylinder), stroke))
    return 1.0 / compliance if compliance else math.inf


def middle_stiffness(cylinder: Cylinder) -> float:
    """Return k (N/m) in the middle of the stroke."""
    return stiffness(cylinder, 0.5 * cylinder.max_stroke)
