"""Runs of the error study: ways of stepping the boom here and in Exudyn, the references, and the errors against them."""

from __future__ import annotations

import contextlib
import io
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib import import_module
from itertools import product
from types import ModuleType
from typing import Any

import numpy as np

from ...analysis.methods import Method, Motion, integrate_with
from ...compiler.compile import BasisName
from ...scene.schema import Scene
from ...types import Array
from .scenes import with_modes

STEPS = (2.5e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 4e-2)  # s; every one divides the longest
INTEGRATORS = (
    *(Method(parameter=rho) for rho in (0.0, 0.5, 0.9, 1.0)),
    Method("newmark", 0.5),
    Method("newmark", 0.6),
    Method("wilson", 1.4),
    Method("houbolt", 0.0),
    Method("park", 0.0),
)
LUMPED_ELEMENTS = (1, 2, 3, 4)
LUMPED_SCHEMES = ((1, 1e-3), (1, 5e-4), (1, 3e-4), (2, 3e-3), (2, 1e-3), (0, 1e-3))  # passes with a kept tangent, tolerance


@dataclass(frozen=True)
class Own:
    """The transfer-matrix boom; `modes` None keeps the scene's."""

    step: float = 1e-3
    method: Method = field(default_factory=Method)
    modes: int | None = None
    basis: BasisName = "end-shapes"
    axial: bool = True
    geometric: bool = True

    @property
    def label(self) -> str:
        """Return all settings but the step."""
        method, scheme = self.method, self.method.integrator
        if scheme in ("generalised-alpha", "newmark", "wilson"):
            scheme += f" {method.parameter:g}"
        parts = [scheme]
        parts += [] if self.modes is None else [f"{self.modes} modes" if self.modes > 1 else "1 mode"]
        parts += ["cantilever modes"] if self.basis == "cantilever" else []
        parts += ["one pass"] if method.passes == 1 else []
        parts += ["plain product"] if method.product == "plain" else []
        parts += [] if self.axial else ["no axial coordinate"]
        parts += [] if self.geometric else ["no geometric stiffness"]
        return ", ".join(parts)

    def scene(self, scene: Scene) -> Scene:
        """Return the scene as this case models it; sections that the scene makes rigid stay so."""
        changed = scene if self.modes is None else with_modes(scene, self.modes)
        parts = {"axial": self.axial and scene.axial, "geometric": self.geometric and scene.geometric}
        return changed if all(parts.values()) else changed.model_copy(update=parts)


PAPERS = Own(method=Method("newmark", 0.5, passes=1, product="plain"), modes=3, basis="cantilever")
"""The papers' way: Newmark, one linearised pass, the plain product, three cantilever modes."""
VARIANTS = (
    *(Own(method=method) for method in INTEGRATORS),
    Own(method=Method(passes=1)),
    Own(method=Method(product="plain")),
    PAPERS,
    *(Own(modes=modes, basis=basis) for modes in range(1, 7) for basis in ("end-shapes", "cantilever")),
    *(Own(axial=axial, geometric=geometric) for axial, geometric in ((False, True), (True, False), (False, False))),
    *(Own(modes=modes, method=Method(passes=1)) for modes in (1, 2)),
)
FEW_VARIANTS = (Own(method=Method("newmark", 0.6)), Own(method=Method(passes=1)), Own(modes=1))


@dataclass(frozen=True)
class Peer:
    """Exudyn's geometrically exact beams, generalised-alpha; see `rig.Scheme` for `kept`, `rig.linkages` for `lumped`."""

    step: float
    elements: int
    kept: int
    tolerance: float
    lumped: bool = True

    @property
    def model(self) -> str:
        return f"Exudyn, {self.elements} element{'s' if self.elements > 1 else ''}{', lumped' if self.lumped else ''}"

    @property
    def label(self) -> str:
        """Return all settings but the step."""
        times = {0: "anew", 1: "kept for 1 pass"}.get(self.kept, f"kept for {self.kept} passes")
        return f"{self.model}, tangent {times}, tolerance {self.tolerance:g}"


Case = Own | Peer


def own_cases(scene: Scene, quick: bool) -> list[Own]:
    """Return every variant of the default at every step; the default itself first, and only once."""
    variants = FEW_VARIANTS if quick else VARIANTS
    kept = [variant for variant in variants if replace(variant, modes=None) != Own() or variant.scene(scene) != scene]
    return [replace(variant, step=step) for variant in (Own(), *kept) for step in (STEPS[2:6] if quick else STEPS)]


