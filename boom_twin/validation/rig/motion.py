"""Drive programmes of the virtual rig: moves and holds, hand-made and random."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...errors import UsageError
from ...scene.kinematics import stroke_range, strokes_of_posture
from ...scene.load import load_scene
from ...scene.pump_pulses import ease
from ...scene.schema import Scene
from ...types import Array
from .system import section_frames


def ease_rate(x: Array) -> Array:
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(30.0 * (x * (1.0 - x)) ** 2)


@dataclass(frozen=True, slots=True)
class Move:
    """One cylinder (0-based) goes to an absolute stroke `target` (m), from `start` (s) for `duration` (s)."""

    cylinder: int
    start: float
    duration: float
    target: float

    @property
    def end(self) -> float:
        return self.start + self.duration


@dataclass(frozen=True)
class Programme:
    """Moves of all cylinders, which do not overlap for one; between them they hold.

    Strokes are twice continuously differentiable.
    """

    first: tuple[float, ...]  # strokes (m) at the start
    moves: tuple[Move, ...]  # in any order

    def __post_init__(self) -> None:
        for cylinder in range(len(self.first)):
            own = self._moves_of(cylinder)
            for before, after in pairwise(own):
                if after.start < before.end:
                    raise UsageError(
                        f"moves of cylinder_{cylinder + 1}: the one at {after.start:g} s starts before the end "
                        f"of the one before it, {before.end:g} s. Start it later."
                    )

    def __call__(self, times: Array) -> tuple[Array, Array]:
        """Return strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        times = np.asarray(times, float)
        strokes = np.tile(np.array(self.first), (len(times), 1))
        rates = np.zeros_like(strokes)
        for cylinder, at in enumerate(self.first):
            for move in self._moves_of(cylinder):
                x = (times - move.start) / move.duration
                strokes[:, cylinder] += (move.target - at) * ease(x)
                rates[:, cylinder] += (move.target - at) / move.duration * ease_rate(x)
                at = move.target
        return strokes, rates

    def _moves_of(self, cylinder: int) -> list[Move]:
        return sorted((move for move in self.moves if move.cylinder == cylinder), key=lambda move: move.start)


BUNDLED_DURATION = 60.0  # seconds of the bundled session

BUNDLED_MOVES = (
    Move(0, 3.0, 1.5, 0.665),
    Move(2, 8.5, 3.0, 0.200),
    Move(3, 8.5, 3.0, 0.160),
    Move(0, 15.5, 5.0, 0.580),
    Move(1, 15.5, 4.0, 0.150),
    Move(2, 16.0, 4.5, 0.225),
    Move(3, 26.0, 1.5, 0.185),
    Move(1, 30.5, 2.5, 0.170),
    Move(0, 38.0, 6.0, 0.500),
    Move(2, 38.0, 5.0, 0.170),
    Move(3, 38.5, 5.5, 0.120),
    Move(0, 48.0, 2.5, 0.530),
    Move(1, 48.5, 2.0, 0.160),
    Move(0, 53.0, 3.0, 0.590),
    Move(2, 53.0, 3.0, 0.200),
)
"""Cylinder (0-based), start (s), duration (s), target (m): for the default scene from its posture arch."""

TIP_SPEED = 1.2  # m/s, bound of random programmes, by rigid kinematics
RANGE_SAMPLES = 91  # of a joint's range
HOLD, DURATION = (3.0, 8.0), (1.5, 6.0)  # s
FIRST_HOLD = 3.0  # s


def bundled(scene: Scene) -> Programme:
    """Return the programme of the bundled session, 60 s that end in a hold: from posture arch, or else the scene's first.

    A boom with other joints than the default scene's makes random moves. UsageError if the scene has no posture.
    """
    usual = load_scene()
    if not scene.postures:
        raise UsageError("the scene has no posture to start from. Add one under postures, as in `boom_twin scene`.")
    posture = "arch" if "arch" in scene.postures else next(iter(scene.postures))
    first = strokes_of_posture(scene, posture)
    if scene.joints == usual.joints and scene.base == usual.base and scene.postures[posture] == usual.postures["arch"]:
        return Programme(tuple(first.tolist()), BUNDLED_MOVES)
    return random_programme(scene, posture, BUNDLED_DURATION, 0)


