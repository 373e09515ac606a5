"""Many booms stepped along motions of their own, over all cores: trial values of a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..compiler.plan import Plan, first_row, width_of
from ..kernels.integrators import GENERALISED_ALPHA
from ..kernels.tables import OK, SENTENCES
from ..kernels.transfer.time_step import run
from ..system.cores import usable_cores
from ..types import Array
from .drive import PASSES, TOLERANCE
from .equilibrium import settle
from .simulate import RHO


class Batch:
    """Booms with equally many joints and pins with clearance, each with a state of its own.

    Parameters
    ----------
    plans : sequence of Plan
        Compiled booms, at least one.
    cores : int, optional
        Threads; all cores if not given.
    """

    def __init__(self, plans: Sequence[Plan], cores: int | None = None) -> None:
        self.plans = tuple(plans)
        self.cores = cores or usable_cores()
        self._states = [plan.state() for plan in plans]
        self._works = [plan.work() for plan in plans]
        self._statuses = [OK] * len(plans)

    def settle(self, strokes: Array, angles: Array) -> Array:
        """Bring every boom to rest at `strokes` (m) next to joint `angles` (rad), both (n,) or (booms, n).

        Returns their first rows, shape (booms, width_of(plan)), see `compiler.plan`.

        Raises
        ------
        SolverError
            A boom has no equilibrium there.
        """
        every = (len(self.plans), self.plans[0].joints)
        at, near = np.broadcast_to(strokes, every), np.broadcast_to(angles, every)
        for plan, state, work, *where in zip(self.plans, self._states, self._works, at, near, strict=True):
            settle(plan, state, work, *where)
        return np.array([first_row(plan, state) for plan, state in zip(self.plans, self._states, strict=True)])

    def run(self, step: float, strokes: Array, rates: Array) -> Array:
        """Step all booms along their strokes; a row of results for every step.

        Parameters
        ----------
        step : float
            s.
        strokes, rates : ndarray, shape (steps, n) for all booms or (booms, steps, n)
            m and m/s at the end of every step.

        Returns
        -------
        ndarray, shape (booms, steps, width_of(plan))
            See `compiler.plan`. NaN from where a boom's step failed; see `failures`.
        """
        shape = len(self.plans), np.shape(strokes)[-2], self.plans[0].joints
        strokes, rates = np.broadcast_to(strokes, shape), np.broadcast_to(rates, shape)
        steps, counts = np.full(shape[1], step), np.ones(shape[1], dtype=np.int64)
        out = np.full((*shape[:2], width_of(self.plans[0])), np.nan)

        def run_one(i: int) -> int:
            plan = self.plans[i]
            status, *_ = run(
                plan.tables, self._states[i], self._works[i], steps, counts, plan.closed_lengths + strokes[i],
                np.ascontiguousarray(rates[i]), GENERALISED_ALPHA, RHO, TOLERANCE, PASSES, None, out[i],
            )  # fmt: skip
            return int(status)

        with ThreadPoolExecutor(self.cores) as pool:
            self._statuses = list(pool.map(run_one, range(len(self.plans))))
        return out

    def failures(self) -> dict[int, str]:
        """Booms whose last run ended early, and why."""
        return {i: SENTENCES[status] for i, status in enumerate(self._statuses) if status != OK}
