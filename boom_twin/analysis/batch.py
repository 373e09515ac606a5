"""Many booms of one structure stepped together over all cores: parameters, hypotheses, sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ..compiler.lanes import groups_of, lanes_of, numbers_of, room_for, side_by_side, work_of_lanes, write_back
from ..compiler.plan import Plan, first_row, stacked, width_of
from ..errors import UsageError
from ..kernels.integrators import GENERALISED_ALPHA
from ..kernels.tables import OK, SENTENCES, Tables, Work
from ..kernels.transfer.lane_steps import LaneCourse, run_lanes
from ..kernels.transfer.time_step import run_each
from ..system.cores import usable_cores
from ..types import Array
from .drive import PASSES, TOLERANCE
from .equilibrium import settle
from .simulate import RHO

FEWEST_STEPS = 8  # of a call, for which booms are put side by side
SHARES = 4  # pieces of work a core, so that one that is slowed down does not hold up the others


class Batch:
    """Booms that differ in numbers but not in structure, each with a state of its own.

    Parameters
    ----------
    plans : sequence of Plan
        Compiled booms with the same operations, unknowns and bases: one scene with changed masses, stiffnesses, lengths.
    cores : int, optional
        Threads; all cores if not given.

    Raises
    ------
    UsageError
        No plan, or structures that differ; names the first boom that does.
    """

    def __init__(self, plans: Sequence[Plan], cores: int | None = None) -> None:
        _check_structure(plans)
        self.plans = tuple(plans)
        self.cores = cores or usable_cores()
        self._tables = stacked([plan.tables for plan in plans])
        self._states = stacked([plan.state() for plan in plans])
        self._works = [plans[0].work() for _ in range(min(len(plans), SHARES * self.cores))]

    def settle(self, strokes: Array, angles: Array) -> Array:
        """Bring every boom to rest at `strokes` (m) next to joint `angles` (rad), both (n,) or (booms, n).

        Returns their first rows, shape (booms, width_of(plan)), see `compiler.plan`.

        Raises
        ------
        SolverError
            A boom has no equilibrium there.
        """
        n = self.plans[0].joints
        rows = np.empty((len(self.plans), width_of(self.plans[0])))
        every = (len(self.plans), n)
        for i, (at, near) in enumerate(zip(np.broadcast_to(strokes, every), np.broadcast_to(angles, every), strict=True)):
            plan, state = self.plans[i], _part(self._states, i)
            settle(plan, state, self._works[0], at, near)
            rows[i] = first_row(plan, state)
        return rows

    def run(self, step: float, strokes: Array, rates: Array, every: int = 1, rho: float = RHO) -> Array:
        """Step all booms along their strokes.

        Parameters
        ----------
        step : float
            s.
        strokes, rates : ndarray, shape (steps, n) for all booms or (booms, steps, n)
            m and m/s at the end of every step; `steps` is a multiple of `every`.
        every : int
            Steps to a row of results.

        Returns
        -------
        ndarray, shape (booms, steps/every, width_of(plan))
            See `compiler.plan`. NaN from where a boom's step failed; see `failures`.
        """
        count, n = len(self.plans), self.plans[0].joints
        total = np.shape(strokes)[-2]
        if total % every:
            raise UsageError(f"strokes = {total} steps: not a multiple of every = {every}. Give whole rows.")
        closed = np.array([plan.closed_lengths for plan in self.plans])[:, None]
        drives = np.ascontiguousarray(closed + np.broadcast_to(strokes, (count, total, n)))
        speeds = np.ascontiguousarray(np.broadcast_to(rates, (count, total, n)))
        rows = total // every
        steps, counts = np.full(rows, step), np.full(rows, every, dtype=np.int64)
        out, self._ends = np.full((count, rows, width_of(self.plans[0])), np.nan), np.zeros((count, 3), np.int64)
        course = (steps, counts, drives, speeds, GENERALISED_ALPHA, rho, TOLERANCE, PASSES)
        alone = self._run_lanes(course, out) if self._may_have_lanes(total) else np.arange(count)
        self._run_alone(alone, course, out)
        return out

    def _may_have_lanes(self, steps: int) -> bool:
        """Return True if booms may go side by side: pins are ideal, code is compiled, and there are enough steps and booms."""
        return not self.plans[0].pins and steps >= FEWEST_STEPS and len(self.plans) > 1 and run_lanes.is_compiled

    @cached_property
    def _groups(self) -> tuple[Tables, list[tuple[Work, np.ndarray]]]:
        """Tables of the booms side by side, and works for them."""
        works = min(groups_of(len(self.plans)), SHARES * self.cores)
        return side_by_side(self._tables), [work_of_lanes(self.plans[0]) for _ in range(works)]

    def _run_lanes(self, course: tuple[Any, ...], out: Array) -> np.ndarray:
        """Step booms side by side; returns the numbers of those that failed, whose states are as they were."""
        steps, counts, drives, speeds, *how = course
        (tables, works), states, booms = self._groups, side_by_side(self._states), len(out)
        drives, speeds = lanes_of(drives), lanes_of(speeds)
        rows, ends = room_for((len(drives), *out.shape[1:])), room_for((len(drives), 2))

        def share(own: tuple[Work, np.ndarray], bounds: tuple[int, int]) -> None:
            work, kept = own
            run_lanes(tables, states, work, LaneCourse(drives, speeds, rows, ends, kept), *bounds, steps, counts, *how)

        self._shared(share, works, len(drives))
        failed, passes = numbers_of(ends, booms).T
        good = failed == 0.0
        write_back(states, self._states, good)
        out[good] = numbers_of(rows, booms)[good]
        self._ends[good] = np.stack([np.full(booms, OK), np.full(booms, len(steps)), passes], axis=1)[good]
        return np.flatnonzero(~good)

    def _run_alone(self, booms: np.ndarray, course: tuple[Any, ...], out: Array) -> None:
        """Step these booms one after the other."""

        def share(work: Work, bounds: tuple[int, int]) -> None:
            for i in booms[slice(*bounds)]:
                run_each(self._tables, self._states, work, i, i + 1, *course, out, self._ends)

        self._shared(share, self._works, len(booms))

    def _shared(self, share: Callable[[Any, tuple[int, int]], None], works: Sequence[Any], count: int) -> None:
        """Let `share` work on `count` pieces, over all cores, each in a work of its own."""
        limits = np.linspace(0, count, len(works) + 1).astype(int).tolist()
        with ThreadPoolExecutor(self.cores) as pool:
            list(pool.map(share, works, pairwise(limits)))

    def failures(self) -> dict[int, str]:
        """Booms whose last run ended early, and why."""
        return {i: SENTENCES[int(status)] for i, (status, _, _) in enumerate(self._ends) if status != OK}


def _check_structure(plans: Sequence[Plan]) -> None:
    if not plans:
        raise UsageError("plans = none: give at least one compiled boom.")
    first = plans[0]
    for i, plan in enumerate(plans):
        same = plan.names == first.names and all(_alike(a, b) for a, b in zip(plan.tables, first.tables, strict=True))
        if not same:
            raise UsageError(
                f"plans[{i}]: another structure than plans[0] (parts that one of them leaves out, or other modes). Give booms "
                "that differ in numbers only."
            )


def _alike(a: Any, b: Any) -> bool:
    """Same shape, and the same places of rows and histories."""
    if np.shape(a) != np.shape(b):
        return False
    names = getattr(a, "dtype", np.dtype(float)).names or ()
    return all(np.array_equal(a[name], b[name]) for name in names if a.dtype[name].kind == "i")


def _part(stack: Any, i: int) -> Any:
    return type(stack)(*(column[i] for column in stack))
