"""Natural modes of a boom about equilibria at strokes on a grid, kept: what a start from rest near one known costs nothing for.

Modes change slowly with posture, so those of the nearest point of a grid of strokes serve. They depend on the scene and on
that point alone, so it is the same when and in which thread they were computed: a replay that computes them at the sample has
the same to the bit as a node that kept them, or had them made beside its samples with the model of another load.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np

from ..analysis.equilibrium import settle
from ..analysis.modal import Mode, ModeSeries, along, damping_ratio
from ..compiler.plan import Plan, first_row, taken_apart
from ..errors import BoomTwinError
from ..kernels.tables import FRAME_ANGLE, FRAME_COS, FRAME_SIN, FRAME_X, FRAME_Y, State
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.schema import Scene
from ..types import Array
from .look_ahead import copy_state

GRID = 0.02  # m of stroke
KEPT = 16  # postures
OTHER_BRANCH = 0.3  # rad by which a joint is off where its stroke belongs to two angles, and the other one was found
USUAL, USUALLY_BELOW = 4, 157.0  # modes (rad/s) that are computed beforehand; others follow when asked for
WIDTH = 1e-3  # relative accuracy of frequencies


@dataclass(frozen=True)
class PostureMode:
    """One mode with what is derived of it.

    Attributes
    ----------
    mode : Mode
    damping : float
        Ratio.
    turns : ndarray, shape (n,)
        Change of the joint angles, rad per unit of the modal coordinate.
    relative : ndarray, shape (frames, 3)
        Motion of every frame relative to the one before, in its axes; likewise.
    """

    mode: Mode
    damping: float
    turns: Array
    relative: Array


class Posture:
    """Modes about one equilibrium.

    Parameters
    ----------
    plan : Plan
    state : State
        In equilibrium.

    Attributes
    ----------
    strokes : ndarray, shape (n,)
        Of the equilibrium, m.
    """

    def __init__(self, plan: Plan, state: State, strokes: Array) -> None:
        self.strokes = strokes
        self._plan, self._state, self._work = plan, state, plan.work()
        self._series = ModeSeries(plan, state, self._work, WIDTH)
        self._found: list[PostureMode] = []

    def lowest(self, count: int, highest: float) -> list[PostureMode]:
        """The lowest `count` modes below `highest` (rad/s), or all if there are fewer."""
        modes = self._series.lowest(count, highest)
        self._found += [self._derived(mode) for mode in modes[len(self._found) :]]
        return self._found[: len(modes)]

    def find_next(self, count: int, highest: float) -> None:
        """Find one more of those that `lowest` gives, if there is one."""
        self.lowest(min(len(self._found) + 1, count), highest)

    def _derived(self, mode: Mode) -> PostureMode:
        plan, state = self._plan, self._state

        def read() -> Array:
            return np.concatenate([state.frames.ravel(), taken_apart(plan, first_row(plan, state)).joints])

        frames, turns = np.split(along(plan, state, self._work, mode.increments, read), [state.frames.size])
        return PostureMode(mode, damping_ratio(plan, mode), turns, _relative(state.frames, frames.reshape(state.frames.shape)))


class PostureModes:
    """Finds modes by strokes.

    Parameters
    ----------
    scene : Scene
        With its load.
    plan : Plan
        The same compiled.
    """

    def __init__(self, scene: Scene, plan: Plan) -> None:
        self._scene, self._plan, self._work = scene, plan, plan.work()
        self._kept: OrderedDict[tuple[int, ...], tuple[Posture, Array] | None] = OrderedDict()

    def at(self, strokes: Array, angles: Array, live: State) -> Posture:
        """The posture next to `strokes` (m), shape (n,).

        Parameters
        ----------
        angles : ndarray, shape (n,)
            Joint angles of the rigid boom there, rad.
        live : State
            The boom there, which is taken where there is no equilibrium on the grid; left as it is.
        """
        found = self.near(strokes)
        if found is not None and float(np.max(np.abs(found[1] - angles))) < OTHER_BRANCH:
            return found[0]
        state = self._plan.state()
        copy_state(live, state)
        return Posture(self._plan, state, strokes.copy())

    def prepare(self, strokes: Array) -> None:
        """Find the modes next to `strokes` (m), shape (n,), that will be asked for."""
        if np.isfinite(strokes).all() and (found := self.near(strokes)) is not None:
            found[0].lowest(USUAL, USUALLY_BELOW)

    def prepare_piece(self, strokes: Array) -> None:
        """Do the next piece of what `prepare` does, a millisecond of work at most."""
        if not np.isfinite(strokes).all():
            return
        is_known = self._place(strokes) in self._kept
        found = self.near(strokes)
        if is_known and found is not None:
            found[0].find_next(USUAL, USUALLY_BELOW)

    def near(self, strokes: Array) -> tuple[Posture, Array] | None:
        """The posture on the grid next to `strokes` (m), and its joint angles (rad), both of shape (n,); None without one."""
        place = self._place(strokes)
        if place not in self._kept:
            self._kept[place] = self._settled(np.array(place) * GRID)
            while len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(place)
        return self._kept[place]

    @staticmethod
    def _place(strokes: Array) -> tuple[int, ...]:
        return tuple(round(stroke / GRID) for stroke in strokes.tolist())

    def _settled(self, strokes: Array) -> tuple[Posture, Array] | None:
        state = self._plan.state()
        try:
            angles = joint_angles_of_strokes(self._scene, strokes)
            settle(self._plan, state, self._work, strokes, angles)
        except BoomTwinError:
            return None
        return Posture(self._plan, state, strokes), angles


def _relative(frames: Array, motion: Array) -> Array:
    """Motion of every frame (f, 5) relative to the one before, in its axes, from their absolute `motion`; shape (f, 3)."""
    found = np.zeros((len(frames), 3))
    found[0] = motion[0, [FRAME_X, FRAME_Y, FRAME_ANGLE]]
    before, turn = frames[:-1], motion[:-1, FRAME_ANGLE]
    step = frames[1:] - before
    x = motion[1:, FRAME_X] - motion[:-1, FRAME_X] + turn * step[:, FRAME_Y]
    y = motion[1:, FRAME_Y] - motion[:-1, FRAME_Y] - turn * step[:, FRAME_X]
    c, s = before[:, FRAME_COS], before[:, FRAME_SIN]
    found[1:] = np.column_stack([c * x + s * y, c * y - s * x, motion[1:, FRAME_ANGLE] - turn])
    return found
