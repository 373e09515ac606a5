"""Finite-segment boom: short rigid pieces with bending and axial springs between them, loops closed by constraints.

A witness that shares no code with the model. Coordinates: heading of every section's root, headings of both links of
every six-bar, and at each spring a turn and a stretch. Everything else (points, energy, constraints) is written once as
plain geometry on `jets`, which give gradients and Hessians. Its error falls with the square of the number of springs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh, null_space

from .jets import Jet, angle, constant, coordinates, cos, inverse, root, sin


@dataclass
class Mass:
    """A mass (kg) at a point with an inertia (kg m^2) about it; x, y, turn are jets."""

    mass: float
    inertia: float
    x: Jet
    y: Jet
    turn: Jet


@dataclass
class Boom:
    """A boom at one set of coordinates."""

    masses: list[Mass] = field(default_factory=list)
    springs: list[tuple[float, float, Jet]] = field(default_factory=list)  # stiffness, damping, elongation
    closures: list[Jet] = field(default_factory=list)  # are zero
    lengths: list[Jet] = field(default_factory=list)  # of the cylinders
    joints: list[Jet] = field(default_factory=list)
    tip: tuple[Jet, Jet, Jet] = ()


class Segments:
    """A scene with about 4 `fineness` springs in every flexible section; 0 makes all sections rigid."""

    def __init__(self, scene, fineness):
        self.scene, self.fineness = scene, fineness
        turn = -scene.base.inclination
        gx, gy = scene.gravity
        self.gravity = np.array(
            [math.cos(turn) * gx - math.sin(turn) * gy, math.sin(turn) * gx + math.cos(turn) * gy]
        )

    # -- geometry -------------------------------------------------------------------------------------------------

    def start(self, angles):
        """Coordinates of the undeformed boom at relative joint angles (rad)."""
        q, heading = [], 0.0
        for i, relative in enumerate(angles):
            joint = self.scene.joints[i]
            before, heading = heading, heading + relative
            q.append(heading)
            if joint.kind != "A":
                q += [before + link for link in link_headings(joint, relative)]
            q += [0.0] * (2 * sum(n for _, _, n in self._parts(i)))
        return np.array(q)

    def lengths(self, angles):
        """Cylinder lengths (m) of the undeformed boom."""
        return np.array([length.v for length in self.place(self.start(angles)).lengths])

    def place(self, q):
        """The boom at coordinates q."""
        boom, jets, n = Boom(), iter(coordinates(q)), len(q)
        px, py = self.scene.base.pivot
        cx, cy = self.scene.base.cylinder_pin
        x, y, head = constant(px, n), constant(py, n), constant(0.0, n)
        pin = constant(cx, n), constant(cy, n)
        for i, joint in enumerate(self.scene.joints):
            theta, links = next(jets), ()
            boom.joints.append(theta - head)
            if joint.kind != "A":
                links = next(jets), next(jets)
                rod = self._linkage(boom, joint, x, y, head, theta, links)
                self._cylinder(boom, joint.cylinder, pin, rod)
            x, y, head, pins = self._section(boom, i, x, y, theta, jets)
            if joint.kind == "A":
                self._cylinder(boom, joint.cylinder, pin, pins["rod"])
            pin = pins.get("C")
        boom.tip = x, y, head
        if self.scene.tip is not None and self.scene.tip.payload:
            boom.masses.append(Mass(self.scene.tip.payload, 0.0, x, y, head))
        return boom

    def _parts(self, i):
        """Pieces of section i from x0 to x1 with their number of springs; pins sit on the borders of pieces."""
        section = self.scene.sections[i]
        modes = self.scene.modes if section.modes is None else section.modes
        if section.beam is None or modes == 0 or self.fineness == 0:
            return [(0.0, section.length, 0)]
        x0, x1 = section.beam
        inside = sorted({p for p, _ in self._pins(i).values() if x0 + 1e-9 < p < x1 - 1e-9})
        borders = [x0, *inside, x1]
        parts = []
        for a, b in pairwise(borders):
            parts.append((a, b, self.fineness * max(1, round(4 * (b - a) / (x1 - x0)))))
        return [(0.0, x0, 0), *parts, (x1, section.length, 0)]

    def _pins(self, i):
        """Pins of cylinders on section i: (x, y) from its inboard pivot."""
        section, pins = self.scene.sections[i], {}
        if i == 0:
            pins["rod"] = section.rod_pin
        if i + 1 < len(self.scene.joints):
            c = self.scene.joints[i + 1].C
            pins["C"] = (section.length + c[0], c[1])
        return pins

    def _section(self, boom, i, x, y, theta, jets):
        section, pins, fill = self.scene.sections[i], {}, self.scene.line_fill or 0.0
        parts = self._parts(i)
        for k, (x0, x1, springs) in enumerate(parts):
            last = k == len(parts) - 1
            for name, (p, aside) in self._pins(i).items():
                if name not in pins and (p < x1 - 1e-9 or last) and (p <= x0 + 1e-9 or springs == 0):
                    pins[name] = _point(x, y, theta, p - x0, aside)
            if springs == 0:
                self._rigid(boom, section, x0, x1, fill, x, y, theta)
                x, y = _point(x, y, theta, x1 - x0, 0.0)
                continue
            x, y, theta = self._beam(boom, section, (x1 - x0) / springs, springs, fill, x, y, theta, jets)
        return x, y, theta, pins

    def _rigid(self, boom, section, x0, x1, fill, x, y, theta):
        """A rigid stretch: the named part that belongs to it, the beam if it does not bend, and the line's fill."""
        whole = x1 - x0 == section.length
        rods = [(fill, 0.0, x0, x1)]
        ends = (section.root, whole or x0 == 0.0), (section.head, whole or x0 > 0.0)
        bodies = [part for part, here in ends if part is not None and here]
        if whole and section.beam is not None:
            rods.append((section.rho_A, section.rho_I or 0.0, *section.beam))
        for density, turning, a, b in rods:
            mass = density * (b - a)
            if mass > 0.0:
                px, py = _point(x, y, theta, 0.5 * (a + b) - x0, 0.0)
                boom.masses.append(Mass(mass, mass * (b - a) ** 2 / 12 + turning * (b - a), px, py, theta))
        for part in bodies:
            px, py = _point(x, y, theta, part.com[0] - x0, part.com[1])
            boom.masses.append(Mass(part.mass, part.inertia, px, py, theta))

    def _beam(self, boom, section, h, springs, fill, x, y, theta, jets):
        """Half a piece, a spring, half a piece; as often as there are springs. Stretch is shared by both halves."""
        elastic, beta = self.scene.material.E, section.beta or 0.0
        density = section.rho_A + fill
        mass = 0.5 * h * density
        inertia = mass * (0.5 * h) ** 2 / 12 + 0.5 * h * (section.rho_I or 0.0)
        for _ in range(springs):
            turn, stretch = next(jets), next(jets)
            for stiffness, coordinate in ((elastic * section.I / h, turn), (elastic * section.A / h, stretch)):
                boom.springs.append((stiffness, beta * stiffness, coordinate))
            half = 0.5 * stretch + 0.5 * h
            for side in range(2):
                if side == 1:
                    theta = theta + turn
                c, s = cos(theta), sin(theta)
                boom.masses.append(Mass(mass, inertia, x + 0.5 * half * c, y + 0.5 * half * s, theta))
                x, y = x + half * c, y + half * s
        return x, y, theta

    def _linkage(self, boom, joint, x, y, head, theta, links):
        """Closure in pin Q, masses of the links; returns the rod pin."""
        d, e = _point(x, y, head, *joint.D), _point(x, y, theta, *joint.E)
        left, right = _point(*d, links[0], joint.lL, 0.0), _point(*e, links[1], joint.lR, 0.0)
        boom.closures += [left[0] - right[0], left[1] - right[1]]
        for mass, length, start, turn in ((joint.mL, joint.lL, d, links[0]), (joint.mR, joint.lR, e, links[1])):
            if mass:
                boom.masses.append(Mass(mass, mass * length**2 / 12, *_point(*start, turn, 0.5 * length, 0.0), turn))
        if joint.kind == "B1":
            return left
        if joint.kind == "B2":
            return _point(*d, links[0], *joint.R)
        # B3: from Q along Q->E (against link R), and to the left of that direction
        return _point(*right, links[1], -joint.R[0], -joint.R[1])

    def _cylinder(self, boom, cylinder, pin, rod):
        dx, dy = rod[0] - pin[0], rod[1] - pin[1]
        length = root(dx * dx + dy * dy)
        boom.lengths.append(length)
        if cylinder.barrel is None and cylinder.rod is None:
            return
        ux, uy, turn = dx * inverse(length), dy * inverse(length), angle(dx, dy)
        for part, start, sign in ((cylinder.barrel, pin, 1.0), (cylinder.rod, rod, -1.0)):
            if part is not None:
                at = start[0] + sign * part.com * ux, start[1] + sign * part.com * uy
                boom.masses.append(Mass(part.mass, part.inertia, *at, turn))

    # -- mechanics ------------------------------------------------------------------------------------------------

    def energy(self, boom, drive):
        """Potential energy, and the list of all constraints: closures first, then incompressible cylinders."""
        n = len(boom.tip[0].g)
        v, g, h = 0.0, np.zeros(n), np.zeros((n, n))
        terms = [-m.mass * (self.gravity[0] * m.x + self.gravity[1] * m.y) for m in boom.masses]
        terms += [0.5 * k * (e * e) for k, _, e in boom.springs]
        constraints = list(boom.closures)
        for joint, length, reference in zip(self.scene.joints, boom.lengths, drive, strict=True):
            stretch = length - float(reference)
            if joint.cylinder.k is None:
                constraints.append(stretch)
            else:
                terms.append(0.5 * joint.cylinder.k * (stretch * stretch))
        for term in terms:
            v, g, h = v + term.v, g + term.g, h + term.h
        return Jet(v, g, h), constraints


