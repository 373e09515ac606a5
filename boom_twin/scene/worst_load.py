"""Largest push and pull of every cylinder under the boom's own weight at rest, over the ranges of all joints.

All parts are rigid, links and cylinders hang in the pivots. The weight then turns about pivot i with a sum over
the sections from i on, of which each depends on its own heading only, and neighbouring headings differ by a joint angle. So the
largest sum is found from the tip inwards, section by section over a circle of headings, and none of the postures is tried.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.elements.linkage import cylinder_length
from ..types import Array
from .kinematics import gravity_in_base, linkage
from .schema import Scene

CIRCLE = np.arange(360)
"""Headings, and steps of the joint angles, in whole degrees."""
Angles = NDArray[np.int64]


@dataclass(frozen=True)
class WorstLoad:
    """Force (N, positive in tension) of a cylinder, and the posture (section angles to the base, deg) where it bears it."""

    force: float
    angles: tuple[int, ...]


@dataclass(frozen=True)
class _Reach:
    """Angles (whole degrees) that a joint can take within its range and its cylinder's travel, and the levers there (m/rad)."""

    angles: Angles
    levers: Array


def worst_loads(scene: Scene) -> list[tuple[WorstLoad, WorstLoad]]:
    """Return the largest push and the largest pull of every cylinder; 0 N where it never pushes, or never pulls.

    Joint angles are taken in steps of a degree. There is no ground, and sections may cross each other.
    """
    reaches = [_reach(scene, i) for i in range(len(scene.joints))]
    turning = _turning(scene)
    best = {sign: _outboard(sign * turning, reaches) for sign in (-1, 1)}
    behind, found = np.zeros((1, 1), dtype=np.int64), []
    for i, reach in enumerate(reaches):
        found.append((_worst(i, -1, best, reach, behind), _worst(i, 1, best, reach, behind)))
        behind = _further(behind, reach.angles)
    return found


def _reach(scene: Scene, i: int) -> _Reach:
    joint = scene.joints[i]
    low, high = joint.range_deg
    angles = np.arange(round(low), round(high) + 1)
    with np.errstate(all="ignore"):
        lengths, levers = cylinder_length(linkage(scene, i), np.radians(np.clip(angles, low, high)))
    strokes = lengths - joint.cylinder.closed_length
    usable = (strokes >= 0.0) & (strokes <= joint.cylinder.max_stroke) & (levers != 0.0)
    return _Reach(angles[usable], levers[usable])


def _turning(scene: Scene) -> Array:
    """Return the gravity moment of section j and of all that hangs at its end, shape (n, 360): N m by its heading."""
    gx, gy = gravity_in_base(scene)
    headings, rows = np.radians(CIRCLE), []
    beyond = scene.payload
    for section, joint in zip(reversed(scene.sections), reversed(scene.joints), strict=True):
        fill = (scene.line_fill or 0.0) * section.length
        beam = section.beam or (0.0, 0.0)
        parts = [(part.mass, part.com) for part in (section.root, section.head) if part is not None]
        parts.append(((section.rho_A or 0.0) * (beam[1] - beam[0]), (0.5 * (beam[0] + beam[1]), 0.0)))
        parts += [(fill, (0.5 * section.length, 0.0)), (beyond, (section.length, 0.0))]
        along, across = (sum(mass * centre[axis] for mass, centre in parts) for axis in (0, 1))
        x, y = along * np.cos(headings) - across * np.sin(headings), along * np.sin(headings) + across * np.cos(headings)
        rows.append(gy * x - gx * y)
        beyond = sum(mass for mass, _ in parts) + joint.mass
    return np.array(rows[::-1])


def _outboard(turning: Array, reaches: list[_Reach]) -> tuple[Array, Angles]:
    """Return the largest moment of sections i, i + 1, .. about pivot i by heading of i, and joint angles i + 1; (n, 360)."""
    most, following = turning.copy(), np.zeros(turning.shape, dtype=np.int64)
    for i in range(len(reaches) - 2, -1, -1):
        angles = reaches[i + 1].angles
        if angles.size:
            values = most[i + 1][(CIRCLE[:, None] + angles) % 360]
            choice = values.argmax(axis=1)
            most[i] += values[CIRCLE, choice]
            following[i] = angles[choice]
    return most, following


def _worst(i: int, sign: int, best: dict[int, tuple[Array, Angles]], reach: _Reach, behind: Angles) -> WorstLoad:
    """Return largest force of cylinder `i`, a pull if `sign` is 1, a push if it is -1: moment over lever, by virtual work."""
    if not reach.angles.size or not behind.size:
        return WorstLoad(0.0, ())
    headings = (behind[:, -1:] + reach.angles) % 360
    forces = np.where(reach.levers > 0.0, best[sign][0][i][headings], best[-sign][0][i][headings]) / np.abs(reach.levers)
    row, column = np.unravel_index(int(forces.argmax()), forces.shape)
    force = float(forces[row, column])
    if force <= 0.0:
        return WorstLoad(0.0, ())
    angles = [*behind[row, 1:].tolist(), int(behind[row, -1] + reach.angles[column])]
    following = best[sign if reach.levers[column] > 0.0 else -sign][1]
    for steps in following[i:-1]:
        angles.append(angles[-1] + int(steps[angles[-1] % 360]))
    return WorstLoad(sign * force, tuple(angles))


def _further(behind: Angles, angles: Angles) -> Angles:
    """Return a row for every heading that one more section can have: those of the base, 0, and of all sections up to it."""
    if not behind.size or not angles.size:
        return np.zeros((0, behind.shape[1] + 1), dtype=np.int64)
    headings, first = np.unique(behind[:, -1:] + angles, return_index=True)
    return np.column_stack([behind[first // len(angles)], headings])
