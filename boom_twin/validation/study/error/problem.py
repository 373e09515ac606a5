"""Problem of the error study: motion, references and virtual rig."""

from __future__ import annotations

import contextlib
import io
import sys
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from ....analysis.methods import Motion, integrate_with
from ....errors import BoomTwinError
from ....scene.schema import Scene
from ....types import Array
from ..scene_changes import with_modes
from .cases import STEPS


def load_rig() -> tuple[ModuleType | None, str]:
    """Return `boom_twin.validation.rig`, or None and the reason. Prefer Exudyn's build without range checks."""
    if "exudyn" not in sys.modules:
        sys.exudynFast = True  # type: ignore[attr-defined]  # read by Exudyn
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return import_module("boom_twin.validation.rig"), ""
    except BoomTwinError as missing:
        return None, str(missing)


def build() -> str:
    """Return the loaded build of Exudyn in words."""
    return "without range checks" if "exudyn.exudynCPPfast" in sys.modules else "with range checks"


ROW = STEPS[-1]  # s between compared instants
OWN_MODES, OWN_STEP = (6, 8), (2.5e-4, 1.25e-4)
ELEMENTS, EXUDYN_STEP = (16, 32), (5e-4, 2.5e-4)
SHEAR_OVER_AXIAL = 160.0  # nearly rigid in shear, as in the scene


@dataclass(frozen=True)
class Path:
    """Tip (m) and its acceleration (m/s^2) at the compared instants, each of shape (m, 2)."""

    tip: Array
    acceleration: Array

    def away(self, other: Path) -> tuple[float, float]:
        """Return rms differences from `other`: tip (mm), acceleration (over that of `other`)."""
        return 1e3 * rms(self.tip - other.tip), rms(self.acceleration - other.acceleration) / rms(other.acceleration)


@dataclass(frozen=True)
class Reference:
    """Path with its estimated errors: tip (mm), acceleration (relative)."""

    path: Path
    tip_mm: float
    acceleration: float
    what: str


@dataclass(frozen=True)
class Problem:
    """A scene in motion with its references. `exudyn` may be None; `missing` is the reason."""

    scene: Scene
    motion: Motion
    own: Reference
    exudyn: Reference | None
    missing: str

    @property
    def apart(self) -> tuple[float, float] | None:
        """Return the difference of the references: tip (mm), acceleration (relative)."""
        return None if self.exudyn is None else self.own.path.away(self.exudyn.path)

    def errors(self, path: Path) -> tuple[tuple[float, float], tuple[float, float] | None]:
        """Return the errors of `path` against the own and the independent reference."""
        return path.away(self.own.path), None if self.exudyn is None else path.away(self.exudyn.path)


def rms(vectors: Array) -> float:
    """Return the root mean square length of `vectors`, shape (m, 2)."""
    return float(np.sqrt(np.mean(np.sum(np.square(vectors), axis=-1))))


def pose(scene: Scene, motion: Motion, quick: bool) -> Problem:
    """Return the problem with its references. If `quick`, they have fewer elements and longer steps."""
    rig, missing = load_rig()
    independent = None
    if rig is not None:
        try:
            independent = _independent(rig, scene, motion, quick)
        except BoomTwinError as failure:
            missing = str(failure)
    return Problem(scene, motion, _own(scene, motion, quick), independent, missing)


def every(step: float) -> int:
    """Return the number of steps between compared instants."""
    return round(ROW / step)


def _own(scene: Scene, motion: Motion, quick: bool) -> Reference:
    """Return the reference of boom_twin. Its error is estimated by fewer modes and a doubled step."""
    coarse, fine = OWN_STEP if not quick else (1e-3, 5e-4)
    paths = []
    for modes, step in ((OWN_MODES[1], fine), (OWN_MODES[0], fine), (OWN_MODES[1], coarse)):
        found = integrate_with(with_modes(scene, modes), motion, motion.duration, step, every(step), angles=motion.angles)
        paths.append(Path(found.tip, found.tip_acceleration))
    shape, time = paths[1].away(paths[0]), paths[2].away(paths[0])
    what = f"boom_twin, {OWN_MODES[1]} modes, step {1e3 * fine:g} ms"
    return Reference(paths[0], shape[0] + time[0] / 3.0, shape[1] + time[1] / 3.0, what)


def _independent(rig: Any, scene: Scene, motion: Motion, quick: bool) -> Reference:
    """Return the reference of Exudyn, extrapolated in elements and steps (both of second order).

    The extrapolation adds the error of the finer runs. A tenth of it is taken as the remaining error.
    """
    (few, many), (coarse, fine) = (ELEMENTS, EXUDYN_STEP) if not quick else ((8, 16), (2e-3, 1e-3))
    paths = {}
    for elements, steps in ((few, (coarse, fine)), (many, (coarse,))):
        resting = at_rest(rig, scene, motion.first, elements, lumped=False)
        for step in steps:
            rows, _ = rig.move(resting, motion, motion.duration, step, ROW)
            paths[elements, step] = path_of(rows)
    a, finer, longer = paths[few, coarse], paths[few, fine], paths[many, coarse]
    best = Path(
        _extrapolated(a.tip, finer.tip, longer.tip),
        _extrapolated(a.acceleration, finer.acceleration, longer.acceleration),
    )
    added = longer.away(best)
    what = f"Exudyn, extrapolated from {few} and {many} elements a section and steps of {1e3 * coarse:g} and {1e3 * fine:g} ms"
    return Reference(best, 0.1 * added[0], 0.1 * added[1], what)


def at_rest(rig: Any, scene: Scene, strokes: Array, elements: int, lumped: bool) -> Any:
    """Return Exudyn's boom at rest without shear, with nodally exact beams; see `rig.at_rest`."""
    return rig.at_rest(scene, strokes, elements, nodally_exact=True, lumped=lumped, shear_over_axial=SHEAR_OVER_AXIAL)


def _extrapolated(coarse: Array, finer: Array, longer: Array) -> Array:
    """Return the Richardson extrapolation: `finer` halves the step of `coarse`, `longer` doubles its elements."""
    return longer + (longer - coarse) / 3.0 + 4.0 * (finer - coarse) / 3.0


def path_of(rows: dict[str, Array]) -> Path:
    """Return the path from the columns of an Exudyn simulation."""
    return Path(
        np.column_stack([rows["tip_x_m"], rows["tip_y_m"]]), np.column_stack([rows["tip_ax_m_s2"], rows["tip_ay_m_s2"]])
    )
