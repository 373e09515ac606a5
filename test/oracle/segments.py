"""The finite-segment boom of `boom_twin.peers`, in one place for the tests."""

from boom_twin.peers.pieces import link_headings
from boom_twin.peers.rest import cylinder_forces, energy, equilibrium, extrapolated, mass_matrix, statics
from boom_twin.peers.segments import Segments

__all__ = [
    "Segments", "cylinder_forces", "energy", "equilibrium", "extrapolated", "link_headings", "mass_matrix", "statics",
]  # fmt: skip
