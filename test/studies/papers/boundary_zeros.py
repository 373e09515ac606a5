"""Zeros of boundary residuals by bisection, as the second paper finds them.

Equilibrium: section 1 is held at an angle, all else comes to rest by Newton passes, and the torque that the held pivot then
bears is the residual of the boundary M = 0. Its sign changes at the equilibrium; the interval is halved until it is 1e-7 wide.

Vibration: the determinant of what the sweep leaves of K - omega^2 M at the base changes its sign at a natural frequency.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from reference.ideal_pins import refuse_clearance, refuse_elastic_base

from boom_twin import Scene
from boom_twin.analysis.equilibrium import clamp_pins, rest_at, set_undeformed
from boom_twin.analysis.modal import natural_modes
from boom_twin.compiler.compile import compile_scene
from boom_twin.errors import SolverError, UsageError
from boom_twin.kernels.tables import OK, Z_FORCE_A, Z_SECTION, Motion
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out
from boom_twin.scene.kinematics import posture_angles, strokes_of_posture

WIDTH = 1e-7  # rad, the papers' tolerance of the interval
BEYOND, LONGEST, SETTLED, PASSES = 0.05, 0.1, 1e-11, 60  # rad


@dataclass(frozen=True)
class BoundaryZero:
    """One posture: angle of section 1 (rad) by bisection and by Newton's method, halvings, torque (N m) left by the first."""

    posture: str
    bisected: float
    newton: float
    halvings: int
    residual: float


def bisect(residual: Callable[[float], float], low: float, high: float, width: float) -> tuple[float, int]:
    """A zero between two arguments where the residual differs in sign, to `width`; and the number of halvings.

    Raises
    ------
    UsageError
        The signs are alike.
    """
    first, count = residual(low), 0
    if first * residual(high) > 0.0:
        raise UsageError(f"no change of sign between {low:g} and {high:g}: widen the interval.")
    while high - low > width:
        middle, count = 0.5 * (low + high), count + 1
        if residual(middle) * first > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high), count


def equilibrium(scene: Scene, posture: str) -> BoundaryZero:
    """Both ways in a posture; ideal pins."""
    refuse_clearance(scene, "the bisection of the boundary")
    refuse_elastic_base(scene, "the bisection of the boundary")
    if scene.joints[0].cylinder.k is None:
        raise UsageError("joints[0].cylinder.k: not given, so section 1 cannot be held at another angle. Give it a stiffness.")
    strokes, angles = strokes_of_posture(scene, posture), posture_angles(scene, posture)
    plan, state, _ = rest_at(scene, strokes, angles)
    at = plan.tables.joints[0].z + Z_SECTION
    newton = float(state.z[at])
    held = HeldBoom(scene, strokes, angles)
    zero, halvings = bisect(held.torque, angles[0] - BEYOND, angles[0] + BEYOND, WIDTH)
    return BoundaryZero(posture, zero, newton, halvings, held.torque(zero))


class HeldBoom:
    """A boom at rest at strokes (m) next to joint angles (rad), both (n,), whose section 1 is held at an angle."""

    def __init__(self, scene: Scene, strokes: np.ndarray, angles: np.ndarray) -> None:
        self._plan = compile_scene(scene)
        self._angles, self._drive = angles, self._plan.closed_lengths + strokes

    def torque(self, angle: float) -> float:
        """Return the torque (N m) that the held pivot bears with section 1 at `angle` (rad)."""
        plan, t = self._plan, self._plan.tables
        state, work = plan.state(), plan.work()
        clamp_pins(state)
        set_undeformed(plan, state, np.concatenate([[angle], self._angles[1:]]))
        still = np.zeros(len(work.position))
        motion, first, last = Motion(0.0, 0.0, still, still), np.int64(1), np.int64(len(t.operations))
        for _ in range(PASSES):
            place(t, state, work)
            clear_cut(work, FREE)
            status, _, m = sweep_in(
                t, state, work, motion, self._drive, np.zeros(plan.joints), first, last, FREE, work.condensed
            )
            if status != OK:
                break
            push = -work.p[3] / work.s[3, 3]
            left = float(work.p[2] + work.s[2, 3] * push)
            work.dz[:] = 0.0
            work.cut[:3], work.cut[3] = 0.0, push
            sweep_out(t, state, work, work.condensed, first, last, m)
            work.dz[t.joints[0].z + Z_SECTION], work.dz[t.joints[0].z + Z_FORCE_A] = 0.0, push
            size = float(np.max(t.scale * np.abs(work.dz)))
            state.z[:] += min(1.0, LONGEST / max(size, 1e-300)) * work.dz
            if size < SETTLED:
                return left
        raise SolverError(f"the boom held at {angle:g} rad finds no rest.")


def frequencies(scene: Scene, posture: str, count: int) -> list[tuple[float, float]]:
    """Natural frequencies (Hz) by bisection of the base determinant and by counting, the lowest first; ideal pins."""
    plan, state, work = rest_at(scene, strokes_of_posture(scene, posture), posture_angles(scene, posture))
    t, last = plan.tables, np.int64(len(plan.tables.operations))
    drive = state.drives[0].copy()

    def determinant(frequency: float) -> float:
        place(t, state, work)
        motion = Motion(-((2.0 * np.pi * frequency) ** 2), 0.0, work.position.copy(), np.zeros(len(work.position)))
        clear_cut(work, FREE)
        sweep_in(t, state, work, motion, drive, np.zeros(plan.joints), ROOT, last, FREE, work.condensed)
        return float(np.linalg.det(work.condensed.blocks[0][:2, :2]))

    found = []
    for mode in natural_modes(plan, state, work, count, 1e-9):
        near = bisect(determinant, mode.frequency * (1.0 - 1e-3), mode.frequency * (1.0 + 1e-3), WIDTH * mode.frequency)
        found.append((near[0], mode.frequency))
    return found
