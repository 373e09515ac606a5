"""The finite-segment boom of `boom_twin.validation.reference.segments`, in one place for the tests."""

from boom_twin.validation.reference.segments.boom import Segments
from boom_twin.validation.reference.segments.equilibrium import (
    cylinder_forces,
    energy,
    equilibrium,
    extrapolated,
    mass_matrix,
    statics,
)
from boom_twin.validation.reference.segments.geometry import link_headings

__all__ = [
    "Segments", "cylinder_forces", "energy", "equilibrium", "extrapolated", "link_headings", "mass_matrix", "statics",
]  # fmt: skip
