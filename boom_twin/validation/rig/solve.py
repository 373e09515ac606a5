"""Solve the Exudyn boom: equilibrium by Newton's method, motion.

Exudyn's own static solver leaves the change of constraint directions out of its tangent, so it converges slowly where
pins carry much load, and not at all where such forces hold the boom up. Here the tangent is the central difference of
Exudyn's residual, which has everything.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import SolverError, UsageError
from ...scene.schema import Scene
from ...types import Array
from . import exudyn
from .boom import SHEAR_OVER_AXIAL, build
from .probes import Probes
from .stepping import Course, Effort, ParameterChanges, Scheme, step_through
from .system import Boom, Site


def find_equilibrium(system: Any, aim: str) -> None:
    """Bring an assembled system to rest under its full load; errors name the `aim`. What follows starts there."""
    residual, moving = _residual_of(system)
    data = system.systemData
    state = np.concatenate([data.GetODE2Coordinates(), data.GetAECoordinates()])
    for _ in range(40):
        increment = np.linalg.solve(_tangent(residual, state, moving), -residual(state))
        longest = float(np.abs(increment[:moving]).max())
        if not np.isfinite(longest):
            break
        state += increment * min(1.0, 0.2 / max(longest, 1e-300))  # m and rad
        if longest < 1e-6:  # m and rad; what is left is near its square
            residual(state)
            data.SetODE2Coordinates(state[:moving], exudyn.ConfigurationType.Initial)
            return
    raise SolverError(f"The rig did not find {aim}. Check masses and stiffnesses, or take strokes nearer to a posture.")


def _residual_of(system: Any) -> tuple[Any, int]:
    """Return Exudyn's residual as a function of the state (coordinates, then multipliers), and the number of coordinates."""
    solver, settings = exudyn.MainSolverStatic(), exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.useLoadFactor = False
    settings.staticSolver.verboseMode = 0
    solver.InitializeSolver(system, settings)
    moving = solver.GetODE2size()

    def residual(state: Array) -> Array:
        system.systemData.SetODE2Coordinates(state[:moving])
        system.systemData.SetAECoordinates(state[moving:])
        solver.ComputeNewtonResidual(system, settings)
        return np.array(solver.GetSystemResidual(), float)

    return residual, moving


def _tangent(residual: Any, state: Array, moving: int) -> Array:
    """Return the derivative of the residual. It is linear in the multipliers, which may be nudged by as much as 1 kN."""
    columns = np.empty((len(state), len(state)))
    for i in range(len(state)):
        nudge, ahead, behind = 1e-5 if i < moving else 1e3, state.copy(), state.copy()  # m and rad
        ahead[i] += nudge
        behind[i] -= nudge
        columns[:, i] = (residual(ahead) - residual(behind)) / (2 * nudge)
    return columns


Drive = Callable[[Array], tuple[Array, Array]]  # times (m,) in s -> absolute strokes (m, n) in m and their rates (m, n) in m/s

TipLoad = Callable[[Array], Array]  # times (m,) in s -> external force at the tip (m, 2) in N, in the base's axes; 0 at t = 0

Change = tuple[Scene, Callable[[Array], Array]]
"""A scene that differs in stiffnesses or masses only; times (m,) in s -> share (m,) of the difference, 0 at t = 0."""


def statics(scene: Scene, strokes: Array, elements: int = 16) -> dict[str, Array]:
    """Return what `Probes.read` gives of the equilibrium under gravity at absolute `strokes` (m), shape (n,).

    There are no frequencies: Exudyn's eigenvalues lack the geometric stiffness.
    """
    return {name: rows[0] for name, rows in at_rest(scene, np.asarray(strokes, float), elements).rows.items()}


