"""Dense solver of one time step of a weightless boom: the reference for the round-off of the sweeps.

Kinematics are written here from the tables of a plan alone, increment by increment, in extended precision; nothing is
condensed. With all forces zero there is no geometric stiffness, so that

    [ J' M A J + (1 + beta C) K_el   G' ] [ dz ]   [ J' w ]
    [ G                              -c ] [ df ] = [ 0    ]

holds exactly: J moves all mass points, G all closures and cylinder lengths, c are compliances, w weights.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from compiled import Plan

from boom_twin.kernels.elements.cylinder import BARREL
from boom_twin.kernels.elements.linkage import LINK_L
from boom_twin.kernels.tables import BEAM, BODY, JOINT_A, JOINT_B, OFFSET, ROD_PIN, STATION, Z_LAMBDA, Z_LINK_L, Z_LINK_R

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
    """Increments by unknown at an undeformed state `z`: of all histories, of closures, of pins."""

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
