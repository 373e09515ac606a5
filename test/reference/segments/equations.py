"""Equations of motion of the finite-segment reference boom, with automatic differentiation in numpy.

M(q) q'' + G^T N = f(q, q', t),      G q'' + bias = l_ref''      (only for incompressible cylinders)

Kinematics are closed: the links of the six-bars follow from the joint angles, so compressible cylinders leave a plain
ordinary differential equation. An incompressible cylinder adds a multiplier, solved for together with q''.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from boom_twin import Scene

from .geometry import Bodies, Linkages, gravity_in_base, oil_stiffness
from .kinematics import Quantities, carried, chain_points, fixed, joined, segment_tables, spans

Drive = Callable[[float], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""Time (s) -> lengths (m), rates (m/s) and accelerations (m/s^2) of the drives, each (n,)."""


@dataclass(frozen=True)
class PlacedBoom:
    """A boom at one instant: its masses with their headings, the cylinders' lengths, the joint angles, the tip."""

    masses: Quantities
    turns: Quantities
    lengths: Quantities
    joints: np.ndarray
    tip: Quantities


class Equations:
    """A scene cut into about 4 `fineness` springs in every flexible section; 0 makes all sections rigid."""

    def __init__(self, scene: Scene, drive: Drive, fineness: int) -> None:
        self.scene, self.drive, self.tables = scene, drive, segment_tables(scene, fineness)
        self.linkages = Linkages(scene.joints[1:])
        self.bodies = Bodies(scene)
        cylinders = [joint.cylinder for joint in scene.joints]
        self.rigid = np.array([not cylinder.is_compressible for cylinder in cylinders])
        self.d = np.array([cylinder.d or 0.0 for cylinder in cylinders])
        self.mass = np.concatenate([self.tables.mass, self.bodies.mass])
        self.inertia = np.concatenate([self.tables.inertia, self.bodies.inertia])
        self.weight = self.mass[:, None] * gravity_in_base(scene)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.tables.stiffness)

    def place(self, q: np.ndarray, v: np.ndarray) -> PlacedBoom:
        """The boom at coordinates q with rates v."""
        t, bodies = self.tables, self.bodies
        points, headings = chain_points(t, self.scene.base.pivot, q, v)
        before = headings[t.head[:-1]]
        own = headings[t.root[1:]]
        left, right = self._links(before, own)
        d, e = points[t.d], points[t.e]
        base = fixed(self.scene.base.cylinder_pin, self.size)
        on_left = carried(d, left, bodies.rod_ahead, bodies.rod_aside)
        on_right = carried(e, right, bodies.rod_ahead, bodies.rod_aside)
        rods = [points[t.rod_pin : t.rod_pin + 1]]
        rods += [(on_left if side else on_right)[i : i + 1] for i, side in enumerate(bodies.on_left)]
        barrel_pins, rod_pins = joined(base, points[t.barrel_pin]), joined(*rods)
        lengths, axes = spans(barrel_pins, rod_pins)
        zero, count = np.zeros(len(bodies.barrel)), len(t.mass)
        masses = joined(
            points[:count],
            carried(d, left, bodies.left_middle, zero[1:]),
            carried(e, right, bodies.right_middle, zero[1:]),
            carried(barrel_pins, axes, bodies.barrel, zero),
            carried(rod_pins, axes, -bodies.rod, zero),
        )
        turns = joined(headings[t.link[:count]], left, right, axes, axes)
        first = headings.value[:1]
        return PlacedBoom(masses, turns, lengths, np.concatenate([first, own.value - before.value]), points[t.tip : t.tip + 1])

    def _links(self, before: Quantities, own: Quantities) -> tuple[Quantities, Quantities]:
        """Headings of links L and R between the heads `before` and the roots `own`."""
        phi, rate = own.value - before.value, own.rate - before.rate
        difference = own.jacobian - before.jacobian
        found = []
        for link in self.linkages.angles(phi):
            found.append(
                Quantities(
                    before.value + link.value,
                    before.rate + link.first * rate,
                    before.jacobian + link.first[:, None] * difference,
                    link.second * rate**2,
                )
            )
        return found[0], found[1]

    def accelerations(self, time: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, PlacedBoom]:
        """Second derivatives of the coordinates, forces of all cylinders (N, tension positive), and the boom."""
        placed = self.place(q, v)
        forces = self._spring_forces(time, placed)
        right = self._generalised(placed, q, v) - placed.lengths.jacobian.T @ forces
        matrix, g = self._mass_matrix(placed), placed.lengths.jacobian[self.rigid]
        if len(g):
            matrix, right = self._bordered(matrix, g), np.concatenate([right, self._demand(time, placed)])
        solution = np.linalg.solve(matrix, right)
        forces[self.rigid] = solution[self.size :]
        return np.asarray(solution[: self.size]), forces, placed

    def state_jacobian(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Derivative of (q', q'') by (q, q'), shape (2 n, 2 n), from elastic and damping forces alone.

        What gravity and inertia forces add is small beside them; an implicit solver's Newton passes need no more.
        """
        placed, n = self.place(q, v), self.size
        levers, g = placed.lengths.jacobian, placed.lengths.jacobian[self.rigid]
        elastic = np.diag(self.tables.stiffness) + (levers.T * self._stiffness(placed.lengths.value)) @ levers
        damping = np.diag(self.tables.damping) + (levers.T * self.d) @ levers
        matrix = self._bordered(self._mass_matrix(placed), g) if len(g) else self._mass_matrix(placed)
        right = np.zeros((len(matrix), 2 * n))
        right[:n] = np.hstack([elastic, damping])
        found = np.zeros((2 * n, 2 * n))
        found[:n, n:] = np.eye(n)
        found[n:] = -np.linalg.solve(matrix, right)[:n]
        return found

    def _spring_forces(self, time: float, placed: PlacedBoom) -> np.ndarray:
        """Forces (N) of the oil springs and dampers; 0 for incompressible cylinders."""
        length, rate, _ = self.drive(time)
        k = self._stiffness(length)
        return np.asarray(k * (placed.lengths.value - length) + self.d * (placed.lengths.rate - rate))

    def _stiffness(self, lengths: np.ndarray) -> np.ndarray:
        """Return the stiffness of the oil springs, N/m, for drives so long (m)."""
        return np.array([oil_stiffness(j.cylinder, float(at)) for j, at in zip(self.scene.joints, lengths, strict=True)])

    def _generalised(self, placed: PlacedBoom, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Forces on the coordinates: weight, inertia forces at zero second derivatives, springs of the segments."""
        load = self.weight - self.mass[:, None] * placed.masses.bias
        moment = self.inertia * placed.turns.bias
        n = self.size
        force = load.ravel() @ placed.masses.jacobian.reshape(-1, n) - moment @ placed.turns.jacobian
        return np.asarray(force - self.tables.stiffness * q - self.tables.damping * v)

    def _mass_matrix(self, placed: PlacedBoom) -> np.ndarray:
        rows = (np.sqrt(self.mass)[:, None, None] * placed.masses.jacobian).reshape(-1, self.size)
        turning = np.sqrt(self.inertia)[:, None] * placed.turns.jacobian
        return np.asarray(rows.T @ rows + turning.T @ turning)

    def _demand(self, time: float, placed: PlacedBoom) -> np.ndarray:
        return np.asarray((self.drive(time)[2] - placed.lengths.bias)[self.rigid])

    @staticmethod
    def _bordered(matrix: np.ndarray, g: np.ndarray) -> np.ndarray:
        return np.block([[matrix, g.T], [g, np.zeros((len(g), len(g)))]])


class Jet:
    """Value v, gradient g (n,), Hessian h (n, n) of a function of n coordinates."""

    __slots__ = ("g", "h", "v")

    def __init__(self, v: float, g: np.ndarray, h: np.ndarray) -> None:
        self.v, self.g, self.h = v, g, h

    def __add__(self, other: Jet | float) -> Jet:
        if isinstance(other, Jet):
            return Jet(self.v + other.v, self.g + other.g, self.h + other.h)
        return Jet(self.v + other, self.g, self.h)

    def __mul__(self, other: Jet | float) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.v * other, self.g * other, self.h * other)
        cross = np.outer(self.g, other.g)
        h = self.v * other.h + other.v * self.h + cross + cross.T
        return Jet(self.v * other.v, self.v * other.g + other.v * self.g, h)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Jet:
        return self * -1.0

    def __sub__(self, other: Jet | float) -> Jet:
        return self + -1.0 * other

    def through(self, value: float, first: float, second: float) -> Jet:
        """A function of this number, given its value and derivatives here."""
        return Jet(value, first * self.g, first * self.h + second * np.outer(self.g, self.g))


