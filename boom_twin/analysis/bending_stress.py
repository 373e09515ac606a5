"""Bending moments and stresses at the stations of a boom, with what sensors know beyond the prediction, and their deviation.

The moment is EI times curvature. In the default basis the curvature at xi = s/length of a part is
sum_k P_k(2 xi - 1) q_k / length with Legendre polynomials P_k, and K_00 = EI / length is the part's stiffness (notes at
`boom_twin.kernels.elements.beam_shapes`). Three shapes so hold what weight spread along a part and forces at its ends do;
material damping is left out.

The force at the tip that only sensors know of (pump, wind, load) adds its static share, moment = influence times force, with
the deviation that the estimate gives that force; the boom's dynamic answer to it is left out. Stress is moment over section
modulus, of bending alone: no axial force, no notches, no welds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre

from ..compiler.compile import compile_scene
from ..compiler.plan import Plan
from ..errors import BoomTwinError, UsageError
from ..kernels.tables import Motion, State, Work
from ..kernels.transfer.clearance_pins import load_pins
from ..kernels.transfer.forward_kinematics import place
from ..kernels.transfer.riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out
from ..predictions import Estimate, Prediction
from ..scene.schema import Scene
from ..scene.segmentation import flexible_parts
from ..types import Array, StrokeReading
from .drive import drives_as_read
from .equilibrium import settle

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
    motion, last = Motion(0.0, 0.0, work.position.copy(), np.zeros_like(work.position)), len(t.operations)
    load_pins(t, state, work, motion)
    found = []
    for force in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)):
        clear_cut(work, FREE)
        work.p[0], work.p[1] = -force[0], -force[1]
        sweep_in(t, state, work, motion, state.drives[0], still, ROOT, last, FREE)
        sweep_out(t, state, work, ROOT, last, FREE)
        found.append(work.dz.copy())
    return np.column_stack([one - found[0] for one in found[1:]])


@dataclass(frozen=True)
class BendingStresses:
    """Bending moments and stresses at k stations at one instant."""

    moments: Array  # (k,), N m, positive where they bend the outer end up
    stresses: Array  # (k,), Pa, of the outermost fibre, with the sign of the moment
    stress_sigmas: Array  # standard deviations by the load at the tip, NaN without an estimate


def section_moduli(scene: Scene, places: Sequence[Station]) -> Array:
    """Return the section modulus 2 I / height at k stations, shape (k,), m^3.

    Heights are those of the scene, or those of thin-walled boxes.
    """
    return np.array([2.0 * (own.I or 0.0) / own.depth for own in (scene.sections[place.section] for place in places)])


class BendingStressModel:
    """Moments and stresses of a boom at its k `stations`, sample by sample; `moduli` (k,) are the section moduli there, m^3.

    `reads` says what the strokes of predictions are.
    """

    def __init__(self, scene: Scene, reads: StrokeReading = StrokeReading.LENGTH) -> None:
        self.stations: tuple[Station, ...] = stations(scene)
        if not self.stations:
            raise UsageError("sections: none of the scene is flexible, so it has no bending moments. Give a section a beam.")
        self.moduli = section_moduli(scene, self.stations)
        self._plan, self._reads = compile_scene(scene), reads
        self._by_unknowns = moments_by_unknowns(self._plan)
        self._state, self._work = self._plan.state(), self._plan.work()
        self._at, self._influence = np.full(len(scene.joints), np.inf), np.zeros((len(self.stations), 2))

    def influence(self, strokes: Array, joints: Array) -> Array:
        """Return the moment by the x and y of a force at the tip, shape (k, 2), m; NaN where there is no equilibrium.

        `strokes` (n,) are of the drives, m; `joints` (n,) are angles near those of the equilibrium, rad.
        """
        posture_step = 0.03  # m of stroke after which the influence of the tip's force is made anew
        if float(np.max(np.abs(strokes - self._at))) > posture_step:
            self._at = strokes.copy()
            try:
                settle(self._plan, self._state, self._work, strokes, joints)
            except BoomTwinError:
                self._influence = np.full_like(self._influence, np.nan)
            else:
                self._influence = self._by_unknowns @ increments_by_tip_force(self._plan, self._state, self._work)
        return self._influence

    def at(self, prediction: Prediction, estimate: Estimate | None) -> BendingStresses:
        """Return the stresses of one prediction and the estimate beside it, as a `boom_twin.types.Report` has both."""
        assert prediction.moments is not None
        influence = np.full((len(self.stations), 2), np.nan)
        if estimate is not None and estimate.load.any():  # until anything is measured it is exactly zero
            drives = drives_as_read(self._plan, prediction.strokes, prediction.cylinder_forces, self._reads)
            influence = self.influence(drives, prediction.joints)
        if estimate is None or np.isnan(influence).any():
            nothing = np.full(len(self.stations), np.nan)
            return BendingStresses(prediction.moments, prediction.moments / self.moduli, nothing)
        moments = prediction.moments + influence @ estimate.load
        sigmas = np.sqrt(influence**2 @ estimate.load_variance)
        return BendingStresses(moments, moments / self.moduli, sigmas / self.moduli)