def peer_cases(quick: bool) -> list[Peer]:
    """Return elements and steps with every way to solve a step that may be the fastest; bodies for all parts where it shows."""
    if quick:
        return [Peer(step, elements, *LUMPED_SCHEMES[0]) for elements in LUMPED_ELEMENTS[1::2] for step in STEPS[2:6]]
    lumped = product(LUMPED_ELEMENTS, LUMPED_SCHEMES, STEPS[2:], (True,))
    whole = product((4, 8, 16), ((1, 1e-4), (2, 1e-3), (0, 1e-3)), STEPS[1:], (False,))
    return [Peer(step, n, kept, tolerance, lumps) for n, (kept, tolerance), step, lumps in (*lumped, *whole)]


def load_rig() -> ModuleType:
    """Return `boom_twin.validation.rig`, with Exudyn's build without range checks; BoomTwinError without Exudyn."""
    if "exudyn" not in sys.modules:
        sys.exudynFast = True  # type: ignore[attr-defined]  # read by Exudyn
    with contextlib.redirect_stdout(io.StringIO()):
        return import_module("boom_twin.validation.rig")


def build() -> str:
    return "without range checks" if "exudyn.exudynCPPfast" in sys.modules else "with range checks"


ROW = STEPS[-1]  # s between compared instants


@dataclass(frozen=True)
class TipPath:
    """Tip (m) and its acceleration (m/s^2) at the compared instants, each of shape (m, 2)."""

    tip: Array
    acceleration: Array

    def away(self, other: TipPath) -> tuple[float, float]:
        """Return rms differences from `other`: tip (mm), acceleration (over that of `other`)."""
        return 1e3 * rms(self.tip - other.tip), rms(self.acceleration - other.acceleration) / rms(other.acceleration)


@dataclass(frozen=True)
class Reference:
    """TipPath with its estimated errors: tip (mm), acceleration (relative)."""

    path: TipPath
    tip_mm: float
    acceleration: float
    what: str


@dataclass(frozen=True)
class Problem:
    """A scene in motion with its references: that of boom_twin and the independent one."""

    scene: Scene
    motion: Motion
    own: Reference
    exudyn: Reference

    @property
    def apart(self) -> tuple[float, float]:
        """Return the difference of the references: tip (mm), acceleration (relative)."""
        return self.own.path.away(self.exudyn.path)


def rms(vectors: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(np.square(vectors), axis=-1))))


def pose(scene: Scene, motion: Motion, quick: bool) -> Problem:
    """Return the problem with its references. If `quick`, they have fewer elements and longer steps."""
    independent = _independent(load_rig(), scene, motion, quick)
    return Problem(scene, motion, _own(scene, motion, quick), independent)


def every(step: float) -> int:
    return round(ROW / step)


def _own(scene: Scene, motion: Motion, quick: bool) -> Reference:
    """Return the reference of boom_twin. Its error is estimated by fewer modes and a doubled step."""
    coarse, fine = (1e-3, 5e-4) if quick else (2.5e-4, 1.25e-4)
    paths = []
    for modes, step in ((8, fine), (6, fine), (8, coarse)):
        found = integrate_with(with_modes(scene, modes), motion, motion.duration, step, every(step), angles=motion.angles)
        paths.append(TipPath(found.tip, found.tip_acceleration))
    shape, time = paths[1].away(paths[0]), paths[2].away(paths[0])
    what = f"boom_twin, 8 modes, step {1e3 * fine:g} ms"
    return Reference(paths[0], shape[0] + time[0] / 3.0, shape[1] + time[1] / 3.0, what)


def _independent(rig: Any, scene: Scene, motion: Motion, quick: bool) -> Reference:
    """Return the reference of Exudyn, extrapolated in elements and steps (both of second order).

    The extrapolation adds the error of the finer runs. A tenth of it is taken as the remaining error.
    """
    (few, many), (coarse, fine) = ((8, 16), (2e-3, 1e-3)) if quick else ((16, 32), (5e-4, 2.5e-4))
    paths = {}
    for elements, steps in ((few, (coarse, fine)), (many, (coarse,))):
        resting = at_rest(rig, scene, motion.first, elements, lumped=False)
        for step in steps:
            rows, _ = rig.move(resting, motion, motion.duration, step, ROW)
            paths[elements, step] = TipPath(rows["tip"], rows["tip_acc"])
    a, finer, longer = paths[few, coarse], paths[few, fine], paths[many, coarse]
    best = TipPath(
        _extrapolated(a.tip, finer.tip, longer.tip),
        _extrapolated(a.acceleration, finer.acceleration, longer.acceleration),
    )
    added = longer.away(best)
    what = f"Exudyn, extrapolated from {few} and {many} elements a section and steps of {1e3 * coarse:g} and {1e3 * fine:g} ms"
    return Reference(best, 0.1 * added[0], 0.1 * added[1], what)


