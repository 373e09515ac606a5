"""Choose the steps of the twin by their error: a test move of the scene, with steps halved until bounds on the tip hold.

The move is the same for all scenes: from the middle of their ranges all cylinders go out by `SHARE` of their travel on a
quintic of `RISE` seconds. Errors are those of step doubling (Hairer, Norsett and Wanner, Solving Ordinary Differential
Equations I, 1993, section II.4): 4/3 of what halving a step of a second-order scheme changes. The choice depends on scene and
settings alone, so a replay steps as the node did.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..analysis.drive import PASSES, TOLERANCE
from ..analysis.equilibrium import settle
from ..analysis.motions import quintic
from ..compiler.plan import Plan
from ..config.settings import Settings
from ..errors import SolverError, UsageError
from ..kernels.integrators import GENERALISED_ALPHA, A, X, new_weights, prepare
from ..kernels.tables import OK, State
from ..kernels.transfer.time_step import ANEW, LONGEST_INCREMENT, advance
from ..scene.kinematics import stroke_curve
from ..scene.schema import Scene
from ..types import Array
from .stroke_filter import filter_tuning

SHARE, RISE = 0.05, 1.0  # of the travel of a cylinder; s
DOUBLING = 4.0 / 3.0  # error over the change by half the step
HALVINGS = 4  # of a step, at the most
USUAL = 0.005  # s between samples, for which the look ahead is tried
STARTS = 8  # instants of the move from which is looked ahead
BETWEEN = 20  # steps from one of them to the next


class StepChoice(NamedTuple):
    """Steps of the remembered boom and of the look ahead (s), and what they add to the tip in the test move, rms.

    tip_error : m. acceleration_error : m/s^2. Both NaN if the test move could not be made: then the steps are the longest.
    """

    step: float
    look_step: float
    tip_error: float
    acceleration_error: float


def choose_steps(scene: Scene, plan: Plan, settings: Settings) -> StepChoice:
    """The longest steps, up to ``step`` and ``look_step``, that keep ``step_tip_error`` and ``step_acceleration_error``.

    Parameters
    ----------
    scene : Scene
        With its load; `plan` is it, compiled.
    """
    try:
        move = _TestMove(scene, plan, settings.rho)
        lag = float(filter_tuning(settings.stroke_variance, settings.stroke_agility).lags[0]) * USUAL ** (1.0 / 6.0)
        step, moved = _halved(move.errors_of_step, settings.step, settings)
        look_step, looked = _halved(lambda step: move.errors_ahead(lag, step), settings.look_step, settings)
    except (SolverError, UsageError):
        return StepChoice(settings.step, settings.look_step, np.nan, np.nan)
    return StepChoice(step, look_step, *np.maximum(moved, looked).tolist())


def _halved(errors_of: Callable[[float], Array], step: float, settings: Settings) -> tuple[float, Array]:
    """The step, halved until its errors (m, m/s^2) are within bounds, and the errors."""
    bounds = np.array([settings.step_tip_error, settings.step_acceleration_error])
    errors = errors_of(step)
    for _ in range(HALVINGS):
        if (errors <= bounds).all():
            break
        step *= 0.5
        errors = errors_of(step)
    return step, errors


class _TestMove:
    """The test move of a scene, from rest."""

    def __init__(self, scene: Scene, plan: Plan, rho: float) -> None:
        self._plan, self._rho, self._weights = plan, rho, new_weights(len(plan.state().history))
        middle = np.radians([sum(joint.range_deg) / 2 for joint in scene.joints])
        strokes = np.array([stroke_curve(scene, i, middle[i : i + 1])[0] for i in range(len(middle))])
        self._first = plan.closed_lengths + strokes
        self._way = SHARE * np.array([joint.cylinder.max_stroke for joint in scene.joints])
        self._state, self._work = plan.state(), plan.work()
        settle(plan, self._state, self._work, strokes, middle)
        self._state.drives[0], self._state.drives[1] = self._first, 0.0

    def errors_of_step(self, step: float) -> Array:
        """Errors (m, m/s^2) of the tip over the move in steps of `step`, rms."""
        count = round(RISE / step)
        whole, half = (self._followed(copied(self._state), 0.0, RISE, count * finer, finer) for finer in (1, 2))
        return errors_between(whole, half)

    def errors_ahead(self, lag: float, step: float) -> Array:
        """Errors (m, m/s^2) of the tip `lag` s ahead of some instants, in steps of at most `step` from there, rms."""
        state, found, count = copied(self._state), [], int(np.ceil(lag / step - 1e-6))
        instants = np.linspace(0.0, RISE, STARTS + 2).tolist()
        for before, at in pairwise(instants[:-1]):
            self._followed(state, before, at, BETWEEN, BETWEEN)
            whole, half = (self._followed(copied(state), at, at + lag, count * finer, count * finer) for finer in (1, 2))
            found.append((whole, half))
        return errors_between(*(np.concatenate(rows) for rows in zip(*found, strict=True)))

    def _followed(self, state: State, start: float, end: float, count: int, every: int) -> Array:
        """Tip (2,) in m and its acceleration (2,) in m/s^2 after every so many of `count` steps, shape (rows, 4)."""
        t, work, step, rows = self._plan.tables, self._work, (end - start) / count, []
        scheme = prepare(GENERALISED_ALPHA, self._rho, step, self._weights)
        for k in range(1, count + 1):
            x = min(max((start + k * step) / RISE, 0.0), 1.0)
            share, rate, _ = quintic(x)
            lengths, rates = self._first + share * self._way, rate / RISE * self._way
            status, _, _ = advance(t, state, work, scheme, lengths, rates, TOLERANCE, PASSES, LONGEST_INCREMENT, None, ANEW)
            if status != OK:
                raise SolverError("the test move cannot be stepped")
            if k % every == 0:
                rows.append(state.history[[X, X, A, A], [t.tip, t.tip + 1, t.tip, t.tip + 1]])
        return np.array(rows)


def copied(state: State) -> State:
    """A state of its own."""
    return State(*(array.copy() for array in state))


def errors_between(whole: Array, half: Array) -> Array:
    """Errors (m, m/s^2), rms, of rows stepped by whole steps, from the same by half steps, both shape (rows, 4)."""
    off = (whole - half).reshape(len(whole), 2, 2)
    return np.asarray(DOUBLING * np.sqrt((off**2).sum(axis=2).mean(axis=0)))