def equilibrium(model, drive, angles):
    """Newton's method on the energy; returns coordinates, boom, multipliers and Hessian of the Lagrangian."""
    q, multipliers = model.start(angles), None
    for iteration in range(60):
        boom = model.place(q)
        energy, constraints = model.energy(boom, drive)
        jacobian = np.array([c.g for c in constraints]).reshape(-1, len(q))
        if multipliers is None:
            multipliers = np.zeros(len(constraints))
        hessian = energy.h.copy()
        for multiplier, constraint in zip(multipliers, constraints, strict=True):
            hessian += multiplier * constraint.h
        matrix = np.block([[hessian, jacobian.T], [jacobian, np.zeros((len(constraints),) * 2)]])
        right = np.concatenate([energy.g, [c.v for c in constraints]])
        step = np.linalg.solve(matrix, -right)
        dq = step[: len(q)]
        size = np.abs(dq).max(initial=0.0)
        if size < 1e-11 and iteration > 0:  # the first pass finds the multipliers of a boom that cannot move
            return q, boom, multipliers, hessian
        share = 0.1 / max(size, 0.1)
        q = q + share * dq
        multipliers = step[len(q) :] if share == 1.0 else multipliers + share * (step[len(q) :] - multipliers)
    raise RuntimeError("the oracle found no equilibrium")


