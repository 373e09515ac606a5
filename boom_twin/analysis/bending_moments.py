"""Bending moments of the flexible parts, from their bending coordinates: M = EI times curvature.

In the default basis the curvature at xi = s/length of a part is sum_k P_k(2 xi - 1) q_k / length with Legendre polynomials P_k,
and K_00 = EI / length is the part's stiffness (notes at `boom_twin.kernels.elements.beam_shapes`). Three shapes so hold
what weight spread along a part and forces at its ends do; material damping is left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre

from ..compiler.plan import Plan
from ..kernels.tables import Motion, State, Work
from ..kernels.transfer.clearance_pins import load_pins
from ..kernels.transfer.forward_kinematics import place
from ..kernels.transfer.riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out
from ..scene.schema import Scene
from ..scene.segmentation import flexible_parts
from ..types import Array

PLACES = (0.0, 0.5, 1.0)  # places of the stations of a part, over its length


@dataclass(frozen=True, slots=True)
class Station:
    """A cross-section: of which section (0-based), and how far from its inboard pivot (m).

    Where parts meet at a split, the moment may jump: one is ``inboard`` of it and one ``outboard``: its `side`, else empty.
    """

    section: int
    place: float
    side: str = ""

    @property
    def name(self) -> str:
        """Section and place in words."""
        return f"section {self.section + 1} at {self.place:.2f} m" + (f", {self.side} of the split" if self.side else "")

    @property
    def key(self) -> str:
        """Section and place as a part of column names: ``section_1_at_0.60`` or ``section_1_at_5.92_outboard``."""
        return f"section_{self.section + 1}_at_{self.place:.2f}" + (f"_{self.side}" if self.side else "")


def stations(scene: Scene) -> tuple[Station, ...]:
    """The stations of all flexible parts, base to tip."""
    found = [
        Station(index, start + at * (stop - start))
        for index in range(len(scene.sections))
        for start, stop in flexible_parts(scene, index)
        for at in PLACES
    ]
    for number, (one, other) in enumerate(pairwise(found)):
        if one.section == other.section and f"{one.place:.2f}" == f"{other.place:.2f}":
            found[number], found[number + 1] = replace(one, side="inboard"), replace(other, side="outboard")
    return tuple(found)


def moments_by_unknowns(plan: Plan) -> Array:
    """Return bending moments (N m) at the stations by the unknowns, (stations, unknowns); positive: outboard end bent up."""
    tables = plan.tables
    found = np.zeros((len(PLACES) * len(tables.beams), len(plan.names)))
    for part, row in enumerate(tables.beams):
        shapes = legendre.legvander(2.0 * np.array(PLACES) - 1.0, int(row.bending) - 1)
        rows = slice(len(PLACES) * part, len(PLACES) * (part + 1))
        found[rows, row.z : row.z + row.bending] = tables.stiffness[part, 0, 0] * shapes
    return found


def increments_by_tip_force(plan: Plan, state: State, work: Work) -> Array:
    """Return increments of the unknowns by x and y of a force at the tip (N) at rest, (unknowns, 2); `state` is kept."""
    t, still = plan.tables, np.zeros(plan.joints)
    place(t, state, work)
    motion, last = Motion(0.0, 0.0, work.position.copy(), np.zeros_like(work.position)), np.int64(len(t.operations))
    load_pins(t, state, work, motion)
    found = []
    for force in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)):
        clear_cut(work, FREE)
        work.p[0], work.p[1] = -force[0], -force[1]
        sweep_in(t, state, work, motion, state.drives[0], still, ROOT, last, FREE)
        sweep_out(t, state, work, ROOT, last, FREE)
        found.append(work.dz.copy())
    return np.column_stack([one - found[0] for one in found[1:]])
