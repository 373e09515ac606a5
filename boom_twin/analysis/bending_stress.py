"""Bending moments and stresses at the stations of a boom, with what sensors know beyond the prediction, and their deviation.

The prediction's moment at a station is EI times curvature. The force at the tip that only sensors know of (pump, wind, load)
adds its static share, moment = influence times force, with the deviation that the estimate gives that force; the boom's
dynamic answer to it is left out. Stress is moment over section modulus, of bending alone: no axial force, no notches, no welds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compiler.compile import compile_scene
from ..errors import BoomTwinError, UsageError
from ..predictions import Estimate, Prediction
from ..scene.schema import Scene
from ..types import Array, StrokeReading
from .bending_moments import Station, increments_by_tip_force, moments_by_unknowns, stations
from .cylinder_drives import drives_as_read
from .equilibrium import settle

POSTURE_STEP = 0.03  # m of stroke after which the influence of the tip's force is made anew


@dataclass(frozen=True)
class BendingStresses:
    """Bending moments and stresses at k stations at one instant."""

    moments: Array  # (k,), N m, positive where they bend the outer end up
    moment_sigmas: Array  # standard deviations by the load at the tip, NaN without an estimate
    stresses: Array  # (k,), Pa, of the outermost fibre, with the sign of the moment
    stress_sigmas: Array  # their standard deviations


def section_moduli(scene: Scene, heights: Array | None = None) -> Array:
    """Return the section modulus 2 I / height of every section, shape (n,), m^3; NaN of a rigid one.

    `heights` (n,) are outer heights, m. By default they are those of the scene, or those of thin-walled boxes.
    """
    found = np.full(len(scene.sections), np.nan)
    for i, section in enumerate(scene.sections):
        if scene.is_flexible(i):
            assert section.I is not None
            found[i] = 2.0 * section.I / (section.depth if heights is None else heights[i])
    return found


class BendingStressModel:
    """Moments and stresses of a boom at its k `stations`, sample by sample; `moduli` (k,) are the section moduli there, m^3.

    For `heights` see `section_moduli`; `reads` says what the strokes of predictions are.
    """

    def __init__(self, scene: Scene, heights: Array | None = None, reads: StrokeReading = StrokeReading.LENGTH) -> None:
        self.stations: tuple[Station, ...] = stations(scene)
        if not self.stations:
            raise UsageError("sections: none of the scene is flexible, so it has no bending moments. Give a section a beam.")
        self.moduli = section_moduli(scene, heights)[[station.section for station in self.stations]]
        self._plan, self._reads = compile_scene(scene), reads
        self._by_unknowns = moments_by_unknowns(self._plan)
        self._state, self._work = self._plan.state(), self._plan.work()
        self._at, self._influence = np.full(len(scene.joints), np.inf), np.zeros((len(self.stations), 2))

    def influence(self, strokes: Array, joints: Array) -> Array:
        """Return the moment by the x and y of a force at the tip, shape (k, 2), m; NaN where there is no equilibrium.

        `strokes` (n,) are of the drives, m; `joints` (n,) are angles near those of the equilibrium, rad.
        """
        if float(np.max(np.abs(strokes - self._at))) > POSTURE_STEP:
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
            return BendingStresses(prediction.moments, nothing, prediction.moments / self.moduli, nothing)
        moments = prediction.moments + influence @ estimate.load
        sigmas = np.sqrt(influence**2 @ estimate.load_variance)
        return BendingStresses(moments, sigmas, moments / self.moduli, sigmas / self.moduli)
