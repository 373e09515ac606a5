"""Histories of strokes and of a force as smooth curves: monotone cubics between rows, and simulation along them in any step.

The slopes follow Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5, 1984). At inner rows they are a weighted harmonic mean of
both neighbouring secants, or zero if the secants differ in sign. At the ends they are those of a parabola through three rows,
limited against overshoot. `scipy.interpolate.PchipInterpolator` is equal, but its import takes longer than all of `simulate`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiler.plan import Plan
from ..errors import SolverError
from ..kernels.elements.cylinder import write_drives
from ..kernels.elements.pin_contact import LOST
from ..kernels.integrators import GENERALISED_ALPHA
from ..kernels.result_row import Results
from ..kernels.tables import State, Work
from ..kernels.transfer.time_step import observe, run
from ..system.result_text import numbers
from ..types import Array, StrokeReading


def pchip(x: Array, y: Array, at: Array) -> tuple[Array, Array]:
    """Return interpolating curves and derivatives at `at` (k,), both (k, n), of values `y` (m, n) at increasing `x` (m,)."""
    h = np.diff(x)[:, None]
    secant = np.diff(y, axis=0) / h
    slope = _slopes(h, secant)
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    s, h, secant, left, right = (at - x[i])[:, None], h[i], secant[i], slope[i], slope[i + 1]
    square = (3.0 * secant - 2.0 * left - right) / h
    cube = (left + right - 2.0 * secant) / h**2
    return y[i] + s * (left + s * (square + s * cube)), left + s * (2.0 * square + s * 3.0 * cube)


def _slopes(h: Array, secant: Array) -> Array:
    """Return the slopes at all rows, (m, n), from spacings (m - 1, 1) and secants (m - 1, n)."""
    if len(h) == 1:
        return np.repeat(secant, 2, axis=0)
    before, after = 2.0 * h[1:] + h[:-1], h[1:] + 2.0 * h[:-1]
    alike = secant[:-1] * secant[1:] > 0.0
    first, second = np.where(alike, secant[:-1], 1.0), np.where(alike, secant[1:], 1.0)
    inner = np.where(alike, (before + after) / (before / first + after / second), 0.0)
    start = _end(h[0], h[1], secant[0], secant[1])
    stop = _end(h[-1], h[-2], secant[-1], secant[-2])
    return np.vstack([start, inner, stop])


def _end(near: Array, far: Array, first: Array, second: Array) -> Array:
    """Return the slope at an end, (n,), from the two nearest spacings and secants."""
    slope = ((2.0 * near + far) * first - near * second) / (near + far)
    turned, steep = slope * first <= 0.0, (first * second < 0.0) & (np.abs(slope) > 3.0 * np.abs(first))
    return np.asarray(np.where(turned, 0.0, np.where(steep, 3.0 * first, slope)))


STEP_TOLERANCE = 1e-6  # rad, increment in the last pass; the remaining error is about 1 to 50 times its square
PASSES = 20


class Run(NamedTuple):
    """Simulated motion: status, last step reached (`row`), results at the rows, and sums over the steps."""

    status: int
    row: int
    rows: Results
    passes: float  # mean of a step
    jolt: float  # see `boom_twin.kernels.transfer.time_step.run`
    shake: float
    square: float  # sum of h^2 over all steps, s^2
    longest: float  # longest step, s
    rates: Array  # of the drives at the rows, m/s
    lost: NDArray[np.int64]  # lost contacts of each pin with clearance
    end: State  # after the last row


NO_FORCE = np.zeros((0, 3))


def force_at(force: Array, times: Array) -> Array:
    """Return the force at the tip (N), (k, 2), at `times` (k,); rows of `force` (time, x, y) are joined as those of a drive."""
    if len(force) < 2:
        return np.tile(force[:, 1:] if len(force) else np.zeros(2), (len(times), 1))
    found, _ = pchip(force[:, 0], force[:, 1:], np.clip(times, force[0, 0], force[-1, 0]))
    return found


@dataclass(frozen=True)
class DriveCourse:
    """Rows of a drive, and the state of the boom at the first row."""

    plan: Plan
    start: State  # at the first row, at rest or in motion; it is not modified
    work: Work
    times: Array  # (m,), s
    strokes: Array  # (m, n), m; between rows they follow a monotone cubic
    rho: float  # spectral radius of generalised-alpha at infinite frequency
    force: Array  # (k, 3), see `force_at`

    def stepped(self, rows: NDArray[np.int64], dt: float, finer: int = 1) -> Run:
        """Simulate through `rows` in steps of at most `dt` (s), each divided by `finer`. Steps end on the rows."""
        plan, state = self.plan, State(*(array.copy() for array in self.start))
        out = np.empty((len(rows), plan.row_width))
        observe(plan.tables, state, out[0])
        steps, counts, drives, rates, loads = self.steps(rows, dt, finer)
        self.work.load[:] = self.first_load
        status, row, passes, jolt, shake = run(
            plan.tables, state, self.work, steps, counts, drives, rates, loads, GENERALISED_ALPHA, self.rho, STEP_TOLERANCE,
            PASSES, None, out[1:],
        )  # fmt: skip
        at_rows = np.vstack([self.start.drives[1], rates[np.cumsum(counts) - 1]])
        return Run(
            int(status), int(row), plan.results(out), passes / max(int(counts.sum()), 1), jolt, shake,
            float(counts @ steps**2), float(steps.max(initial=0.0)), at_rows, state.contacts[:, LOST].astype(np.int64), state,
        )  # fmt: skip

    @property
    def first_load(self) -> Array:
        """Force at the tip at the first row, N, shape (2,)."""
        return np.asarray(force_at(self.force, self.times[:1])[0])

    def steps(self, rows: NDArray[np.int64], dt: float, finer: int) -> tuple[Array, NDArray[np.int64], Array, Array, Array]:
        """Return step size and count before each of `rows` but the first; drives, rates and tip forces after each step."""
        times, strokes = self.times[rows], self.strokes[rows]
        spans = np.diff(times)
        counts = finer * np.maximum(1, np.ceil(spans / dt - 1e-9)).astype(np.int64)
        if len(spans) == 0:
            empty = np.zeros((0, self.plan.joints))
            return spans, counts, empty, empty, np.zeros((0, 2))
        steps = spans / counts
        inside = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts) + 1
        at = np.repeat(times[:-1], counts) + inside * np.repeat(steps, counts)
        lengths, rates = pchip(times, self.plan.closed_lengths + strokes, np.minimum(at, times[-1]))
        return steps, counts, lengths, rates, force_at(self.force, at) if len(self.force) else np.zeros((0, 2))


def spring_free(plan: Plan, lengths: Array, forces: Array) -> Array:
    """Return the drives (m), shape (n,), of cylinders that are `lengths` (m) long at rest under `forces` (N)."""
    drives = drives_as_read(plan, lengths, forces, StrokeReading.LENGTH)
    if np.isfinite(drives).all():
        return drives
    raise SolverError(f"no drives for cylinder forces of {numbers(forces)} N: the oil gives too much. Check bulk_modulus.")


def drives_as_read(plan: Plan, strokes: Array, forces: Array, reads: StrokeReading) -> Array:
    """Return the drives (m) where transducers read `strokes` (m) under `forces` (N), all (.., n); NaN if there are none.

    In motion, oil forces change the cylinder lengths. Drives exclude this: they tell where the boom would rest.
    The oil's damping is left out: its lag is some milliseconds.
    """
    drives = np.array(strokes)
    if reads is not StrokeReading.DRIVE:
        write_drives(
            plan.tables.cylinders, plan.tables.oils, np.ascontiguousarray(np.atleast_2d(forces)), np.atleast_2d(drives)
        )
    return drives


def drives_of(plan: Plan, times: Array, lengths: Array, forces: Array) -> Array:
    """Return the drives (m), shape (m, n), of cylinders with these lengths (m) and forces (N) at `times` (s), at rest at first.

    The extension x of an oil spring follows d x' + k x = F. The solution is exact for forces that are linear from row to row.
    """
    drives = [spring_free(plan, lengths[0], forces[0])]
    for span, now, before, after in zip(np.diff(times), lengths[1:], forces, forces[1:], strict=False):
        extension = lengths[len(drives) - 1] - drives[-1]
        compliance, lag = plan.compliances_and_lags(plan.closed_lengths + now - extension)
        with np.errstate(divide="ignore"):
            kept = np.exp(-span / lag)
        start, end = compliance * before, compliance * after
        lead = (end - start) / span * lag
        drives.append(now - (end - lead + (extension - start + lead) * kept))
    return np.array(drives)
