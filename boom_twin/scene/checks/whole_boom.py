"""Lowest natural frequencies, damping and cylinder forces of the boom stretched out, by the flexibility of a cantilever.

An estimate for plausibility checks and first guesses: the boom lies along x (a joint that cannot be straight is at the end of
its range), its beams are cut into cells that bend, its cylinders are springs in the joints, its masses are points on the line.
With B_pj the moment at spring p by a unit load at mass j, and c_p its compliance, the singular values of
sqrt(c_p) B_pj sqrt(m_j) are 1/omega, and the squares of the left singular vectors are the springs' shares of the strain energy
in that mode. Damping that grows with stiffness, time constant tau_p, gives the damping ratio omega/2 . sum_p tau_p share_p.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.elements.linkage import cylinder_length
from ..types import Array
from .kinematics import linkage
from .schema import Scene

CELLS = 12  # of a beam


@dataclass(frozen=True)
class StraightBoom:
    """A stretched-out boom of n sections with k modes."""

    frequencies: Array
    """Natural frequencies, Hz, ascending, at most n + 2 of them, shape (k,)."""
    sections: Array
    joints: Array
    """Shares of strain energy: of bending by section, of oil by joint, shape (k, n)."""
    levers: Array
    """Change of stroke by angle, m/rad, shape (n,)."""
    moments: Array
    """Moments about the pivots of the weight of all that lies outboard, N m, shape (n,)."""
    mass: float
    """Mass of all that moves, kg."""


def straight_boom(scene: Scene, stiffnesses: Array) -> StraightBoom:
    """Estimate the stretched-out boom; `stiffnesses` (n,) of the oil springs in N/m, infinite where there is none."""
    with np.errstate(all="ignore"):  # of absurd values
        return _estimate(scene, stiffnesses)


def _estimate(scene: Scene, stiffnesses: Array) -> StraightBoom:
    n = len(scene.sections)
    starts = np.concatenate([[0.0], np.cumsum([section.length for section in scene.sections])])
    angles = [np.clip(0.0, *np.radians(joint.range_deg)) for joint in scene.joints]
    levers = np.nan_to_num([float(cylinder_length(linkage(scene, i), angle)[1]) for i, angle in enumerate(angles)])
    places, masses = _masses(scene, starts)
    at, owner, compliance = _springs(scene, starts, levers, stiffnesses)
    arms = np.maximum(places[None, :] - at[:, None], 0.0)
    response = np.sqrt(compliance)[:, None] * arms * np.sqrt(masses)[None, :]
    if not np.isfinite(response).all():  # absurd values: no mode can be told
        response[:] = 0.0
    left, sizes, _ = np.linalg.svd(response, full_matrices=False)
    kept = np.flatnonzero(sizes > 1e-9 * sizes.max(initial=0.0))[: n + 2]
    shares = np.zeros((2 * n, len(kept)))
    np.add.at(shares, owner, left[:, kept] ** 2)
    moments = np.maximum(places[None, :] - starts[:-1, None], 0.0) @ masses * float(np.hypot(*scene.gravity))
    return StraightBoom(1.0 / (2.0 * np.pi * sizes[kept]), shares[:n].T, shares[n:].T, levers, moments, float(masses.sum()))


def _masses(scene: Scene, starts: Array) -> tuple[Array, Array]:
    """Return the places (m from the base pivot) and masses (kg) along the line; links and cylinders hang in the pivots."""
    points = [(float(starts[-1]), scene.payload)]
    for start, section, joint in zip(starts, scene.sections, scene.joints, strict=False):
        points.append((float(start), joint.mass))
        points += [(start + part.com[0], part.mass) for part in (section.root, section.head) if part is not None]
        points += _spread(start, (0.0, section.length), scene.line_fill or 0.0)
        points += _spread(start, section.beam or (0.0, 0.0), section.rho_A or 0.0)
    places, masses = np.array(points).T
    return places, masses


def _spread(start: float, ends: tuple[float, float], density: float) -> list[tuple[float, float]]:
    return [(start + place, density * (ends[1] - ends[0]) / CELLS) for place in _cells(ends)]


def _cells(ends: tuple[float, float]) -> Array:
    return np.asarray(ends[0] + (ends[1] - ends[0]) * (np.arange(CELLS) + 0.5) / CELLS)


def _springs(scene: Scene, starts: Array, levers: Array, stiffnesses: Array) -> tuple[Array, NDArray[np.int64], Array]:
    """Return the places (m), owners (section i, or n + joint i) and compliances (rad/(N m)) of all that bends or gives way."""
    n, found = len(scene.sections), []
    for i, section in enumerate(scene.sections):
        if section.beam is not None and section.I is not None and scene.is_flexible(i):
            cell = (section.beam[1] - section.beam[0]) / CELLS
            found += [(starts[i] + place, i, cell / np.float64(scene.material.E * section.I)) for place in _cells(section.beam)]
        if np.isfinite(stiffnesses[i]) and abs(levers[i]) > 0.0:
            found.append((starts[i], n + i, 1.0 / (stiffnesses[i] * levers[i] ** 2)))
    places, owners, compliances = np.array(found or np.zeros((0, 3))).reshape(-1, 3).T
    return places, owners.astype(np.int64), compliances
