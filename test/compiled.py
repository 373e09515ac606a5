"""A scene's compiled model for tests that step or solve it by themselves."""

from __future__ import annotations

import numpy as np

from boom_twin.analysis.drive import PASSES, STEP_TOLERANCE
from boom_twin.analysis.equilibrium import rest_at, set_undeformed, settle
from boom_twin.analysis.simulate import RHO
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.plan import Plan
from boom_twin.kernels.integrators import GENERALISED_ALPHA
from boom_twin.kernels.transfer.time_step import observe, run

__all__ = ["RHO", "Plan", "compile_scene", "rest_at", "set_undeformed", "settle"]


def stepped(plan, state, work, step, every, lengths, rates, rho=RHO, tolerance=STEP_TOLERANCE):
    """Rows of `observe` (m/every + 1, width) along drives (m, n) in steps of `step` s from `state`, which they move."""
    rows = np.empty((len(lengths) // every + 1, plan.row_width))
    observe(plan.tables, state, rows[0])
    steps, counts = np.full(len(rows) - 1, step), np.full(len(rows) - 1, every)
    status, row, *_ = run(
        plan.tables, state, work, steps, counts, lengths, rates, np.zeros((0, 2)), GENERALISED_ALPHA, rho, tolerance, PASSES,
        None, rows[1:],
    )  # fmt: skip
    assert status == 0, f"status {status} in row {row}"
    return rows
