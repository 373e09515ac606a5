"""Motions of the stability study, with their scenes and steps."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ....analysis.methods import Drive
from ....analysis.motions import Motion, motion_of
from ....scene.kinematics import joint_angles_of_strokes, stroke_curve, stroke_range
from ....scene.pump_pulses import ease
from ....scene.schema import Scene
from ....types import Array

TRAVEL_SHARE = 0.05  # distance of the start from the end, over a cylinder's travel
RANGE_SAMPLES = 1001  # angles over a joint's range
FULL_STROKE = 10.0  # s, duration of a full stroke at full speed


@dataclass(frozen=True)
class Setup:
    """Scene, drive and steps of a case.

    Attributes
    ----------
    scene : Scene
    drive : Drive
    angles : ndarray, shape (n,)
        Approximate joint angles (rad) at the start.
    duration, step : float
        s.
    still : float
        Time (s) after which the drives stand still.
    every : int
        Steps per row.
    jump : float
        Time (s) of a jump in speed, or NaN. Accelerations and forces are impulses there, without a value.
    """

    scene: Scene
    drive: Drive
    angles: Array
    duration: float
    step: float
    still: float
    every: int = 1
    jump: float = math.nan


@dataclass(frozen=True)
class DeadStop:
    """Drive from strokes `first` (m) with `ramp` (s) to `speed` (m/s), both (n,), and a dead stop at `stop` (s)."""

    first: Array
    speed: Array
    ramp: float
    stop: float

    def __call__(self, times: Array) -> tuple[Array, Array]:
        """Return strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        moving = times < self.stop - 1e-9
        x = np.clip(times / self.ramp, 0.0, 1.0)
        gone = self.ramp * ease_integral(x) + np.clip(times, self.ramp, self.stop) - self.ramp
        rate = np.where(moving, ease(x), 0.0)
        return self.first + np.outer(gone, self.speed), np.outer(rate, self.speed)


def ease_integral(x: Array) -> Array:
    """Return the integral of `ease` from 0, for x in [0, 1]."""
    return 2.5 * x**4 - 3.0 * x**5 + x**6


def smooth(
    scene: Scene, posture: str | None = None, share: float = 1.0, rise: float = 1.0, duration: float = 2.0, step: float = 1e-3,
    every: int = 1,
) -> Setup:  # fmt: skip
    """Move by `share` of the study's move in `rise` (s), then rest until `duration` (s)."""
    own = motion_of(scene, posture)
    move = replace(own, travel=share * own.travel, rise=rise, duration=duration)
    return Setup(scene, move, own.angles, duration, step, rise, every)


def move_in_words(scene: Scene) -> str:
    """Return the strokes of the study's move on a scene, in words."""
    travel = motion_of(scene).travel
    return "from rest, " + ", ".join(f"stroke {i + 1} by {1e3 * travel[i]:+.1f} mm" for i in np.flatnonzero(travel))


def first_cylinder(scene: Scene, posture: str, turn: float, step: float, rise: float = 1.0, duration: float = 2.0) -> Setup:
    """Turn joint 1 by `turn` (rad) in `rise` (s) by its cylinder, then rest."""
    angle = motion_of(scene, posture).angles[0]
    first, last = stroke_curve(scene, 0, np.array([angle, angle + turn]))
    return one_cylinder(scene, posture, 0, float(last - first), step, rise, duration)


def one_cylinder(
    scene: Scene, posture: str, index: int, travel: float, step: float = 1e-3, rise: float = 1.0, duration: float = 2.0
) -> Setup:
    """Move cylinder `index` by `travel` (m) in `rise` (s), then rest."""
    own = motion_of(scene, posture)
    far = np.zeros(len(own.first))
    far[index] = travel
    return Setup(scene, replace(own, travel=far, rise=rise, duration=duration), own.angles, duration, step, rise)


def dead_stop(scene: Scene, step: float = 1e-3) -> Setup:
    """Move as in the study, at full speed from 0.3 s, stop dead at 0.8 s and rest until 2 s."""
    own = motion_of(scene)
    full = np.array([joint.cylinder.max_stroke for joint in scene.joints]) / FULL_STROKE
    drive = DeadStop(own.first, np.sign(own.travel) * full, 0.3, 0.8)
    return Setup(scene, drive, own.angles, 2.0, step, 0.8, jump=0.8)


def to_the_ends(scene: Scene, longest: bool) -> Setup:
    """Move all cylinders from near their longest or shortest allowed stroke to that stroke."""
    ends = np.array([stroke_range(scene, i, RANGE_SAMPLES) for i in range(len(scene.joints))])
    last, other = (ends[:, 1], ends[:, 0]) if longest else (ends[:, 0], ends[:, 1])
    first = last + TRAVEL_SHARE * (other - last)
    move = Motion("to the ends", joint_angles_of_strokes(scene, first), first, last - first, 1.0, 2.0)
    return Setup(scene, move, move.angles, 2.0, 1e-3, 1.0)