def mass_matrix(boom):
    """Of all coordinates."""
    rows = [math.sqrt(m.mass) * axis.g for m in boom.masses for axis in (m.x, m.y)]
    rows += [math.sqrt(m.inertia) * m.turn.g for m in boom.masses]
    jacobian = np.array(rows).reshape(-1, len(boom.tip[0].g))
    return jacobian.T @ jacobian


def frequencies(model, boom, hessian, count=6):
    """Lowest natural frequencies (Hz) within the constraints."""
    _, constraints = model.energy(boom, [length.v for length in boom.lengths])
    n = len(hessian)
    free = null_space(np.array([c.g for c in constraints])) if constraints else np.eye(n)
    if free.shape[1] == 0:
        return np.zeros(0)
    values = eigh(free.T @ hessian @ free, free.T @ mass_matrix(boom) @ free, eigvals_only=True)
    assert values[0] > 0.0, "the oracle's equilibrium is not stable"
    return np.sqrt(values[:count]) / (2.0 * math.pi)


def statics(scene, fineness, drive, angles, modes=6):
    """Tip (2,), joints (n,), cylinder forces (n,) and frequencies (<= modes,) in one row."""
    model = Segments(scene, fineness)
    _, boom, multipliers, hessian = equilibrium(model, drive, angles)
    tip, joints = np.array([boom.tip[0].v, boom.tip[1].v]), np.array([joint.v for joint in boom.joints])
    forces = cylinder_forces(scene, boom, drive, multipliers[len(boom.closures) :])
    return np.concatenate([tip, joints, forces, frequencies(model, boom, hessian, modes)])


def cylinder_forces(scene, boom, drive, multipliers):
    """Tension between barrel and rod (N), shape (n,): of the spring, or the multiplier of a rigid cylinder."""
    rigid = iter(multipliers)
    return np.array(
        [
            next(rigid) if joint.cylinder.k is None else joint.cylinder.k * (length.v - reference)
            for joint, length, reference in zip(scene.joints, boom.lengths, drive, strict=True)
        ]
    )


def extrapolated(scene, drive, angles, coarse=2, modes=6):
    """`statics` with Richardson extrapolation from `coarse` and twice that."""
    a, b = (statics(scene, fineness, drive, angles, modes) for fineness in (coarse, 2 * coarse))
    return b + (b - a) / 3.0


def link_headings(joint, relative):
    """Angles of links L and R against the head before, for a relative joint angle; Q lies left of D->E."""
    d = complex(*joint.D)
    e = complex(*joint.E) * np.exp(1j * relative)
    gap = e - d
    along = (joint.lL**2 - joint.lR**2 + abs(gap) ** 2) / (2.0 * abs(gap))
    q = d + gap / abs(gap) * complex(along, math.sqrt(joint.lL**2 - along**2))
    return float(np.angle(q - d)), float(np.angle(q - e))


def _point(x, y, theta, ahead, aside):
    """Point at (ahead, aside) in axes turned by theta at (x, y)."""
    c, s = cos(theta), sin(theta)
    return x + ahead * c - aside * s, y + ahead * s + aside * c