def simulate(
    scene: Scene,
    drive: Drive,
    t_end: float,
    step: float = 5e-4,
    output_step: float = 1e-3,
    elements: int = 16,
    load: TipLoad | None = None,
    changes: Sequence[Change] = (),
    sites: tuple[Site, ...] = (),
) -> dict[str, Array]:
    """Integrate the motion from rest in the equilibrium of the drive's first strokes; return what `move` does.

    Rates are zero at t = 0; `t_end` and `output_step` (s) are multiples of `step`.
    """
    first = drive(np.zeros(1))[0][0]
    return move(at_rest(scene, first, elements, sites=sites), drive, t_end, step, output_step, None, load, changes)[0]


@dataclass(frozen=True)
class Resting:
    """A boom in equilibrium, which may be moved from there any number of times; `rows` are of `Probes.read`, one each."""

    boom: Boom
    probes: Probes
    rows: dict[str, Array]


def at_rest(
    scene: Scene,
    strokes: Array,
    elements: int,
    nodally_exact: bool = False,
    lumped: bool = False,
    shear_over_axial: float = SHEAR_OVER_AXIAL,
    sites: tuple[Site, ...] = (),
) -> Resting:
    """Build the boom with its drives at `strokes` (m), shape (n,), and let it come to rest; see `build`."""
    boom = build(scene, strokes, elements, nodally_exact, lumped, shear_over_axial, sites)
    probes = Probes(boom)
    settle(boom, strokes)
    return Resting(boom, probes, probes.read(at_rest=True))


def move(
    resting: Resting,
    drive: Drive,
    t_end: float,
    step: float,
    output_step: float,
    scheme: Scheme | None = None,
    load: TipLoad | None = None,
    changes: Sequence[Change] = (),
) -> tuple[dict[str, Array], Effort]:
    """Integrate the motion of a boom at rest by a chosen scheme; return the rows of `Probes.read`, and the effort.

    ``drives`` (m, n) are added: strokes of the drives, m.
    """
    every = _ratio("output_step", output_step, step)
    count = _ratio("t_end", t_end, step)
    times: Array = step * np.arange(count + 1, dtype=np.float64)
    strokes, rates = drive(times)
    others = [(_built_alike(resting.boom, changed, strokes[0]), share(times)) for changed, share in changes]
    course = Course(strokes, rates, None if load is None else load(times), ParameterChanges(resting.boom, others))
    effort = step_through(resting.boom, course, step, output_step, scheme or Scheme())
    found = resting.probes.read(at_rest=False)
    found["forces"][0] = resting.rows["forces"][0]  # Exudyn starts with zero multipliers: incompressible cylinders read zero
    found["t"] = _recorded_times(found["t"], times[::every])
    return found | {"drives": drive(found["t"])[0]}, effort


def _built_alike(boom: Boom, scene: Scene, strokes: Array) -> Boom:
    return build(scene, strokes, boom.elements, boom.nodally_exact, boom.lumps is not None, boom.shear_over_axial, boom.sites)


def settle(boom: Boom, strokes: Array) -> None:
    """Assemble the boom and bring it to its equilibrium; it is the start of what follows."""
    boom.system.Assemble()
    aim = f"the equilibrium at strokes {', '.join(f'{s:.6g}' for s in strokes)} m"
    find_equilibrium(boom.system, aim)
    if boom.bushes:
        for bush in boom.bushes:
            bush.release(boom.system)
        find_equilibrium(boom.system, f"{aim} with play in its pins")


def _ratio(name: str, whole: float, step: float) -> int:
    count = round(whole / step)
    if count < 1 or abs(count * step - whole) > 1e-6 * step:
        raise UsageError(f"{name} = {whole:g} s: not a multiple of step = {step:g} s. Choose one that is.")
    return count


def _recorded_times(recorded: Array, times: Array) -> Array:
    """Return the times (s) of recorded rows; in long runs the sum of steps is short, and Exudyn records one step later."""
    if len(recorded) != len(times) or np.abs(recorded - times).max() > 2.0 * times[1]:
        raise SolverError(f"Exudyn recorded {len(recorded)} of {len(times)} rows. Choose another output_step.")
    return np.where(np.abs(recorded - times) < 1e-6, times, recorded)
