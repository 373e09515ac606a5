"""Stroke motion of studies: a quintic move from rest.

The default boom in its posture `arch` moves as everywhere in the documentation: stroke 1 by 50 mm, stroke 3 by 30 mm. On any
other boom every second cylinder turns its joint by `TURN`, up and down in turn so that a long boom does not curl up: the other
way where that does not fit into the joint's range and the cylinder's travel, by half (and half again) where neither fits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..errors import UsageError
from ..scene.kinematics import posture_angles, stroke_curve, strokes_of_angles, strokes_of_posture
from ..scene.load import load_scene
from ..scene.schema import Scene
from ..types import Array

ARCH = "arch"
ARCH_TRAVEL = (0.05, 0.0, 0.03, 0.0)  # m
TURN = math.radians(8.0)
HALVINGS = 4
RISE = 1.5  # s
DURATION = 4.0  # s
RANGE_SAMPLES = 181  # of a joint's range


@dataclass(frozen=True)
class Motion:
    """Strokes of a smooth move. n cylinders."""

    label: str  # description for a report
    angles: Array  # (n,), joint angles (rad) of the undeformed boom at the start
    first: Array  # (n,), strokes (m) at the start
    travel: Array  # (n,), change of the strokes (m)
    rise: float = RISE  # s, after which the strokes have arrived
    duration: float = DURATION  # s, until which they hold

    def __call__(self, times: Array) -> tuple[Array, Array]:
        """Strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        x = np.clip(np.asarray(times, float) / self.rise, 0.0, 1.0)[:, None]
        place, rate = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * (x * (1.0 - x)) * (x * (1.0 - x))
        return self.first + place * self.travel, rate / self.rise * self.travel


def motion_of(scene: Scene, posture: str | None = None, duration: float = DURATION) -> Motion:
    """Return the motion of a scene for `duration` (s); see the head of this file.

    It starts in `posture`: by default `arch`, else the first posture, else next to the middle of the joints' ranges.
    UsageError if there is no such posture, or no cylinder with room to move.
    """
    name = posture or (ARCH if ARCH in scene.postures else next(iter(scene.postures), None))
    if name is None:
        angles = np.array([_middle(scene, i) for i in range(len(scene.joints))])
        first = strokes_of_angles(scene, angles)
    else:
        angles, first = posture_angles(scene, name), strokes_of_posture(scene, name)
    start = f"posture {name}" if name else "the middle of the ranges"
    travel = np.array(ARCH_TRAVEL) if name == ARCH and _is_default(scene, first) else _travel(scene, angles, first)
    if not travel.any():
        raise UsageError(f"the boom in {start}: no cylinder has room to move. Name another posture.")
    far = ", ".join(f"stroke {i + 1} by {1e3 * travel[i]:+.1f} mm" for i in np.flatnonzero(travel)[:6])
    more = ", .." if np.count_nonzero(travel) > 6 else ""
    label = f"from rest in {start}: {far}{more} in {RISE:g} s, {duration:g} s in all"
    return Motion(label, angles, first, travel, RISE, duration)


@lru_cache(maxsize=1)
def _arch_strokes() -> tuple[float, ...]:
    return tuple(strokes_of_posture(load_scene(), ARCH).tolist())


def _is_default(scene: Scene, first: Array) -> bool:
    """Return True if the cylinders stand as those of the default scene in its arch."""
    expected = _arch_strokes()
    return len(scene.joints) == len(expected) and bool(np.allclose(first, expected, rtol=0.0, atol=1e-9))


def _middle(scene: Scene, index: int) -> float:
    """Angle (rad) of joint `index` nearest to the middle of its range that its cylinder reaches."""
    low, high = np.radians(scene.joints[index].range_deg)
    grid = np.linspace(low, high, RANGE_SAMPLES)
    strokes = stroke_curve(scene, index, grid)
    with np.errstate(invalid="ignore"):
        reached = grid[(strokes >= 0.0) & (strokes <= scene.joints[index].cylinder.max_stroke)]
    if not len(reached):
        raise UsageError(f"cylinder_{index + 1}: no stroke is within both max_stroke and range_deg. Widen one.")
    return float(reached[np.argmin(np.abs(reached - 0.5 * (low + high)))])


def _travel(scene: Scene, angles: Array, first: Array) -> Array:
    """Travel (m) of every cylinder by the rule for booms in general, shape (n,)."""
    travel = np.zeros(len(angles))
    for turn, i in enumerate(range(0, len(angles), 2)):
        up = 1.0 if turn % 2 == 0 else -1.0
        sizes = [sign * TURN / 2**halving for halving in range(HALVINGS) for sign in (up, -up)]
        aims = [_stroke_after(scene, i, float(angles[i]), size) for size in sizes]
        travel[i] = next((aim - first[i] for aim in aims if aim is not None), 0.0)
    return travel


def _stroke_after(scene: Scene, index: int, angle: float, turn: float) -> float | None:
    """Stroke (m) of joint `index` turned from `angle` by `turn` (rad); None if that is out of bounds or past a dead centre."""
    joint = scene.joints[index]
    low, high = np.radians(joint.range_deg)
    if not low <= angle + turn <= high:
        return None
    curve = stroke_curve(scene, index, np.linspace(angle, angle + turn, 9))
    inside = np.isfinite(curve).all() and 0.0 <= curve[-1] <= joint.cylinder.max_stroke
    way = np.sign(np.diff(curve))
    return float(curve[-1]) if inside and bool(np.all(way == way[0])) and way[0] != 0.0 else None