def random_programme(
    scene: Scene,
    posture: str,
    duration: float,
    seed: int,
    holds: tuple[float, float] = HOLD,
    spans: tuple[float, float] = DURATION,
) -> Programme:
    """Draw moves from `posture` of one to three cylinders at once, in range and slower than `TIP_SPEED` at the tip.

    There are holds between, and one after the last move, within `duration` (s). Bounds of their times are `holds` and of those
    of moves `spans`, s.
    """
    rng = np.random.default_rng(seed)
    first = strokes_of_posture(scene, posture)
    now, time, moves = first.copy(), FIRST_HOLD, list[Move]()
    while True:
        span = rng.uniform(*spans)
        if time + span + holds[0] > duration:
            return Programme(tuple(first.tolist()), tuple(moves))
        count = int(rng.integers(1, 1 + min(3, len(now))))
        aim = _reachable(scene, now, rng.choice(len(now), count, replace=False).tolist(), span, rng)
        moves += [Move(int(i), time, span, float(aim[i])) for i in np.flatnonzero(aim != now)]
        now, time = aim, time + span + rng.uniform(*holds)


def through_postures(scene: Scene, postures: Sequence[str], duration: float, acceleration: float) -> Programme:
    """Return moves of all cylinders at once from posture to posture, with rest periods of one length in each.

    The undeformed boom's tip accelerates by at most `acceleration` (m/s^2). A single posture gives a boom that stands still.
    UsageError if moves and rest periods take longer than `duration` (s).
    """
    if unknown := [posture for posture in postures if posture not in scene.postures]:
        raise UsageError(f"--through: {unknown[0]!r} is no posture of the scene. Give names, of {', '.join(scene.postures)}.")
    stops = [strokes_of_posture(scene, posture) for posture in postures]
    spans = [_span(scene, one, other, acceleration) for one, other in pairwise(stops)]
    rest = (duration - sum(spans)) / len(stops)
    if rest < FIRST_HOLD:
        needed = sum(spans) + FIRST_HOLD * len(stops)
        raise UsageError(
            f"duration = {duration:g} s: moves and rest periods of {FIRST_HOLD:g} s take {needed:.0f} s. Give that."
        )
    moves, time = list[Move](), rest
    for span, before, target in zip(spans, stops, stops[1:], strict=False):
        moves += [Move(int(i), time, span, float(target[i])) for i in np.flatnonzero(target != before)]
        time += span + rest
    return Programme(tuple(stops[0].tolist()), tuple(moves))


def _span(scene: Scene, first: Array, target: Array, acceleration: float) -> float:
    """Return the seconds that a move takes whose tip accelerates by `acceleration` (m/s^2) at most."""
    times = np.linspace(0.0, 1.0, 201)
    moves = tuple(Move(i, 0.0, 1.0, float(stroke)) for i, stroke in enumerate(target) if stroke != first[i])
    path = _tip_path(scene, Programme(tuple(first.tolist()), moves), times)
    largest = float(np.hypot(*np.diff(path, 2, axis=0).T).max()) / times[1] ** 2
    return math.sqrt(largest / acceleration)


def _tip_path(scene: Scene, programme: Programme, times: Array) -> Array:
    """Return the places (m, 2) of the undeformed boom's tip, m."""
    end = (scene.sections[-1].length, 0.0)
    return np.array([section_frames(scene, strokes)[-1].point(end) for strokes in programme(times)[0]])


def tip_speed(scene: Scene, programme: Programme, times: Array) -> Array:
    """Return the speed of the undeformed boom's tip (m/s) between successive `times` (m,), shape (m - 1,)."""
    return np.asarray(np.hypot(*np.diff(_tip_path(scene, programme, times), axis=0).T) / np.diff(times))


def _reachable(scene: Scene, now: Array, cylinders: list[int], span: float, rng: np.random.Generator) -> Array:
    """Draw targets of some cylinders, and draw them nearer until the tip is slow enough."""
    aim = now.copy()
    for i in cylinders:
        low, high = stroke_range(scene, i, RANGE_SAMPLES)
        if low >= high:
            raise UsageError(f"cylinder_{i + 1}: no stroke is within both max_stroke and range_deg. Widen one.")
        free = 0.08 * (high - low)  # kept free at both ends
        aim[i] = rng.uniform(low + free, high - free)
    while True:
        trial = Programme(tuple(now.tolist()), tuple(Move(i, 0.0, span, float(aim[i])) for i in cylinders))
        fastest = float(tip_speed(scene, trial, np.linspace(0.0, span, 21)).max())
        if fastest <= TIP_SPEED:
            return aim
        aim = now + 0.95 * min(1.0, TIP_SPEED / fastest) * (aim - now)