def at_rest(rig: Any, scene: Scene, strokes: Array, elements: int, lumped: bool) -> Any:
    """Return Exudyn's boom at rest without shear, with nodally exact beams; see `rig.at_rest`."""
    return rig.at_rest(scene, strokes, elements, nodally_exact=True, lumped=lumped, shear_over_axial=160.0)


def _extrapolated(coarse: Array, finer: Array, longer: Array) -> Array:
    """Return the Richardson extrapolation: `finer` halves the step of `coarse`, `longer` doubles its elements."""
    return longer + (longer - coarse) / 3.0 + 4.0 * (finer - coarse) / 3.0


REPEATS = 3  # of a run in each round; one of Exudyn that takes 0.5 s is not repeated in a round, one of 2 s in no other


@dataclass(frozen=True)
class Row:
    """Result of one case; NaN where it failed. Errors are rms, against the own and the independent reference."""

    case: Case
    own_mm: float = math.nan  # of the tip
    own_acceleration: float = math.nan  # of the tip, relative
    independent_mm: float = math.nan
    independent_acceleration: float = math.nan
    seconds: float = math.nan  # CPU time of the stepping alone per simulated second
    steps: int = 0
    passes: float = math.nan  # of Newton's method per step
    status: str = "ok"  # or why there are no numbers

    @property
    def tip_mm(self) -> float:
        """Return the larger of both errors: no program is judged by itself alone."""
        return float(np.fmax(self.own_mm, self.independent_mm))

    @property
    def acceleration(self) -> float:
        return float(np.fmax(self.own_acceleration, self.independent_acceleration))

    @property
    def good(self) -> bool:
        """Return True if the case went through to finite numbers."""
        return self.status == "ok" and math.isfinite(self.own_mm) and math.isfinite(self.seconds)


class Runner:
    """Runs cases on one problem; booms of Exudyn that are at rest are kept and moved again."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.resting: dict[tuple[int, bool], Any] = {}

    def rows(self, cases: list[Case], rounds: int, tick: Callable[[], object]) -> list[Row]:
        """Return a row for every case, in their order; `tick` is called after each case of each of the `rounds`."""
        found = dict[Case, Row]()
        for turn in range(rounds):
            for case in cases:
                if turn == 0:
                    found[case] = self.row(case)
                elif (row := found[case]).good and (isinstance(case, Own) or row.seconds * self.problem.motion.duration < 2.0):
                    found[case] = replace(row, seconds=min(row.seconds, self.row(case).seconds))
                tick()
        return list(found.values())

    def row(self, case: Case) -> Row:
        """Run one case once. Whatever it raises becomes its status."""
        try:
            return self._own(case) if isinstance(case, Own) else self._exudyn(case)
        except Exception as failure:  # a report on methods must survive every one of them
            text = " ".join(str(failure).split()) or "no reason was given"
            return Row(case, status=f"{type(failure).__name__}: {text}"[:300])

    def _own(self, case: Own) -> Row:
        motion, scene = self.problem.motion, case.scene(self.problem.scene)
        rest = motion.duration, case.step, every(case.step), case.method, case.basis, motion.angles
        found = min((integrate_with(scene, motion, *rest) for _ in range(REPEATS)), key=lambda run: run.seconds)
        path = TipPath(found.tip, found.tip_acceleration)
        return self._row(case, path, found.seconds, found.steps, found.passes, found.status)

    def _exudyn(self, case: Peer) -> Row:
        rig = load_rig()
        motion, boom = self.problem.motion, (case.elements, case.lumped)
        if boom not in self.resting:
            self.resting[boom] = at_rest(rig, self.problem.scene, motion.first, *boom)
        scheme = rig.Scheme(kept=case.kept, tolerance=case.tolerance)
        efforts: list[Any] = []
        while not efforts or (len(efforts) < REPEATS and efforts[-1].seconds < 0.5):
            rows, effort = rig.move(self.resting[boom], motion, motion.duration, case.step, ROW, scheme)
            efforts.append(effort)
        best, count = min(efforts, key=lambda effort: effort.seconds), round(motion.duration / case.step)
        return self._row(case, TipPath(rows["tip"], rows["tip_acc"]), best.seconds, count, best.passes / count)

    def _row(self, case: Case, path: TipPath, seconds: float, steps: int, passes: float, status: str = "ok") -> Row:
        own, independent = (path.away(reference.path) for reference in (self.problem.own, self.problem.exudyn))
        return Row(case, *own, *independent, seconds / self.problem.motion.duration, steps, passes, status)