def coordinates(values: np.ndarray) -> list[Jet]:
    """One jet for each coordinate."""
    n = len(values)
    return [Jet(float(v), row, np.zeros((n, n))) for v, row in zip(values, np.eye(n), strict=True)]


def constant(value: float, n: int) -> Jet:
    """A jet that depends on nothing."""
    return Jet(float(value), np.zeros(n), np.zeros((n, n)))


def cos(a: Jet) -> Jet:
    """Cosine."""
    c, s = math.cos(a.v), math.sin(a.v)
    return a.through(c, -s, -c)


def sin(a: Jet) -> Jet:
    """Sine."""
    c, s = math.cos(a.v), math.sin(a.v)
    return a.through(s, c, -s)


def root(a: Jet) -> Jet:
    """Square root."""
    r = math.sqrt(a.v)
    return a.through(r, 0.5 / r, -0.25 / r**3)


def inverse(a: Jet) -> Jet:
    """Return 1 / a."""
    return a.through(1.0 / a.v, -1.0 / a.v**2, 2.0 / a.v**3)


def angle(x: Jet, y: Jet) -> Jet:
    """Angle of the vector (x, y), in (-pi, pi]."""
    r = math.hypot(x.v, y.v)
    c, s = x.v / r, y.v / r
    ahead, aside = x * c + y * s, y * c - x * s
    slope = aside * inverse(ahead)
    return slope.through(math.atan2(y.v, x.v), 1.0, 0.0)
