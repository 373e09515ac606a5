"""Builds tables row by row and hands out places among the unknowns and histories."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..chain import program
from ..physics.beam import BEAM as BEAM_ROW
from ..physics.contact import CLEARANCE
from ..physics.cylinder import CYLINDER, CYLINDER_PART
from ..physics.linkage import LINKAGE

DTYPES = {
    "operations": program.OPERATION,
    "joints": program.JOINT,
    "linkages": LINKAGE,
    "links": program.LINK,
    "offsets": program.OFFSET_ROW,
    "bodies": program.BODY_ROW,
    "beams": BEAM_ROW,
    "outlets": program.OUTLET,
    "cylinders": CYLINDER,
    "parts": CYLINDER_PART,
    "clearances": CLEARANCE,
}


@dataclass
class Layout:
    """Rows so far, names of the unknowns, and of every history of a mass point its inertia and its weight.

    Inertia in kg or kg m^2, weight in N along x or y. Histories of the unknowns come first, so places of histories shift by
    their number in `table`.
    """

    rows: dict[str, list[dict[str, Any]]] = field(default_factory=lambda: {name: [] for name in DTYPES})
    names: list[str] = field(default_factory=list)
    masses: list[float] = field(default_factory=list)
    weights: list[float] = field(default_factory=list)

    def add(self, table: str, **values: Any) -> int:
        """Append a row; returns its index."""
        self.rows[table].append(values)
        return len(self.rows[table]) - 1

    def operate(self, kind: int, row: int) -> None:
        """Append an operation along the chain."""
        self.add("operations", kind=kind, row=row)

    def unknowns(self, names: list[str]) -> int:
        """Places for unknowns of these names; returns the first."""
        self.names.extend(names)
        return len(self.names) - len(names)

    def histories(self, masses: list[float], weights: list[float]) -> int:
        """Places for histories of mass points, counted from the first one behind the unknowns; returns the first."""
        self.masses.extend(masses)
        self.weights.extend(weights)
        return len(self.masses) - len(masses)

    def table(self, name: str) -> np.recarray:
        """The finished table, possibly of length 0."""
        rows = np.zeros(len(self.rows[name]), DTYPES[name])
        for i, values in enumerate(self.rows[name]):
            for key, value in values.items():
                rows[key][i] = value + len(self.names) if key in ("history", "turn") else value
        return rows.view(np.recarray)
