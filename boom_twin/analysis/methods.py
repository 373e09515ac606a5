"""Timed integration of a boom along a smooth drive by a chosen method, to compare methods; the motion of studies.

The motion is a quintic move from rest. The default boom in its posture `arch` moves as everywhere in the documentation: stroke
1 by 50 mm, stroke 3 by 30 mm. On any other boom every second cylinder turns its joint by `TURN`, up and down in turn so that a
long boom does not curl up: the other way where that does not fit into the joint's range and the cylinder's travel, by half (and
half again) where neither fits.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from ..compiler.compile import BasisName, compile_scene
from ..errors import UsageError
from ..kernels import integrators
from ..kernels.tables import OK, SENTENCES
from ..kernels.transfer.matrix_product import new_product
from ..kernels.transfer.time_step import observe, run
from ..scene.kinematics import joint_angles_of_strokes, posture_angles, stroke_curve, strokes_of_angles, strokes_of_posture
from ..scene.load import load_scene
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
    """Integration method."""

    integrator: str = "generalised-alpha"  # key of `FAMILIES`
    parameter: float = RHO  # rho of generalised-alpha, gamma of Newmark, theta of Wilson; Houbolt and Park have none
    passes: int = PASSES  # largest number of Newton passes in a step; 1 is the papers' linearised pass
    tolerance: float = STEP_TOLERANCE  # rad, see `kernels.transfer.time_step.advance`
    product: Literal["riccati", "plain"] = "riccati"  # plain: the papers' product of transfer matrices

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

    A row follows every `every` steps, of which the duration is a multiple. `angles` (n,) are joint angles (rad) near the
    equilibrium. UsageError for what the plain product does not know; SolverError if there is no equilibrium.
    """
    method, rows = method or Method(), round(duration / (step * every))
    plan = compile_scene(scene, basis)
    if plan.pins and method.product == "plain":
        raise UsageError("product = 'plain': knows ideal pins only. Take riccati, or a scene without the block `clearance`.")
    if scene.base.stiffness is not None and method.product == "plain":
        raise UsageError("product = 'plain': knows a rigid base only. Take riccati, or a scene without base.stiffness.")
    depth, first = integrators.depth_of(FAMILIES[method.integrator]), drive(np.zeros(1))[0][0]
    state, work = plan.state(depth), plan.work(depth)
    settle(plan, state, work, first, joint_angles_of_strokes(scene, first, near=angles))
    out = np.full((rows + 1, plan.row_width), np.nan)
    observe(plan.tables, state, out[0])
    product = new_product(plan.tables) if method.product == "plain" else None
    strokes, rates = drive(np.asarray(step * (np.arange(rows * every) + method.reach), float))
    steps, counts = np.full(rows, step), np.full(rows, every, dtype=np.int64)
    begun = time.process_time()
    status, row, passes, jolt, shake = run(
        plan.tables, state, work, steps, counts, plan.closed_lengths + strokes, rates, np.zeros((0, 2)),
        FAMILIES[method.integrator], method.parameter, method.tolerance, method.passes, product, out[1:],
    )  # fmt: skip
    seconds, found, is_done = time.process_time() - begun, plan.results(out), int(status) == OK
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


ARCH = "arch"
TURN = math.radians(8.0)
RISE = 1.5  # s
DURATION = 4.0  # s


