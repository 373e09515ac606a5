"""Equilibrium of an Exudyn system by Newton's method with the whole tangent.

Exudyn's own static solver leaves the change of constraint directions out of its tangent, so it converges slowly where
pins carry much load, and not at all where such forces hold the boom up. Here the tangent is the central difference of
Exudyn's residual, which has everything.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import SolverError
from ..records import Array
from .peer import exudyn

PASSES = 40
SETTLED = 1e-6  # m and rad, last increment; what is left is near its square
LONGEST = 0.2  # m and rad, in one pass
NUDGE = 1e-5  # m and rad, of the difference quotient


def find_equilibrium(system: Any, aim: str) -> None:
    """Bring an assembled system to rest under its full load; it is the start of what follows.

    Parameters
    ----------
    aim : str
        What is looked for, in words for an error.
    """
    residual, moving = _residual_of(system)
    data = system.systemData
    state = np.concatenate([data.GetODE2Coordinates(), data.GetAECoordinates()])
    for _ in range(PASSES):
        increment = np.linalg.solve(_tangent(residual, state, moving), -residual(state))
        longest = float(np.abs(increment[:moving]).max())
        if not np.isfinite(longest):
            break
        state += increment * min(1.0, LONGEST / max(longest, 1e-300))
        if longest < SETTLED:
            residual(state)
            data.SetODE2Coordinates(state[:moving], exudyn.ConfigurationType.Initial)
            return
    raise SolverError(f"The rig did not find {aim}. Check masses and stiffnesses, or take strokes nearer to a posture.")


def _residual_of(system: Any) -> tuple[Any, int]:
    """Function from the state (coordinates, then multipliers) to Exudyn's residual, and the number of coordinates."""
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
    """Derivative of the residual; it is linear in the multipliers, which may be nudged by as much as 1 kN."""
    columns = np.empty((len(state), len(state)))
    for i in range(len(state)):
        nudge, ahead, behind = NUDGE if i < moving else 1e3, state.copy(), state.copy()
        ahead[i] += nudge
        behind[i] -= nudge
        columns[:, i] = (residual(ahead) - residual(behind)) / (2 * nudge)
    return columns
