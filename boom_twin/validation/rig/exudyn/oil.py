"""Oil springs of the Exudyn boom: what the oil shut in both chambers of a cylinder gives in over the stroke of its drive."""

from __future__ import annotations

import numpy as np

from ....scene.schema import Cylinder
from ....types import Array


def oil_stiffness(cylinder: Cylinder, strokes: Array) -> Array:
    """Stiffness (N/m) of a compressible cylinder with its drive at `strokes` (m), shape as `strokes`."""
    if cylinder.oil is None:
        assert cylinder.k is not None
        return np.full(strokes.shape, cylinder.k)
    oil = cylinder.oil
    piston, ring = np.pi * (oil.bore / 2) ** 2, np.pi * ((oil.bore / 2) ** 2 - (oil.rod / 2) ** 2)
    inside = np.clip(strokes, 0.0, cylinder.max_stroke)
    per_metre = [piston / (oil.cap_line / piston + inside), ring / (oil.rod_line / ring + cylinder.max_stroke - inside)]
    return np.asarray(oil.bulk_modulus * sum(per_metre))
