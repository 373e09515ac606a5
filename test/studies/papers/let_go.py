"""State of a boom that nothing has held until now: straight sections on uncompressed cylinders, without motion.

The accelerations are those of steps so short that they do not move the boom. They are solved for two lengths of the step, and
the error of first order is removed (Richardson).
"""

from __future__ import annotations

import math

import numpy as np

from boom_twin import Scene, SolverError
from boom_twin.analysis.drive import PASSES
from boom_twin.analysis.equilibrium import set_undeformed
from boom_twin.compiler.compile import compile_scene
from boom_twin.kernels.integrators import NEWMARK, A, P, X, prepare
from boom_twin.kernels.tables import OK, SENTENCES, State
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.time_step import LONGEST_INCREMENT, advance
from boom_twin.types import Array

SHORT = 2e-5  # s
HALF = math.sqrt(2.0) - 0.5  # gamma of Newmark's method with beta = 1/2
TOLERANCE = 1e-9  # rad in the last pass; the remaining error is its square


def undeflected(scene: Scene, strokes: Array, angles: Array) -> State:
    """Return the undeflected boom at `strokes` (m) and joint `angles` (rad), both (n,), just let go; pins are ideal."""
    plan = compile_scene(scene)
    state, work, drive = plan.state(), plan.work(), plan.closed_lengths + strokes
    state.drives[0] = drive
    set_undeformed(plan, state, angles)
    for _ in range(2):  # angles of cylinders are the ones next to those of the first time
        place(plan.tables, state, work)
        state.history[X] = work.position
    ends = []
    for step in (SHORT, 0.5 * SHORT):
        trial, scheme = State(*(array.copy() for array in state)), prepare(NEWMARK, HALF, step, work.weights)
        still = np.zeros(plan.joints)
        status, _, _ = advance(
            plan.tables, trial, work, scheme, drive, still, TOLERANCE, PASSES, LONGEST_INCREMENT, None, False
        )
        if status != OK:
            raise SolverError(f"the boom cannot be let go: {SENTENCES[status]}.")
        ends.append((trial.history[A], trial.z))
    acceleration, z = (2.0 * fine - coarse for coarse, fine in zip(*ends, strict=True))
    forces = plan.tables.moving == 0.0
    state.z[forces] = z[forces]
    state.history[X, : len(state.z)] = state.z
    state.history[A] = state.history[P] = acceleration
    return state
