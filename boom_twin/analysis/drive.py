"""A drive given by rows, followed from rest with any step and by any of its rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..chain.program import State, Work
from ..chain.step import run
from ..physics.contact import LOST
from ..physics.integrators import GENERALISED_ALPHA
from ..plan.plan import Plan
from ..records import Array
from .pchip import pchip
from .rows import Rows, first_row, row_width, taken_apart

TOLERANCE = 1e-6  # rad in the last pass of a step; what is left is about 1 to 50 times its square
PASSES = np.int64(20)


class Run(NamedTuple):
    """A motion: status and the row of the drive that it got to, results at the rows, and what `chain.step.run` sums up.

    passes : Newton passes per step, mean. square : sum of h^2 over all steps, s^2. longest : step, s. rates : of the drive
    at the rows, m/s. lost : how often each pin with clearance lost contact.
    """

    status: int
    row: int
    rows: Rows
    passes: float
    jolt: float
    shake: float
    square: float
    longest: float
    rates: Array
    lost: NDArray[np.int64]


@dataclass(frozen=True)
class Course:
    """Rows of a drive, and the boom at rest at the first of them.

    Attributes
    ----------
    start : State
        In equilibrium; stays as it is.
    times : ndarray, shape (m,)
        s.
    strokes : ndarray, shape (m, n)
        m; between rows they follow a monotone cubic.
    rho : float
        Spectral radius of generalised-alpha at infinite frequency.
    """

    plan: Plan
    start: State
    work: Work
    times: Array
    strokes: Array
    rho: float

    def stepped(self, rows: NDArray[np.int64], dt: float, finer: int = 1) -> Run:
        """Follow the curve through some of the rows in steps of at most `dt` (s) that end on them, each divided by `finer`."""
        plan, state = self.plan, State(*(array.copy() for array in self.start))
        out = np.empty((len(rows), row_width(plan)))
        out[0] = first_row(plan, state)
        steps, counts, drives, rates = self._drive(self.times[rows], self.strokes[rows], dt, finer)
        status, row, passes, jolt, shake = run(
            plan.tables, state, self.work, steps, counts, drives, rates, GENERALISED_ALPHA, self.rho, TOLERANCE, PASSES, None,
            out[1:],
        )  # fmt: skip
        at_rows = np.vstack([np.zeros((1, plan.joints)), rates[np.cumsum(counts) - 1]])
        return Run(
            int(status), int(row), taken_apart(plan, out), passes / max(int(counts.sum()), 1), jolt, shake,
            float(counts @ steps**2), float(steps.max(initial=0.0)), at_rows, state.contacts[:, LOST].astype(np.int64),
        )  # fmt: skip

    def _drive(
        self, times: Array, strokes: Array, dt: float, finer: int
    ) -> tuple[Array, NDArray[np.int64], Array, Array]:
        """Steps and their number before every row but the first, and lengths and rates of the drives after each step."""
        spans = np.diff(times)
        counts = finer * np.maximum(1, np.ceil(spans / dt - 1e-9)).astype(np.int64)
        if len(spans) == 0:
            empty = np.zeros((0, self.plan.joints))
            return spans, counts, empty, empty
        steps = spans / counts
        inside = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts) + 1
        at = np.repeat(times[:-1], counts) + inside * np.repeat(steps, counts)
        lengths, rates = pchip(times, self.plan.closed_lengths + strokes, np.minimum(at, times[-1]))
        return steps, counts, lengths, rates
