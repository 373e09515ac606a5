"""The boom's answer to given strokes, from rest in equilibrium."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..chain.program import State, Work
from ..chain.status import OK, SENTENCES
from ..chain.step import run
from ..errors import SolverError, UsageError
from ..physics.contact import LOST
from ..physics.integrators import GENERALISED_ALPHA
from ..plan.compile import compile_scene
from ..plan.plan import Plan
from ..records import Array
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.parts import Scene
from .doubt import FIRST_ORDER, ROWS_ORDER, Deviation, differences, rings, told, too_fast
from .pchip import pchip
from .rows import Rows, first_row, row_width, taken_apart
from .statics import checked_strokes, settle

RHO = 0.8
TOLERANCE = 1e-6  # rad in the last pass of a step; what is left is about 1 to 50 times its square
PASSES = np.int64(20)


@dataclass(frozen=True)
class Simulation:
    """Results at the rows of the drive. m rows, n sections.

    Attributes
    ----------
    times : ndarray, shape (m,)
        s.
    strokes, joints, cylinder_forces : ndarray, shape (m, n)
        m; rad; N (tension positive).
    tip, tip_velocity, tip_acceleration : ndarray, shape (m, 3)
        x, y, orientation of the last head, in m and rad, and their rates.
    passes : float
        Newton passes per step, mean.
    step_error : float
        Sum of the errors of all steps in the position of the tip, m: about what stepping may have added to it. One step's is
        |beta - 1/6| h^2 |a' - a| (Zienkiewicz and Xie 1991, for Newmark's family).
    step_errors, row_errors : tuple of Deviation
        Estimated errors of tip, acceleration and forces, from steps and from what lies between the rows of the drive.
    doubts : tuple of str
        What gives reason to doubt the motion, one sentence each: errors beyond their bounds, ringing, strokes too fast.
    pin_names : tuple of str
        Pins with clearance.
    pins : ndarray, shape (m, k, 4)
        Offset x, y of the journal in its bush (m, model axes), contact force (N), 1 where they touch. Of a cylinder's pin the
        cylinder's eye is the journal, of a section's pivot the outer section, of a link's pin the link, of Q link R.
    lost_contacts : ndarray of int, shape (k,)
        How often each of them lost contact.
    """

    times: Array
    strokes: Array
    joints: Array
    cylinder_forces: Array
    tip: Array
    tip_velocity: Array
    tip_acceleration: Array
    passes: float
    step_error: float
    step_errors: tuple[Deviation, ...]
    row_errors: tuple[Deviation, ...]
    doubts: tuple[str, ...]
    pin_names: tuple[str, ...]
    pins: Array
    lost_contacts: NDArray[np.int64]

    @property
    def doubt(self) -> str:
        """All `doubts` in one text; empty if there are none."""
        return "; ".join(self.doubts)

    def columns(self) -> dict[str, Array]:
        """Columns of the CSV that `boom_twin simulate` writes, by name with unit."""
        n = self.strokes.shape[1]
        columns = {"t_s": self.times}
        columns |= {f"stroke_{i + 1}_m": self.strokes[:, i] for i in range(n)}
        columns |= {f"joint_{i + 1}_rad": self.joints[:, i] for i in range(n)}
        columns |= {"tip_x_m": self.tip[:, 0], "tip_y_m": self.tip[:, 1]}
        columns |= {"tip_ax_m_s2": self.tip_acceleration[:, 0], "tip_ay_m_s2": self.tip_acceleration[:, 1]}
        columns |= {f"cylinder_force_{i + 1}_N": self.cylinder_forces[:, i] for i in range(n)}
        for k, name in enumerate(self.pin_names):
            for j, quantity in enumerate(("dx_m", "dy_m", "force_N", "contact")):
                columns[f"{name.replace('.', '_')}_{quantity}"] = self.pins[:, k, j]
        return columns


def simulate(
    scene: Scene, times: Array, strokes: Array, dt: float = 1e-3, angles: Array | None = None, rho: float = RHO
) -> Simulation:
    """Start at rest in the equilibrium of the first row and follow the strokes.

    The motion is stepped three times, the second time with half the step and the third by every second row, to tell how
    far the first can be trusted.

    Parameters
    ----------
    times : ndarray, shape (m,)
        s, increasing, any spacing.
    strokes : ndarray, shape (m, n)
        Absolute strokes, m. Between rows they follow a monotone cubic (PCHIP): C1, no overshoot.
    dt : float
        Longest step, s; steps end on the rows.
    angles : ndarray, shape (n,), optional
        Joint angles (rad) next to which the first equilibrium is looked for.
    rho : float
        Spectral radius of generalised-alpha at infinite frequency.

    Raises
    ------
    UsageError
        Rows that do not increase, values that are not finite or out of the cylinders' travel, dt not positive.
    SolverError
        No equilibrium at the first row, or a step that failed; says when.
    """
    times, strokes = _checked(scene, times, strokes, dt)
    plan = compile_scene(scene)
    start, work = plan.state(), plan.work()
    settle(plan, start, work, strokes[0], joint_angles_of_strokes(scene, strokes[0], near=angles))

    def stepped(rows: slice | Array, longest: float, finer: int) -> _Run:
        return _stepped(plan, start, work, times[rows], strokes[rows], longest, finer, rho)

    every, second = slice(None), np.unique(np.append(np.arange(0, len(times), 2), len(times) - 1))
    own = stepped(every, dt, 1)
    if own.status != OK:
        raise SolverError(f"step failed after t = {times[own.row]:.6g} s: {SENTENCES[own.status]}.")
    found, tip = own.rows, own.rows.tip
    step_errors, failed = _compared(times, found, stepped(every, dt, 2), FIRST_ORDER)
    doubts = [f"with half the step the motion fails: {failed}; take a smaller step"] if failed else []
    row_errors: tuple[Deviation, ...] = ()
    if len(second) < len(times):
        row_errors, failed = _compared(times[second], found.at(second), stepped(second, own.longest, 1), ROWS_ORDER)
        doubts += [f"by every second row of the drive the motion fails: {failed}; give rows closer together"] if failed else []
    if rings(own.jolt, own.shake, own.square):
        doubts.append("the accelerations change sign from step to step; take a smaller step")
    doubts += told(step_errors, f"the step of {dt:g} s is coarse", "take a smaller step")
    apart = float(np.diff(times, prepend=times[0]).max())
    doubts += told(row_errors, f"the rows of the drive, up to {apart:g} s apart, say too little", "give rows closer together")
    doubts += too_fast(times, own.rates)
    return Simulation(
        times, strokes, found.joints, found.cylinder_forces, tip[:, 0], tip[:, 1], tip[:, 2],
        own.passes, abs(1.0 / (1.0 + rho) ** 2 - 1.0 / 6.0) * own.jolt,
        step_errors, row_errors, tuple(doubts), plan.pins, found.pins, own.lost,
    )  # fmt: skip


class _Run(NamedTuple):
    """A motion by rows, what `chain.step.run` returns, and rates of the drive at the rows."""

    status: int
    row: int
    rows: Rows
    passes: float
    jolt: float
    shake: float
    square: float
    rates: Array
    longest: float
    lost: NDArray[np.int64]


def _stepped(
    plan: Plan, start: State, work: Work, times: Array, strokes: Array, dt: float, finer: int, rho: float
) -> _Run:
    """Follow the rows from the state `start`, which stays, in steps of at most `dt` divided by `finer`."""
    state = State(*(array.copy() for array in start))
    rows = np.empty((len(times), row_width(plan)))
    rows[0] = first_row(plan, state)
    steps, counts, drives, rates = _drive(plan, times, strokes, dt, finer)
    status, row, passes, jolt, shake = run(
        plan.tables, state, work, steps, counts, drives, rates, GENERALISED_ALPHA, rho, TOLERANCE, PASSES, None, rows[1:]
    )
    ends = np.cumsum(counts) - 1
    return _Run(
        int(status), int(row), taken_apart(plan, rows), passes / max(int(counts.sum()), 1), jolt, shake,
        float(counts @ steps**2), np.vstack([np.zeros((1, plan.joints)), rates[ends]]), float(steps.max(initial=0.0)),
        state.contacts[:, LOST].astype(np.int64),
    )  # fmt: skip


def _compared(times: Array, found: Rows, other: _Run, factor: float) -> tuple[tuple[Deviation, ...], str]:
    """Errors of `found` by another run of the same rows, or why that run failed."""
    if other.status != OK:
        return (), SENTENCES[other.status]
    return differences(times, found, other.rows, factor), ""


def _checked(scene: Scene, times: Array, strokes: Array, dt: float) -> tuple[Array, Array]:
    times, strokes = np.asarray(times, dtype=float), np.asarray(strokes, dtype=float)
    n = len(scene.joints)
    if not (math.isfinite(dt) and dt > 0.0):
        raise UsageError(f"dt = {dt!r} s: must be positive. Take 0.001.")
    if times.ndim != 1 or strokes.shape != (len(times), n) or len(times) < 1:
        raise UsageError(f"strokes = array of shape {strokes.shape}: give one row per time and {n} columns.")
    if not (np.isfinite(times).all() and np.isfinite(strokes).all()):
        row = int(np.flatnonzero(~np.isfinite(np.column_stack([times, strokes])).all(axis=1))[0])
        raise UsageError(f"row {row + 1} of the drive: not finite. Give a number in every column.")
    if np.any(np.diff(times) <= 0.0):
        row = int(np.flatnonzero(np.diff(times) <= 0.0)[0])
        raise UsageError(f"t_s = {times[row + 1]:g} s in row {row + 2} of the drive: not after row {row + 1}. Sort the rows.")
    for values in (strokes.min(axis=0), strokes.max(axis=0), strokes[0]):
        checked_strokes(scene, values)
    return times, strokes


def _drive(
    plan: Plan, times: Array, strokes: Array, dt: float, finer: int
) -> tuple[Array, NDArray[np.int64], Array, Array]:
    """Steps and their number before every row but the first, and lengths and rates of the drives after each step."""
    spans = np.diff(times)
    counts = finer * np.maximum(1, np.ceil(spans / dt - 1e-9)).astype(np.int64)
    if len(spans) == 0:
        empty = np.zeros((0, plan.joints))
        return spans, counts, empty, empty
    steps = spans / counts
    inside = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts) + 1
    at = np.repeat(times[:-1], counts) + inside * np.repeat(steps, counts)
    lengths, rates = pchip(times, plan.closed_lengths + strokes, np.minimum(at, times[-1]))
    return steps, counts, lengths, rates
