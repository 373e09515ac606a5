"""Simulate the boom's answer to a stroke history, from rest or the end of another, with an estimate of its error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compiler.compile import compile_scene
from ..errors import SolverError, UsageError
from ..kernels.elements.pin_contact import LOST
from ..kernels.tables import OK, SENTENCES, State
from ..scene.edit import with_rigid_cylinders
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.load import SceneSource, as_scene
from ..scene.schema import Scene
from ..system.result_text import SummaryDisplay, data_frame, numbers
from ..types import Array
from .doubts import (
    EstimatedError,
    joint_doubts,
    motion_beyond_validity,
    ringing,
    row_errors,
    step_errors,
    too_fast,
    warnings_of,
)
from .drive import NO_FORCE, DriveCourse, Run, drives_of, force_at
from .equilibrium import rest_at, travel_words
from .steady_state import check_force_rows

RHO = 0.8


@dataclass(frozen=True, repr=False)
class Simulation(SummaryDisplay):
    """Results at the rows of the drive. m rows, n sections.

    Attributes
    ----------
    times : ndarray, shape (m,)
        s.
    strokes, lengths, joints, cylinder_forces : ndarray, shape (m, n)
        Drives, and lengths of the cylinders pin to pin less `closed_length`, m; rad; N (tension positive).
    tip, tip_velocity, tip_acceleration : ndarray, shape (m, 3)
        x, y, orientation of the last head, in m and rad, and their rates.
    step_errors, row_errors : tuple of EstimatedError
        Estimated errors of tip, acceleration and forces, from steps and from what lies between the rows of the drive; empty
        where they were not asked for.
    doubts : tuple of str
        What gives reason to doubt the motion, one sentence each: errors beyond their bounds, ringing, strokes too fast,
        joints out of their range or next to a dead centre, deflections that the model is not meant for.
    pin_names : tuple of str
        Pins with clearance.
    pins : ndarray, shape (m, k, 4)
        Offset x, y of the journal in its bush (m, model axes), contact force (N), 1 where they touch. Of a cylinder's pin the
        cylinder's eye is the journal, of a section's pivot the outer section, of a link's pin the link, of Q link R.
    lost_contacts : ndarray of int, shape (k,)
        How often each of them lost contact.
    end : boom_twin.kernels.tables.State
        The boom at the last row, from which another simulation may go on.
    """

    times: Array
    strokes: Array
    lengths: Array
    joints: Array
    cylinder_forces: Array
    tip: Array
    tip_velocity: Array
    tip_acceleration: Array
    step_errors: tuple[EstimatedError, ...]
    row_errors: tuple[EstimatedError, ...]
    doubts: tuple[str, ...]
    pin_names: tuple[str, ...]
    pins: Array
    lost_contacts: NDArray[np.int64]
    end: State

    @property
    def doubt(self) -> str:
        """All `doubts` in one text; empty if there are none."""
        return "; ".join(self.doubts)

    def columns(self) -> dict[str, Array]:
        """The motion as the columns of the CSV that `boom_twin simulate` writes.

        Returns
        -------
        dict of str to ndarray, shape (m,)
            By name with unit.
        """
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
        return columns | {f"length_{i + 1}_m": self.lengths[:, i] for i in range(n)}

    def to_frame(self) -> Any:
        """`columns` as a ``pandas.DataFrame``; UsageError if pandas is not installed."""
        return data_frame(self.columns())

    def summary_rows(self) -> dict[str, str]:
        """See `boom_twin.system.result_text.SummaryDisplay`."""
        return {
            "rows": f"{len(self.times)}, {self.times[-1] - self.times[0]:.4g} s",
            "tip at the end": f"{numbers(self.tip[-1, :2])} m",
            "tip acceleration": f"{float(np.hypot(*self.tip_acceleration[:, :2].T).max()):.3g} m/s² at most",
            "doubts": self.doubt or "none",
        }


def simulate(
    scene: SceneSource,
    times: Array,
    strokes: Array | None = None,
    dt: float = 1e-3,
    angles: Array | None = None,
    rho: float = RHO,
    estimate_errors: bool = True,
    start: State | None = None,
    lengths: Array | None = None,
    force: Array | None = None,
) -> Simulation:
    """Start at rest in the equilibrium of the first row, or where another motion ended, and follow drives or lengths.

    Lengths are constraints: the boom moves as with incompressible cylinders. Their forces give the oil springs' extension, and
    that the drives.

    Parameters
    ----------
    scene : Scene, path or mapping
        The boom, of n sections; as for `boom_twin.statics`.
    times : ndarray, shape (m,)
        s, increasing, any spacing.
    strokes : ndarray, shape (m, n), optional
        Absolute strokes of the drives, m. Between rows they follow a monotone cubic (PCHIP): C1, no overshoot.
    dt : float
        Longest step, s; steps end on the rows.
    angles : ndarray, shape (n,), optional
        Joint angles (rad) next to which the first equilibrium is looked for.
    rho : float
        Spectral radius of generalised-alpha at infinite frequency.
    estimate_errors : bool
        Step the motion again with half the step and by every second row, to tell how far it can be trusted; takes four to
        seven times as long as stepping once.
    start : boom_twin.kernels.tables.State, optional
        `Simulation.end` of a motion of the same boom, to go on from there instead of from rest.
    lengths : ndarray, shape (m, n), optional
        Lengths of the cylinders less `closed_length`, m, instead of `strokes`; what stroke transducers read.
    force : ndarray, shape (m, 2) or (k, 3), optional
        Force at the tip, x and y in the axes of the base, N, at the rows of `times`; or rows of its own time (s), x and y.
        Between rows it follows the same curve as strokes. Before its first and after its last row it is constant. The first
        equilibrium is under the force at the first row of `times`.

    Returns
    -------
    Simulation
        Tip, joints and cylinder forces at the rows of `times`, and what gives reason to doubt them.

    Raises
    ------
    UsageError
        Rows that do not increase, values that are not finite or out of the cylinders' travel, forces above 1e7 N, dt not
        positive; a state of another boom; not exactly one of strokes and lengths.
    SolverError
        No equilibrium at the first row, or a step that failed; says when.
    """
    scene = as_scene(scene)
    if lengths is None and strokes is not None:
        course = course_of(scene, times, strokes, dt, angles, rho, start, force=force)
    elif lengths is not None and strokes is None:
        course = course_of(with_rigid_cylinders(scene), times, lengths, dt, angles, rho, start, "length", force)
    else:
        raise UsageError("give either strokes or lengths, not both and not neither.")
    times, strokes, plan = course.times, course.strokes, course.plan
    own = course.stepped(np.arange(len(times)), dt)
    if own.status != OK:
        raise SolverError(f"step failed after t = {times[own.row]:.6g} s: {SENTENCES[own.status]}.")
    by_steps, by_rows = (step_errors(course, own, dt), row_errors(course, own)) if estimate_errors else ((), ())
    tip = own.rows.tip
    doubts = (
        *_doubts(times, dt, own, by_steps, by_rows),
        *joint_doubts(scene, times, own.rows.joints),
        *motion_beyond_validity(scene, strokes, tip[:, 0, :2], angles),
    )
    if lengths is not None:
        strokes = drives_of(compile_scene(scene), times, own.rows.lengths, own.rows.cylinder_forces)
    return Simulation(
        times, strokes, own.rows.lengths, own.rows.joints, own.rows.cylinder_forces, tip[:, 0], tip[:, 1], tip[:, 2],
        by_steps, by_rows, doubts, plan.pins, own.rows.pins, own.lost, own.end,
    )  # fmt: skip


def course_of(
    scene: Scene,
    times: Array,
    strokes: Array,
    dt: float = 1e-3,
    angles: Array | None = None,
    rho: float = RHO,
    start: State | None = None,
    name: str = "stroke",
    force: Array | None = None,
) -> DriveCourse:
    """Return the checked drive and the boom at its first row, for `simulate` to step through; arguments and errors as there.

    Errors call the strokes by `name`.
    """
    times, strokes = _checked(scene, times, strokes, dt, name)
    force = NO_FORCE if force is None else _checked_force(times, np.asarray(force, float))
    load = force_at(force, times[:1])[0]
    if start is None:
        plan, begin, work = rest_at(scene, strokes[0], joint_angles_of_strokes(scene, strokes[0], near=angles, name=name), load)
        return DriveCourse(plan, begin, work, times, strokes, rho, force)
    plan, begin = compile_scene(scene), State(*(array.copy() for array in start))
    if [array.shape for array in begin] != [array.shape for array in plan.state()]:
        raise UsageError("start: this state is of another boom. Give the end of a simulation of the same scene.")
    begin.contacts[:, LOST] = 0.0
    return DriveCourse(plan, begin, plan.work(), times, strokes, rho, force)


def _checked_force(times: Array, force: Array) -> Array:
    if force.shape == (len(times), 2):
        force = np.column_stack([times, force])
    if force.ndim != 2 or force.shape[1] != 3 or not len(force):
        raise UsageError(f"force = array of shape {force.shape}: give x and y at every row of times, or rows of t_s, x, y.")
    check_force_rows(force, "force", ("t_s", "tip_fx_N", "tip_fy_N"))
    return force


def _doubts(
    times: Array, dt: float, own: Run, by_steps: tuple[EstimatedError, ...], by_rows: tuple[EstimatedError, ...]
) -> Iterator[str]:
    """Yield warnings that the motion `own` gives of itself; steps of `dt` (s), rows at `times` (s)."""
    apart = float(np.diff(times, prepend=times[0]).max())
    yield from ringing(own.jolt, own.shake, own.square)
    yield from warnings_of(by_steps, f"the step of {dt:g} s is coarse", "take a smaller step")
    yield from warnings_of(
        by_rows, f"the rows of the drive, up to {apart:g} s apart, are too coarse", "give rows closer together"
    )
    yield from too_fast(times, own.rates)


def _checked(scene: Scene, times: Array, strokes: Array, dt: float, name: str) -> tuple[Array, Array]:
    most_steps = 2e7  # of a motion, whose drive takes 64 bytes a step and cylinder
    closest = 1e-6  # s, between rows: rounding of positions over the square of a shorter step is more than 0.01 m/s^2
    times, strokes = np.asarray(times, dtype=float), np.asarray(strokes, dtype=float)
    n = len(scene.joints)
    if not (math.isfinite(dt) and dt > 0.0):
        raise UsageError(f"dt = {dt!r} s: must be positive. Take 0.001.")
    if times.ndim != 1 or strokes.shape != (len(times), n) or len(times) < 1:
        raise UsageError(f"{name}s = array of shape {strokes.shape}: give one row per time and {n} columns.")
    if not (np.isfinite(times).all() and np.isfinite(strokes).all()):
        row, column = np.argwhere(~np.isfinite(np.column_stack([times, strokes])))[0].tolist()
        where = f"{name}_{column}_m" if column else "t_s"
        raise UsageError(f"row {row + 1} of the drive, {where}: not finite. Give a number in every column.")
    if np.any((spans := np.diff(times)) < closest):
        row = int(np.argmax(spans < closest))
        where = f"t_s = {times[row + 1]:.9g} s in row {row + 2} of the drive"
        if spans[row] <= 0.0:
            raise UsageError(f"{where}: not after row {row + 1}. Sort the rows.")
        raise UsageError(f"{where}: {spans[row]:.2g} s after row {row + 1}, {closest:g} s at least. Leave one of the two out.")
    if (steps := (times[-1] - times[0]) / dt) > most_steps:
        raise UsageError(
            f"t_s = {times[-1]:g} s in row {len(times)} of the drive: {steps:.2g} steps of {dt:g} s, {most_steps:.2g} at most. "
            "Give times in s, if these are in ms, us or ns; else a larger step, or the motion in pieces."
        )
    most = np.array([joint.cylinder.max_stroke for joint in scene.joints])
    beyond = np.argwhere((strokes < 0.0) | (strokes > most))
    if len(beyond):
        row, i = beyond[0]
        raise UsageError(f"{name}_{i + 1} = {strokes[row, i]:g} m in row {row + 1} of the drive: {travel_words(i, most[i])}")
    return times, strokes