@dataclass(frozen=True)
class Motion:
    """Strokes of a smooth move. n cylinders."""

    label: str  # description for a report
    angles: Array  # (n,), joint angles (rad) of the undeformed boom at the start
    first: Array  # (n,), strokes (m) at the start
    travel: Array  # (n,), change of the strokes (m)
    rise: float = RISE  # s, after which the strokes have arrived
    duration: float = DURATION  # s, until which they hold

    def __call__(self, times: Array) -> tuple[Array, Array]:
        """Strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        x = np.clip(np.asarray(times, float) / self.rise, 0.0, 1.0)[:, None]
        place, rate = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * (x * (1.0 - x)) * (x * (1.0 - x))
        return self.first + place * self.travel, rate / self.rise * self.travel


def motion_of(scene: Scene, posture: str | None = None, duration: float = DURATION) -> Motion:
    """Return the motion of a scene for `duration` (s); see the head of this file.

    It starts in `posture`: by default `arch`, else the first posture, else next to the middle of the joints' ranges.
    UsageError if there is no such posture, or no cylinder with room to move.
    """
    arch_travel = (0.05, 0.0, 0.03, 0.0)  # m
    name = posture or (ARCH if ARCH in scene.postures else next(iter(scene.postures), None))
    if name is None:
        angles = np.array([_middle(scene, i) for i in range(len(scene.joints))])
        first = strokes_of_angles(scene, angles)
    else:
        angles, first = posture_angles(scene, name), strokes_of_posture(scene, name)
    start = f"posture {name}" if name else "the middle of the ranges"
    travel = np.array(arch_travel) if name == ARCH and _is_default(scene, first) else _travel(scene, angles, first)
    if not travel.any():
        raise UsageError(f"the boom in {start}: no cylinder has room to move. Name another posture.")
    far = ", ".join(f"stroke {i + 1} by {1e3 * travel[i]:+.1f} mm" for i in np.flatnonzero(travel)[:6])
    more = ", .." if np.count_nonzero(travel) > 6 else ""
    label = f"from rest in {start}: {far}{more} in {RISE:g} s, {duration:g} s in all"
    return Motion(label, angles, first, travel, RISE, duration)


@lru_cache(maxsize=1)
def _arch_strokes() -> tuple[float, ...]:
    return tuple(strokes_of_posture(load_scene(), ARCH).tolist())


def _is_default(scene: Scene, first: Array) -> bool:
    """Return True if the cylinders stand as those of the default scene in its arch."""
    expected = _arch_strokes()
    return len(scene.joints) == len(expected) and bool(np.allclose(first, expected, rtol=0.0, atol=1e-9))


def _middle(scene: Scene, index: int) -> float:
    """Angle (rad) of joint `index` nearest to the middle of its range that its cylinder reaches."""
    range_samples = 181  # of a joint's range
    low, high = np.radians(scene.joints[index].range_deg)
    grid = np.linspace(low, high, range_samples)
    strokes = stroke_curve(scene, index, grid)
    with np.errstate(invalid="ignore"):
        reached = grid[(strokes >= 0.0) & (strokes <= scene.joints[index].cylinder.max_stroke)]
    if not len(reached):
        raise UsageError(f"cylinder_{index + 1}: no stroke is within both max_stroke and range_deg. Widen one.")
    return float(reached[np.argmin(np.abs(reached - 0.5 * (low + high)))])


def _travel(scene: Scene, angles: Array, first: Array) -> Array:
    """Travel (m) of every cylinder by the rule for booms in general, shape (n,)."""
    halvings = 4
    travel = np.zeros(len(angles))
    for turn, i in enumerate(range(0, len(angles), 2)):
        up = 1.0 if turn % 2 == 0 else -1.0
        sizes = [sign * TURN / 2**halving for halving in range(halvings) for sign in (up, -up)]
        aims = [_stroke_after(scene, i, float(angles[i]), size) for size in sizes]
        travel[i] = next((aim - first[i] for aim in aims if aim is not None), 0.0)
    return travel


def _stroke_after(scene: Scene, index: int, angle: float, turn: float) -> float | None:
    """Stroke (m) of joint `index` turned from `angle` by `turn` (rad); None if that is out of bounds or past a dead centre."""
    joint = scene.joints[index]
    low, high = np.radians(joint.range_deg)
    if not low <= angle + turn <= high:
        return None
    curve = stroke_curve(scene, index, np.linspace(angle, angle + turn, 9))
    inside = np.isfinite(curve).all() and 0.0 <= curve[-1] <= joint.cylinder.max_stroke
    way = np.sign(np.diff(curve))
    return float(curve[-1]) if inside and bool(np.all(way == way[0])) and way[0] != 0.0 else None
