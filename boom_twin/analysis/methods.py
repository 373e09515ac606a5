"""Timed integration of a boom along a smooth drive by a chosen method, to compare methods."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..compiler.compile import BasisName, compile_scene
from ..compiler.plan import first_row, taken_apart, width_of
from ..errors import UsageError
from ..kernels import integrators
from ..kernels.tables import OK, SENTENCES
from ..kernels.transfer.matrix_product import new_product
from ..kernels.transfer.time_step import run
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.schema import Scene
from ..types import Array
from .doubts import step_error_warning
from .drive import PASSES, STEP_TOLERANCE
from .equilibrium import settle
from .simulate import RHO

FAMILIES = {
    "generalised-alpha": integrators.GENERALISED_ALPHA,
    "newmark": integrators.NEWMARK,
    "wilson": integrators.WILSON,
    "houbolt": integrators.HOUBOLT,
    "park": integrators.PARK,
}

Drive = Callable[[Array], tuple[Array, Array]]
"""Times (m,) in s -> absolute strokes (m, n) in m and their rates (m, n) in m/s; the rates are zero at t = 0."""


@dataclass(frozen=True)
class Method:
    """Integration method; UsageError if it is unknown."""

    integrator: str = "generalised-alpha"  # "generalised-alpha", "newmark", "wilson", "houbolt" or "park"
    parameter: float = RHO  # rho of generalised-alpha, gamma of Newmark, theta of Wilson; Houbolt and Park have none
    passes: int = int(PASSES)  # largest number of Newton passes in a step; 1 is the papers' linearised pass
    tolerance: float = STEP_TOLERANCE  # rad, see `kernels.transfer.time_step.advance`
    product: str = "riccati"  # "riccati" or "plain", the papers' product of transfer matrices

    def __post_init__(self) -> None:
        if self.integrator not in FAMILIES:
            raise UsageError(f"integrator = {self.integrator!r}: not known. Take one of {', '.join(FAMILIES)}.")
        if self.product not in ("riccati", "plain"):
            raise UsageError(f"product = {self.product!r}: not known. Take riccati or plain.")

    @property
    def reach(self) -> float:
        """Time from the start of a step to the instant it solves for, in steps."""
        return self.parameter if self.integrator == "wilson" else 1.0


@dataclass(frozen=True)
class MethodRun:
    """Motion in rows. Rows after a failure are NaN."""

    times: Array  # (m,), s, from 0
    tip: Array  # (m, 2), m
    tip_acceleration: Array  # (m, 2), m/s^2
    joints: Array  # (m, n), rad
    cylinder_forces: Array  # (m, n), N
    pins: Array  # (m, k, 4), pins with clearance, see `compiler.plan`
    seconds: float  # CPU time of the stepping alone
    steps: int
    passes: float  # mean Newton passes per step
    status: str  # "ok", or why the motion ended
    doubt: str = ""  # warning of a coarse step or of ringing, see `analysis.doubts`; empty if none


def integrate_with(
    scene: Scene,
    drive: Drive,
    duration: float,
    step: float,
    every: int = 1,
    method: Method | None = None,
    basis: BasisName = "end-shapes",
    angles: Array | None = None,
) -> MethodRun:
    """Integrate a drive in equal steps from static equilibrium at t = 0; a failed step sets `status`.

    A row follows every `every` steps. `angles` (n,) are joint angles (rad) near the equilibrium. UsageError if the duration
    is no multiple of `every` steps, or for what the plain product does not know; SolverError if there is no equilibrium.
    """
    method, rows = method or Method(), _row_count(duration, step, every)
    plan = compile_scene(scene, basis)
    if plan.pins and method.product == "plain":
        raise UsageError("product = 'plain': knows ideal pins only. Take riccati, or a scene without the block `clearance`.")
    if scene.base.stiffness is not None and method.product == "plain":
        raise UsageError("product = 'plain': knows a rigid base only. Take riccati, or a scene without base.stiffness.")
    depth, first = integrators.depth_of(FAMILIES[method.integrator]), drive(np.zeros(1))[0][0]
    state, work = plan.state(depth), plan.work(depth)
    settle(plan, state, work, first, joint_angles_of_strokes(scene, first, near=angles))
    out = np.full((rows + 1, width_of(plan)), np.nan)
    out[0] = first_row(plan, state)
    product = new_product(plan.tables) if method.product == "plain" else None
    strokes, rates = drive(np.asarray(step * (np.arange(rows * every) + method.reach), float))
    steps, counts = np.full(rows, step), np.full(rows, every, dtype=np.int64)
    begun = time.process_time()
    status, row, passes, jolt, shake = run(
        plan.tables, state, work, steps, counts, plan.closed_lengths + strokes, rates, np.zeros((0, 2)),
        FAMILIES[method.integrator], method.parameter, method.tolerance, np.int64(method.passes), product, out[1:],
    )  # fmt: skip
    seconds, found, is_done = time.process_time() - begun, taken_apart(plan, out), int(status) == OK
    tip = found.tip
    travel = float(np.linalg.norm(tip[:, 0, :2] - tip[0, 0, :2], axis=1).max())
    return MethodRun(
        times=np.asarray(step * every * np.arange(rows + 1), float),
        tip=tip[:, 0, :2],
        tip_acceleration=tip[:, 2, :2],
        joints=found.joints,
        cylinder_forces=found.cylinder_forces,
        pins=found.pins,
        seconds=seconds,
        steps=rows * every,
        passes=int(passes) / (max(int(row), 1) * every),
        status="ok" if is_done else SENTENCES[int(status)],
        doubt=step_error_warning(jolt, shake, travel, step * rows * every * step) if is_done else "",
    )


def _row_count(duration: float, step: float, every: int) -> int:
    rows = round(duration / (step * every))
    if rows < 1 or abs(rows * step * every - duration) > 1e-6 * step:
        raise UsageError(f"duration = {duration:g} s: not a multiple of {every} steps of {step:g} s. Choose one that is.")
    return rows
