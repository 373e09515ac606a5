"""Step the finite-segment reference boom by SciPy's stiff solver."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.integrate import solve_ivp

from boom_twin import Scene
from boom_twin.errors import SolverError, UsageError

from .boom import Segments
from .equations import Drive, Equations
from .equilibrium import equilibrium
from .geometry import pieces

Solver = Literal["Radau", "BDF", "LSODA"]
ABSOLUTE = 1e-2  # absolute tolerance of a coordinate (rad, m) over the relative one; ten times that for rates
LONG = 2.0  # s
MOST = 400  # coordinates; beyond, the equilibrium alone takes minutes


@dataclass(frozen=True)
class SegmentMotion:
    """A motion at given times; m rows, n cylinders.

    Attributes
    ----------
    tip, tip_acceleration : ndarray, shape (m, 2)
        m, m/s^2.
    joints, cylinder_forces : ndarray, shape (m, n)
        rad, N.
    seconds : float
        CPU time of the solver alone, fastest of the repeats.
    evaluations : int
        Of the equations of motion.
    coordinates : int
    """

    tip: np.ndarray
    tip_acceleration: np.ndarray
    joints: np.ndarray
    cylinder_forces: np.ndarray
    seconds: float
    evaluations: int
    coordinates: int


def follow(
    scene: Scene,
    drive: Drive,
    angles: np.ndarray,
    times: np.ndarray,
    fineness: int,
    tolerance: float,
    solver: Solver = "Radau",
    repeats: int = 1,
) -> SegmentMotion:
    """Start at rest in the equilibrium of the drive at the first time and follow it.

    Parameters
    ----------
    drive : callable
        Time -> lengths, rates and accelerations of the drives, each (n,).
    angles : ndarray, shape (n,)
        Joint angles (rad) of the undeformed boom at the start.
    times : ndarray, shape (m,)
        s, ascending; of the rows.
    fineness : int
        The boom has about 4 times as many springs in every flexible section.
    tolerance : float
        Relative error of a step that the solver aims at.
    solver : str
        Of `scipy.integrate.solve_ivp`. Radau was the fastest for errors of the tip from 0.1 to 3 mm.
    repeats : int
        How often the motion is stepped, for the time; fewer times if that takes more than `LONG`.

    Raises
    ------
    UsageError
        More than `MOST` coordinates.
    SolverError
        No equilibrium, or the solver gave up.
    """
    size = sum(1 + 2 * sum(p.springs for p in pieces(scene, i, fineness)) for i in range(len(scene.sections)))
    if size > MOST:
        raise UsageError(f"fineness = {fineness}: the boom has {size} coordinates, at most {MOST} are sensible. Take less.")
    equations, start = Equations(scene, drive, fineness), _start(scene, drive(float(times[0]))[0], angles, fineness)
    seconds: list[float] = []
    while not seconds or (len(seconds) < repeats and sum(seconds) < LONG):
        begun = time.thread_time()
        found = _solved(equations, start, times, tolerance, solver)
        seconds.append(time.thread_time() - begun)
    rows = [_row(equations, at, state[:size], state[size:]) for at, state in zip(times, found.y.T, strict=True)]
    tip, acceleration, joints, forces = (np.array(column) for column in zip(*rows, strict=True))
    return SegmentMotion(tip, acceleration, joints, forces, min(seconds), int(found.nfev), size)


def _solved(equations: Equations, start: np.ndarray, times: np.ndarray, tolerance: float, solver: Solver) -> Any:
    """The solver's states at `times`, from rest at the coordinates `start`; SolverError if it gave up."""
    size = len(start)

    def rates(at: float, state: np.ndarray) -> np.ndarray:
        return np.concatenate([state[size:], equations.accelerations(at, state[:size], state[size:])[0]])

    def slopes(_: float, state: np.ndarray) -> np.ndarray:
        return equations.state_jacobian(state[:size], state[size:])

    absolute = ABSOLUTE * tolerance * np.repeat([1.0, 10.0], size)
    span, first = (float(times[0]), float(times[-1])), np.concatenate([start, np.zeros(size)])
    try:
        found = solve_ivp(rates, span, first, solver, t_eval=times, rtol=tolerance, atol=absolute, jac=slopes)
    except np.linalg.LinAlgError:
        raise SolverError("the mass matrix is singular: a part can move without any mass. Give it one.") from None
    if not found.success:
        raise SolverError(f"{solver} stopped at t = {found.t[-1]:g} s: {found.message}. Take another tolerance.")
    return found


def _start(scene: Scene, lengths: np.ndarray, angles: np.ndarray, fineness: int) -> np.ndarray:
    """Equilibrium in the coordinates of `Equations`: those of `Segments` without the headings of links."""
    model = Segments(scene, fineness)
    q, *_ = equilibrium(model, lengths, angles)
    kept: list[bool] = []
    for index, joint in enumerate(scene.joints):
        springs = sum(piece.springs for piece in pieces(scene, index, fineness))
        kept += [True, *([] if joint.kind == "A" else [False, False]), *([True] * (2 * springs))]
    return np.asarray(q[np.array(kept)])


def _row(
    equations: Equations, at: float, q: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    acceleration, forces, placed = equations.accelerations(at, q, v)
    return placed.tip.value[0], placed.tip.jacobian[0] @ acceleration + placed.tip.bias[0], placed.joints, forces
