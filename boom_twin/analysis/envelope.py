"""Envelope of a boom at rest over its working range: deflection, forces, frequencies, moments and stresses by posture.

A grid over the ranges of the joints is coarse for many sections. So each extreme is searched by a bounded quasi-Newton method
from the best postures of the grid.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import minimize

from ..compiler.compile import compile_scene
from ..errors import SolverError
from ..scene.kinematics import posture_angles, rigid_chain, strokes_of_angles
from ..scene.schema import Scene
from ..types import Array
from .bending_stress import moments_by_unknowns, stations
from .equilibrium import settle
from .modal import natural_modes

FREQUENCY_COUNT = 3


@dataclass(frozen=True)
class Envelope:
    """A boom of n sections at rest in m postures."""

    names: tuple[str, ...]  # posture of the scene; empty for those of the grid and of the search
    angles: Array  # (m, n), section angles to the base, degrees
    tips: Array  # (m, 2), m
    deflections: Array  # (m,), distance of the tip from that of rigid sections and cylinders, m
    forces: Array  # (m, n), cylinder forces, N, positive in tension
    frequencies: Array  # (m, k), Hz, ascending, at most `FREQUENCY_COUNT`
    moments: Array  # (m, n), bending moment of largest size in each section, N m; NaN in sections without a beam
    stresses: Array  # (m, n), that size over the section modulus, Pa; NaN where the section has no beam or height
    skipped: dict[str, int]  # number of postures of scene and grid that are left out, by reason
    searched: int  # number of postures, the last ones, that the search found

    def posture(self, row: int) -> str:
        """Return a posture as ``--posture`` takes it: its name, or its section angles."""
        return self.names[row] or ",".join(f"{round(angle, 1) + 0.0:g}" for angle in self.angles[row].tolist())


def envelope(scene: Scene, progress: Callable[[int, int], None] = lambda done, total: None) -> Envelope:
    """Return the boom at rest in its named postures, on a grid over the ranges of its joints, and at the extremes.

    Postures out of a cylinder's travel, or without an equilibrium, are left out and counted. There is no ground, and sections
    may cross each other. SolverError if there is no posture with an equilibrium.
    """
    postures = [(name, posture_angles(scene, name)) for name in scene.postures] + [("", angles) for angles in _grid(scene)]
    boom = _Boom(scene)
    n, rows, names = len(scene.joints), [], []
    for number, (name, relative) in enumerate(postures, 1):
        if (row := boom.at_rest(relative)) is not None:
            rows.append(row)
            names.append(name)
        progress(number, len(postures))
    if not rows:
        raise SolverError(f"none of {len(postures)} postures has an equilibrium. Check masses, stiffnesses and range_deg.")
    skipped, grid = dict(boom.skipped), np.array(rows)
    extremes = [(k, sign) for k in range(n + 2, grid.shape[1]) if np.ptp(grid[:, k]) > 0.0 for sign in (-1.0, 1.0)]
    for number, (k, sign) in enumerate(extremes, 1):
        if (row := boom.extreme(grid, k, sign)) is not None:
            rows.append(row)
        progress(number, len(extremes))
    angles, tips, deflections, forces, moments, frequencies = np.split(np.array(rows), np.cumsum([n, 2, 1, n, n]), axis=1)
    moduli = np.array([section.section_modulus or np.nan for section in scene.sections])
    stresses, searched = np.abs(moments) / moduli, len(rows) - len(names)
    names += [""] * searched
    return Envelope(tuple(names), angles, tips, deflections[:, 0], forces, frequencies, moments, stresses, skipped, searched)


def _grid(scene: Scene) -> list[Array]:
    finest = 11  # angles of a joint
    most_postures = 700  # postures of the grid
    count = max(2, min(finest, int(most_postures ** (1.0 / len(scene.joints)) + 1e-9)))
    axes = [np.radians(np.linspace(*joint.range_deg, count)) for joint in scene.joints]
    return [np.array(angles) for angles in product(*axes)]


class _Boom:
    """A compiled boom that is brought to rest in one posture after the other; `skipped` counts those without a result."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._plan = scene, compile_scene(scene)
        self._state, self._work = self._plan.state(), self._plan.work()
        bending = with_stiff_beams(scene)
        self._bent = None if bending is scene else compile_scene(bending)
        self._bending = moments_by_unknowns(self._bent or self._plan)
        self._owners = np.array([station.section for station in stations(bending)], dtype=int)
        self._chain = np.array(scene.base.pivot), np.array([section.length for section in scene.sections])
        self._bounds = np.radians([joint.range_deg for joint in scene.joints])
        self.skipped = dict.fromkeys(("out of a cylinder's travel", "no equilibrium"), 0)

    def at_rest(self, relative: Array, modes: int = FREQUENCY_COUNT) -> Array | None:
        """Return section angles (deg), tip, deflection, forces, moments and frequencies in one row, None at no rest."""
        frequency_accuracy = 1e-5  # relative accuracy of frequencies
        scene, plan, state, work = self._scene, self._plan, self._state, self._work
        strokes = strokes_of_angles(scene, relative)
        if not all(0.0 <= s <= joint.cylinder.max_stroke for s, joint in zip(strokes, scene.joints, strict=True)):
            self.skipped["out of a cylinder's travel"] += 1
            return None
        try:
            settle(plan, state, work, strokes, relative)
            bent = self._bent_unknowns(strokes, relative)
            found = natural_modes(plan, state, work, modes, frequency_accuracy) if modes else ()
        except SolverError:
            self.skipped["no equilibrium"] += 1
            return None
        tip, (headings, pivots) = state.frames[-1, :2], rigid_chain(*self._chain, relative)
        forces = plan.observed(state).cylinder_forces
        moments = _largest(self._bending @ bent, self._owners, plan.joints)
        deflection, frequencies = np.hypot(*(tip - pivots[-1])), [mode.frequency for mode in found]
        return np.concatenate([np.degrees(headings), tip, [deflection], forces, moments, frequencies])

    def _bent_unknowns(self, strokes: Array, relative: Array) -> Array:
        """Return the unknowns, at rest, of the boom in which every section with a beam bends."""
        if self._bent is None:
            return self._state.z
        state = self._bent.state()
        settle(self._bent, state, self._bent.work(), strokes, relative)
        return state.z

    def extreme(self, grid: Array, k: int, sign: float) -> Array | None:
        """Return the row of largest ``sign * row[k]`` that is found from the best of `grid`; None if none is better."""
        gain = 1e-4  # relative gain by which a step of the search must better the extreme
        search_step = 1e-3  # of the search's differences, rad
        starts = 5  # best postures of the grid from which each extreme is searched
        n, values = len(self._bounds), -sign * grid[:, k]
        modes = FREQUENCY_COUNT if k >= 3 + 3 * n else 0
        best, found = values.min(), None

        def lacking(relative: Array) -> float:
            """Return what is minimised; the worst of the grid where there is no rest."""
            nonlocal best, found
            row = self.at_rest(relative, modes)
            value = values.max() if row is None else -sign * row[k]
            if value < best:
                best, found = value, relative.copy()
            return float(value)

        for start in np.argsort(values)[:starts]:
            relative = np.diff(np.radians(grid[start, :n]), prepend=0.0)
            minimize(lacking, relative, method="L-BFGS-B", bounds=self._bounds, options={"eps": search_step, "ftol": gain})
        return None if found is None else self.at_rest(found)


def _largest(values: Array, owners: Array, count: int) -> Array:
    return np.array([max(values[owners == owner], key=abs, default=np.nan) for owner in range(count)])


def with_stiff_beams(scene: Scene) -> Scene:
    """Return the scene with nearly rigid beams instead of rigid ones, so that their moments are among the unknowns.

    The limit of growing EI and EA is the rigid beam, with the same moments. `scene` itself, if no beam is rigid.
    """
    stiffer, shapes = 1e4, 3
    sections = tuple(
        section.model_copy(update={"modes": shapes, "axial": False, "I": stiffer * section.I, "A": stiffer * section.A})
        if section.beam is not None and section.I is not None and section.A is not None and not scene.is_flexible(i)
        else section
        for i, section in enumerate(scene.sections)
    )
    return scene if sections == scene.sections else scene.model_copy(update={"sections": sections})
