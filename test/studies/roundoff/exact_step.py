"""Exact Newton step: digits lost by the Riccati sweep and the plain product against the whole system solved exactly."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from kernels.dense import riccati_pass
from scipy import linalg

from boom_twin import Scene
from boom_twin.analysis.equilibrium import set_undeformed
from boom_twin.analysis.methods import FAMILIES
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.plan import Plan
from boom_twin.kernels.elements.cylinder import compliance_and_lag
from boom_twin.kernels.integrators import prepare
from boom_twin.kernels.tables import OK, Motion, State, Work
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.matrix_product import new_product, plain_pass

from .dense_solver import Kinematics, Long

EPS = float(np.finfo(float).eps)
LOAD = 1e-15  # s^2, times the gain: share of gravity, small enough for the tangent not to change, see `_increments`
ROUNDS = 12  # of equilibration, and most of refinement


@dataclass(frozen=True)
class StepRoundoff:
    """Round-off in one step of a boom: relative errors of the tip's increment by each way of solving."""

    riccati: float  # error of the sweep
    plain: float  # error of the plain product, NaN if it gave no increment
    dense: float  # error of LU of the whole
    exact: float  # what the last refinement of the exact solution changed


def digits(error: float) -> float:
    """Decimal digits lost of the 16 that a double has, by a relative error."""
    return 16.0 if not math.isfinite(error) else min(16.0, max(0.0, math.log10(max(error, EPS) / EPS)))


def one_step(scene: Scene, angles: np.ndarray, step: float, rho: float) -> StepRoundoff:
    """Compare on a boom at rest at joint `angles` (rad), undeformed, that gravity begins to move; step in s.

    The base is rigid.
    """
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    set_undeformed(plan, state, angles)
    place(plan.tables, state, work)
    scheme = prepare(FAMILIES["generalised-alpha"], rho, step, work.weights)
    motion = Motion(scheme.gain, scheme.rate, work.position.copy(), -scheme.rate * work.position)
    kinematics = Kinematics(plan, state.z.copy())
    system = _System(plan, kinematics, scheme.gain, scheme.rate, work.position[plan.tables.cylinders.history].copy())
    exact, last = system.solve()
    tip = kinematics.tip

    def error(increments: np.ndarray | None) -> float:
        if increments is None or not np.isfinite(increments).all():
            return math.nan
        return float(np.linalg.norm(tip @ (increments - exact)) / np.linalg.norm(tip @ exact))

    return StepRoundoff(
        error(_increments(plan, state, work, motion, _riccati)),
        error(_increments(plan, state, work, motion, _plain)),
        error(system.first),
        last,
    )


def _riccati(plan: Plan, state: State, work: Work, motion: Motion, drive: np.ndarray) -> bool:
    return bool(riccati_pass(plan, state, work, motion, drive, np.zeros(plan.joints)) == OK)


def _plain(plan: Plan, state: State, work: Work, motion: Motion, drive: np.ndarray) -> bool:
    """Return True if the plain product gives finite increments; its status does not count, as lost digits are measured."""
    product = new_product(plan.tables)
    plain_pass(plan.tables, state, work, motion, drive, np.zeros(plan.joints), product)
    return bool(np.isfinite(work.dz).all())


def _increments(
    plan: Plan, state: State, work: Work, motion: Motion, solve: Callable[[Plan, State, Work, Motion, np.ndarray], bool]
) -> np.ndarray | None:
    """Increments per unit of gravity: half the difference of two small loads, which cancels what closures lack to rounding.

    That lack, times the gain, is a force too; the load grows with the gain to stay far above its rounding.
    """
    drive, share, sides = work.position[plan.tables.cylinders.history].copy(), LOAD * motion.gain, []
    for load in (share, -share):
        loaded = replace(plan, tables=plan.tables._replace(gravity=load * plan.tables.gravity))
        if not solve(loaded, state, work, motion, drive):
            return None
        sides.append(work.dz.copy())
    return np.asarray((sides[0] - sides[1]) / (2.0 * share))


class _System:
    """The whole system in extended precision, equilibrated and factored in double."""

    def __init__(self, plan: Plan, kinematics: Kinematics, gain: float, rate: float, drives: np.ndarray) -> None:
        t, size = plan.tables, len(plan.names)
        self.moved, self.mass = kinematics.moved, (plan.masses * gain).astype(Long)
        self.mass[:size] = 0.0
        self.rest = np.zeros((size, size), dtype=Long)
        for row, beam in enumerate(t.beams):
            n, lead = int(beam.bending), 1 + Long(beam.beta) * Long(rate) * (beam.damped > 0)
            self.rest[beam.z : beam.z + n, beam.z : beam.z + n] = lead * t.stiffness[row, :n, :n]
            if beam.axial:
                self.rest[beam.z + n, beam.z + n] = lead * Long(beam.axial_stiffness)
        rows = kinematics.closures + [(int(c.z), self.moved[c.history]) for c in t.cylinders]
        for place_, row in rows:
            self.rest[place_] += row
            self.rest[:, place_] += row
        for c, drive in zip(t.cylinders, drives, strict=True):
            compliance, lag = compliance_and_lag(c, t.oils, drive)
            self.rest[c.z, c.z] -= Long(compliance) / (1 + Long(lag) * Long(rate))
        self.load = self.moved.T @ plan.weights.astype(Long)
        double = self.moved.astype(float)
        whole = double.T @ (self.mass.astype(float)[:, None] * double) + self.rest.astype(float)
        self.scale = _equilibrated(whole)
        self.factors = linalg.lu_factor(whole * np.outer(self.scale, self.scale))
        self.first = self._solved(self.load.astype(float))

    def solve(self) -> tuple[np.ndarray, float]:
        """The solution by iterative refinement, and the relative size of the last change."""
        x, change = self.first.astype(Long), math.inf
        for _ in range(ROUNDS):
            left = self.load - self.moved.T @ (self.mass * (self.moved @ x)) - self.rest @ x
            more = self._solved(left.astype(float))
            now = float(np.linalg.norm(more / self.scale) / np.linalg.norm((x / self.scale).astype(float)))
            if not now < change:
                break
            x, change = x + more, now
        return np.asarray(x), change

    def _solved(self, right: np.ndarray) -> np.ndarray:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", linalg.LinAlgWarning)
            return np.asarray(self.scale * linalg.lu_solve(self.factors, self.scale * right))


def _equilibrated(matrix: np.ndarray) -> np.ndarray:
    """Scale (n,) for rows and columns that brings the largest entry of each near 1."""
    scale = np.ones(len(matrix))
    for _ in range(ROUNDS):
        size = np.sqrt(np.abs(matrix * np.outer(scale, scale)).max(axis=1))
        scale /= np.where(size > 0.0, size, 1.0)
    return scale
