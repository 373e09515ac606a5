"""Exact Newton step: digits lost by the Riccati sweep and the plain product against the whole system solved exactly."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from kernels.dense import riccati_pass
from scipy import linalg

from boom_twin import Scene
from boom_twin.analysis.equilibrium import set_undeformed
from boom_twin.analysis.methods import FAMILIES
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.plan import Plan
from boom_twin.kernels.elements.cylinder import BARREL, compliance_and_lag
from boom_twin.kernels.elements.linkage import LINK_L
from boom_twin.kernels.integrators import prepare
from boom_twin.kernels.tables import (
    BEAM,
    BODY,
    JOINT_A,
    JOINT_B,
    OFFSET,
    OK,
    ROD_PIN,
    STATION,
    Z_LAMBDA,
    Z_LINK_L,
    Z_LINK_R,
    Motion,
    State,
    Work,
)
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.matrix_product import new_product, plain_pass

Long = np.longdouble


@dataclass
class FrameIncrements:
    """A place and its increments per unknown. x, y, theta: m, m, rad; rows: (3, unknowns)."""

    x: np.longdouble
    y: np.longdouble
    theta: np.longdouble
    rows: np.ndarray

    def point(self, x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
        """A point (x, y) (m) in the axes of this frame: where it is, shape (2,), and its increments, shape (2, unknowns)."""
        c, s = np.cos(self.theta), np.sin(self.theta)
        bx, by = c * x - s * y, s * x + c * y
        moved = np.stack([self.rows[0] - by * self.rows[2], self.rows[1] + bx * self.rows[2]])
        return np.array([self.x + bx, self.y + by]), moved

    def shifted(self, x: float, y: float) -> FrameIncrements:
        """The frame with its origin at (x, y)."""
        at, moved = self.point(x, y)
        return FrameIncrements(at[0], at[1], self.theta, np.stack([*moved, self.rows[2]]))

    def turned(self, theta: np.longdouble, row: np.ndarray) -> FrameIncrements:
        """The frame at the same place with an orientation of its own."""
        return FrameIncrements(self.x, self.y, theta, np.stack([self.rows[0], self.rows[1], row]))


@dataclass
class Kinematics:
    """Increments by unknown at an undeformed state `z`: of all histories, of closures, of pins.

    They are written here from the tables of a plan alone, in extended precision; nothing is condensed. With all forces zero
    there is no geometric stiffness, so that

        [ J' M A J + (1 + beta C) K_el   G' ] [ dz ]   [ J' w ]
        [ G                              -c ] [ df ] = [ 0    ]

    holds exactly: J moves all mass points, G all closures and cylinder lengths, c are compliances, w weights.
    """

    plan: Plan
    z: np.ndarray
    moved: np.ndarray = field(init=False)
    closures: list[tuple[int, np.ndarray]] = field(default_factory=list)
    pins: dict[tuple[int, int], tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        size = len(self.plan.names)
        self.eye = np.eye(size, dtype=Long)
        self.moved = np.zeros((len(self.plan.masses), size), dtype=Long)
        t = self.plan.tables
        frame = FrameIncrements(Long(0), Long(0), Long(0), np.zeros((3, size), dtype=Long))
        base = [Long(t.joints[0].x) + Long(t.linkages[0].cx), Long(t.joints[0].y) + Long(t.linkages[0].cy)]
        self.pins[0, 0] = np.array(base), np.zeros((2, size), dtype=Long)
        for operation in t.operations:
            frame = self._operate(int(operation.kind), int(operation.row), frame)
        self.tip = frame.rows
        self.moved[t.tip : t.tip + 3] = frame.rows

    def _operate(self, kind: int, row: int, frame: FrameIncrements) -> FrameIncrements:
        t = self.plan.tables
        if kind == JOINT_A:
            joint = t.joints[row]
            frame.x, frame.y = Long(joint.x), Long(joint.y)
            return frame.turned(Long(self.z[joint.z]), self.eye[joint.z])
        if kind == OFFSET:
            return frame.shifted(t.offsets[row].x, t.offsets[row].y)
        if kind == BODY:
            self._put(t.bodies[row].history, frame.shifted(t.bodies[row].x, t.bodies[row].y))
        elif kind == BEAM:
            return self._beam(row, frame)
        elif kind in (STATION, ROD_PIN):
            outlet = t.outlets[row]
            self.pins[int(outlet.cylinder), int(kind == ROD_PIN)] = frame.point(outlet.x, outlet.y)
            if kind == ROD_PIN:
                self._cylinder(0)
        elif kind == JOINT_B:
            return self._six_bar(row, frame)
        return frame

    def _put(self, history: int, frame: FrameIncrements) -> None:
        self.moved[history : history + 3] = frame.rows

    def _beam(self, row: int, frame: FrameIncrements) -> FrameIncrements:
        """A straight beam part: its shapes turn and shift the points, its strain stretches it."""
        t = self.plan.tables
        beam, n = t.beams[row], int(t.beams[row].bending)
        weights = t.weights[row, : beam.points + 1, : beam.points].astype(Long)
        psi = t.psi[row, : beam.points + 1, :n].astype(Long)
        c, s, along = np.cos(frame.theta), np.sin(frame.theta), weights.sum(axis=1)
        shapes = self.eye[beam.z : beam.z + n]
        across, angles = (weights @ psi[: beam.points]) @ shapes, psi @ shapes
        stretch = along[:, None] * self.eye[beam.z + n] if beam.axial else np.zeros_like(across)
        order = [*range(beam.points), beam.points]
        ends = []
        for i in order:
            own = frame.shifted(along[i], 0.0)
            own.rows[0] += c * stretch[i] - s * across[i]
            own.rows[1] += s * stretch[i] + c * across[i]
            own.rows[2] = own.rows[2] + angles[i]
            ends.append(own)
        for i in range(beam.points):
            self.moved[beam.history + 2 * i : beam.history + 2 * i + 2] = ends[i].rows[:2]
        for i in range(beam.rotary):
            self.moved[beam.history + 2 * beam.points + i] = ends[i].rows[2]
        return ends[-1]

    def _six_bar(self, index: int, frame: FrameIncrements) -> FrameIncrements:
        t = self.plan.tables
        joint, link = t.joints[index], t.linkages[index]
        section = frame.turned(Long(self.z[joint.z]), self.eye[joint.z])
        left, right = (
            own.shifted(x, y).turned(Long(self.z[joint.z + k]), self.eye[joint.z + k])
            for k, own, x, y in ((Z_LINK_L, frame, link.dx, link.dy), (Z_LINK_R, section, link.ex, link.ey))
        )
        for row in t.links[joint.first_link : joint.first_link + joint.links]:
            self._put(row.history, (left if row.side == LINK_L else right).shifted(row.middle, 0.0))
        gap = left.point(link.length_l, 0.0)[1] - right.point(link.length_r, 0.0)[1]
        self.closures += [(joint.z + Z_LAMBDA, gap[0]), (joint.z + Z_LAMBDA + 1, gap[1])]
        self.pins[index, 1] = (left if link.mount == LINK_L else right).point(link.along, link.left)
        self._cylinder(index)
        return section

    def _cylinder(self, index: int) -> None:
        """Length, and centres and angle of barrel and rod."""
        t, row = self.plan.tables, self.plan.tables.cylinders[index]
        (from_, dc), (to, dr) = self.pins[index, 0], self.pins[index, 1]
        length = np.hypot(*(to - from_))
        e = (to - from_) / length
        n = np.array([-e[1], e[0]])
        turn = n @ (dr - dc) / length
        self.moved[row.history] = e @ (dr - dc)
        for part in t.parts[row.first_part : row.first_part + row.parts]:
            shift = np.outer(n, turn) * (part.com if part.end == BARREL else -part.com)
            self.moved[part.history : part.history + 2] = (dc if part.end == BARREL else dr) + shift
            self.moved[part.history + 2] = turn


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
