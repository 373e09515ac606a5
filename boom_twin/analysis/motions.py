"""Stroke motions used by studies: a quintic move from rest, and a drive at full speed that is stopped.

The default boom in its posture `arch` moves as everywhere in the documentation: stroke 1 by 50 mm, stroke 3 by 30 mm. On any
other boom every second cylinder turns its joint by `TURN`, up and down in turn so that a long boom does not curl up: the other
way where that does not fit into the joint's range and the cylinder's travel, by half (and half again) where neither fits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np

from ..errors import UsageError
from ..scene.kinematics import posture_angles, stroke_curve, strokes_of_posture
from ..scene.load import load_scene
from ..scene.pump_pulses import ease
from ..scene.schema import Scene
from ..types import Array

ARCH = "arch"
ARCH_TRAVEL = (0.05, 0.0, 0.03, 0.0)  # m
TURN = math.radians(8.0)
HALVINGS = 4
RISE = 1.5  # s
DURATION = 4.0  # s
SAMPLES = 181  # of a joint's range
T = TypeVar("T", float, Array)


@dataclass(frozen=True)
class Motion:
    """Strokes of a smooth move. n cylinders.

    Attributes
    ----------
    label : str
        What it is, for a report.
    angles : ndarray, shape (n,)
        Joint angles (rad) of the undeformed boom at the start.
    first, travel : ndarray, shape (n,)
        Strokes (m) at the start, and how far they go.
    rise, duration : float
        s; the strokes arrive after `rise` and hold until `duration`.
    """

    label: str
    angles: Array
    first: Array
    travel: Array
    rise: float = RISE
    duration: float = DURATION

    def __call__(self, times: Array) -> tuple[Array, Array]:
        """Strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        x = np.clip(np.asarray(times, float) / self.rise, 0.0, 1.0)[:, None]
        place, rate, _ = quintic(x)
        return self.first + place * self.travel, rate / self.rise * self.travel

    def at(self, time: float) -> tuple[Array, Array, Array]:
        """Strokes (m), rates (m/s) and accelerations (m/s^2), each (n,), at one `time` (s)."""
        place, rate, bend = quintic(min(max(time / self.rise, 0.0), 1.0))
        return self.first + place * self.travel, rate / self.rise * self.travel, bend / self.rise**2 * self.travel


def motion_of(scene: Scene, posture: str | None = None, duration: float = DURATION) -> Motion:
    """The motion of a scene; see the head of this file.

    Parameters
    ----------
    posture : str, optional
        Where it starts: by default `arch`, else the first posture, else next to the middle of the joints' ranges.
    duration : float
        s.

    Returns
    -------
    Motion
        Where it starts, and the strokes of all cylinders as functions of time.

    Raises
    ------
    UsageError
        No such posture, or no cylinder with room to move.
    """
    name = posture or (ARCH if ARCH in scene.postures else next(iter(scene.postures), None))
    if name is None:
        angles = np.array([_middle(scene, i) for i in range(len(scene.joints))])
        first = np.array([stroke_curve(scene, i, angles[i : i + 1])[0] for i in range(len(angles))])
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


def quintic(x: T) -> tuple[T, T, T]:
    """Return a rise from 0 to 1 over x in [0, 1] with two derivatives, which vanish at both ends."""
    y = 1.0 - x
    return x * x * x * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * (x * y) * (x * y), 60.0 * x * y * (y - x)


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
    grid = np.linspace(low, high, SAMPLES)
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


RAMP, STOP = 0.3, 1.0  # s, until full speed; begin of braking
FULL_STROKE = 10.0  # s that a drive at full speed takes for its whole stroke


@dataclass(frozen=True)
class StopMotion:
    """Strokes that reach full speed within `ramp`, brake from `stop` on within `brake` (s), and hold. n cylinders.

    Attributes
    ----------
    angles : ndarray, shape (n,)
        Joint angles (rad) of the undeformed boom at the start.
    first, speed : ndarray, shape (n,)
        Strokes at the start, m; full speed, m/s.
    """

    angles: Array
    first: Array
    speed: Array
    brake: float
    ramp: float = RAMP
    stop: float = STOP

    @property
    def still(self) -> float:
        """Time from which the drives hold, s."""
        return self.stop + self.brake

    @property
    def last(self) -> Array:
        """Strokes (m) in the end, shape (n,)."""
        return np.asarray(self(np.array([self.still]))[0][0])

    def __call__(self, times: Array) -> tuple[Array, Array]:
        """Strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        x, y = np.clip(times / self.ramp, 0.0, 1.0), np.clip((times - self.stop) / self.brake, 0.0, 1.0)
        cruise = np.clip(times, self.ramp, self.stop) - self.ramp
        gone = self.ramp * ease_integral(x) + cruise + self.brake * (y - ease_integral(y))
        return self.first + np.outer(gone, self.speed), np.outer(ease(x) - ease(y), self.speed)


def halt(scene: Scene, posture: str | None, brake: float, only: int | None = None) -> StopMotion:
    """Full speed in the directions of the study's motion, no farther than it goes; `only` one cylinder (from 0): up to half."""
    own = motion_of(scene, posture)
    full = np.array([joint.cylinder.max_stroke for joint in scene.joints]) / FULL_STROKE
    travel = np.where(np.arange(len(full)) == only, 0.5 * full, 0.0) if only is not None else own.travel
    lasting = STOP - 0.5 * RAMP + 0.5 * brake
    speed = np.sign(travel) * np.minimum(full, np.abs(travel) / lasting)
    return StopMotion(own.angles, own.first, speed, brake)


def ease_integral(x: Array) -> Array:
    """Integral of `ease` from 0."""
    return 2.5 * x**4 - 3.0 * x**5 + x**6
