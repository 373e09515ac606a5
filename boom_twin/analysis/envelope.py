"""Envelope of a boom at rest over its working range: deflection, forces, frequencies, moments and stresses by posture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..compiler.compile import compile_scene
from ..compiler.plan import Plan, first_row, taken_apart
from ..errors import SolverError
from ..scene.kinematics import posture_angles, skeleton, stroke_curve
from ..scene.schema import Scene
from ..types import Array
from .bending_moments import moments_by_unknowns, stations
from .equilibrium import settle
from .modal import natural_modes

MOST = 700  # postures of the grid
FINEST = 11  # angles of a joint
MODES = 3
WIDTH = 1e-5  # relative accuracy of frequencies


@dataclass(frozen=True)
class Envelope:
    """A boom of n sections at rest in m postures.

    Attributes
    ----------
    names : tuple of str
        Of the scene's postures; empty for those of the grid.
    angles : ndarray, shape (m, n)
        Section angles to the base, degrees.
    tips : ndarray, shape (m, 2)
        m.
    deflections : ndarray, shape (m,)
        Distance of the tip from that of rigid sections and cylinders, m.
    forces : ndarray, shape (m, n)
        Of the cylinders, N, positive in tension.
    frequencies : ndarray, shape (m, k)
        Hz, ascending, at most `MODES`.
    moments : ndarray, shape (m, n)
        The bending moment of largest size in each section, N m; 0 in rigid ones.
    stresses : ndarray, shape (m, n)
        Size of that over the section modulus, Pa; NaN where the section has no height.
    skipped : dict of str to int
        How many postures are left out, by reason.
    """

    names: tuple[str, ...]
    angles: Array
    tips: Array
    deflections: Array
    forces: Array
    frequencies: Array
    moments: Array
    stresses: Array
    skipped: dict[str, int]

    def posture(self, row: int) -> str:
        """A posture in words: its name, or its section angles."""
        return self.names[row] or "[" + ", ".join(f"{round(angle)}" for angle in self.angles[row].tolist()) + "]"


def envelope(scene: Scene, progress: Callable[[int, int], None] = lambda done, total: None) -> Envelope:
    """The boom at rest in its named postures and on a grid over the ranges of its joints.

    Parameters
    ----------
    scene : Scene
    progress : callable, optional
        Told after every posture how many of how many are done.

    Returns
    -------
    Envelope
        Postures out of a cylinder's travel, or without an equilibrium, are left out and counted. There is no ground, and
        sections may cross each other.

    Raises
    ------
    SolverError
        There is no posture with an equilibrium.
    """
    postures = [(name, posture_angles(scene, name)) for name in scene.postures] + [("", angles) for angles in _grid(scene)]
    plan = compile_scene(scene)
    bending, owners = moments_by_unknowns(plan), np.array([station.section for station in stations(scene)], dtype=int)
    rows, names, skipped = [], [], dict.fromkeys(("out of a cylinder's travel", "no equilibrium"), 0)
    for number, (name, relative) in enumerate(postures, 1):
        strokes = np.array([stroke_curve(scene, i, relative[i : i + 1])[0] for i in range(plan.joints)])
        if not all(0.0 <= s <= joint.cylinder.max_stroke for s, joint in zip(strokes, scene.joints, strict=True)):
            skipped["out of a cylinder's travel"] += 1
        else:
            try:
                rows.append(_at_rest(scene, plan, strokes, relative, bending, owners))
                names.append(name)
            except SolverError:
                skipped["no equilibrium"] += 1
        progress(number, len(postures))
    if not rows:
        raise SolverError(f"none of {len(postures)} postures has an equilibrium. Check masses, stiffnesses and range_deg.")
    angles, tips, deflections, forces, frequencies, moments = (np.array(column) for column in zip(*rows, strict=True))
    moduli = np.array([section.section_modulus or np.nan for section in scene.sections])
    stresses = np.abs(moments) / moduli
    return Envelope(tuple(names), angles, tips, deflections, forces, frequencies, moments, stresses, skipped)


def _grid(scene: Scene) -> list[Array]:
    """Relative joint angles (rad) over all ranges, as many of each as fit into `MOST` postures."""
    count = max(2, min(FINEST, int(MOST ** (1.0 / len(scene.joints)) + 1e-9)))
    axes = [np.radians(np.linspace(*joint.range_deg, count)) for joint in scene.joints]
    return [np.array(angles) for angles in product(*axes)]


def _at_rest(
    scene: Scene, plan: Plan, strokes: Array, angles: Array, bending: Array, owners: Array
) -> tuple[Array, Array, float, Array, Array, Array]:
    """Section angles, tip, deflection, forces, frequencies, moments of one posture."""
    state, work = plan.state(), plan.work()
    settle(plan, state, work, strokes, angles)
    tip, straight = state.frames[-1, :2].copy(), skeleton(scene, angles)
    forces = taken_apart(plan, first_row(plan, state)).cylinder_forces
    moments = _largest(bending @ state.z, owners, plan.joints)
    modes = natural_modes(plan, state, work, MODES, WIDTH)
    frequencies = np.array([mode.frequency for mode in modes])
    deflection = float(np.hypot(*(tip - straight.pivots[-1])))
    return np.degrees(straight.headings), tip, deflection, forces, frequencies, moments


def _largest(values: Array, owners: Array, count: int) -> Array:
    """The value of largest size of every owner, 0 where there is none."""
    found = np.zeros(count)
    for value, owner in zip(values, owners, strict=True):
        found[owner] = value if abs(value) > abs(found[owner]) else found[owner]
    return found
