"""Balances of energy and momentum along a motion.

Energy: work of the drives and of a force at the tip = change of energy + what damping and contact take. Coriolis and
centrifugal forces do no work, and neither do pins and links.

Momentum and its moment: change = impulse of weight, tip force and of what holds the boom. The base holds it in two pins, the
pivot of section 1 and the barrel pin of cylinder 1. Their forces are what is left when all forces and inertia are swept from
the tip to the base. All other pins, drives, beams, oil and contacts act between parts of the boom and cancel; a force that had
no opposite would show here, though energy may balance. Linear momentum is of all mass points, moment of momentum of these
about the pivot and of all that turns.

The gap of a balance is the error of the trapezoidal rule and of the time integration, which fall with the square of the step.
Of energy it includes the numerical damping of generalised-alpha.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from boom_twin.analysis.drive import PASSES, STEP_TOLERANCE, DriveCourse
from boom_twin.compiler.plan import Plan
from boom_twin.kernels.elements.cylinder import END_C
from boom_twin.kernels.elements.pin_contact import (
    BARREL_END_PIN,
    CLEARANCE,
    DAMPER,
    FORCE,
    LEAST_SHARE,
    PIVOT,
    SEAT_X,
    SEAT_Y,
    SLIP,
    SMOOTH,
    SPRING,
    approach,
    penetration,
)
from boom_twin.kernels.integrators import GENERALISED_ALPHA, A, V, X, prepare
from boom_twin.kernels.tables import OK, SENTENCES, Motion, State, Work
from boom_twin.kernels.transfer.clearance_pins import axis_of, load_pins, torque_of
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.riccati_sweep import FREE, clear_cut, sweep_in
from boom_twin.kernels.transfer.time_step import LONGEST_INCREMENT, advance
from boom_twin.types import Array

FINER = 32  # sub-steps of a step where journals touch and part: as many as a step is divided into at most


class Energies:
    """Energies and powers of a boom, from its state."""

    def __init__(self, plan: Plan) -> None:
        t, count = plan.tables, len(plan.names)
        self._plan = plan
        self._stiffness, self._damping = np.zeros((count, count)), np.zeros((count, count))
        for row, beam in enumerate(t.beams):
            own, axial = slice(int(beam.z), int(beam.z + beam.bending)), int(beam.z + beam.bending)
            block = t.stiffness[row, : int(beam.bending), : int(beam.bending)]
            self._stiffness[own, own], self._damping[own, own] = block, beam.beta * block
            if beam.axial:
                self._stiffness[axial, axial] = beam.axial_stiffness
                self._damping[axial, axial] = beam.beta * beam.axial_stiffness
        for hinge in t.hinges:
            self._stiffness[hinge.z, hinge.z], self._damping[hinge.z, hinge.z] = hinge.stiffness, hinge.damping
        self._lengths, self._forces = np.array(t.cylinders.history), np.array(t.cylinders.z)
        self._pins = [SimpleNamespace(**{name: row[name].item() for name in CLEARANCE.names or ()}) for row in t.clearances]

    def kinetic(self, state: State) -> float:
        """Return the kinetic energy of all mass points and inertias, J."""
        return float(0.5 * self._plan.masses @ state.history[V] ** 2)

    def weight(self, state: State) -> float:
        """Potential energy of gravity, J."""
        return float(-self._plan.weights @ state.history[X])

    def strain(self, state: State) -> float:
        """Return the strain energy of bent and stretched beams and of the base's hinge, J."""
        return float(0.5 * state.z @ self._stiffness @ state.z)

    def oil(self, state: State) -> float:
        """Return the energy of the oil springs, J."""
        return float(0.5 * self._oil(state.drives[0])[0] @ self._stretch(state) ** 2)

    def _stretch(self, state: State) -> Array:
        return np.asarray(state.history[X, self._lengths] - state.drives[0])

    def _oil(self, drives: Array) -> tuple[Array, Array]:
        """Stiffnesses (N/m) and dampings (N s/m) of the oil at lengths of the drives (m); 0 if incompressible."""
        compliances, lags = self._plan.compliances_and_lags(drives)
        stiffnesses = np.divide(1.0, compliances, out=np.zeros_like(compliances), where=compliances > 0.0)
        return stiffnesses, lags * stiffnesses

    def contact(self, state: State) -> float:
        """Return the energy of contacts, J; for linearised pins that of their springs.

        For a contact it is K times the integral of d^e over the gap, dg = (1 + s^2/(4 d^2)) dd.
        """
        total = 0.0
        for row, memory in zip(self._pins, state.contacts, strict=True):
            x, y = state.z[row.z], state.z[row.z + 1]
            if memory[SPRING] > 0.0:
                c, s = axis_of(self._plan.tables, state, row)
                dx, dy = x - c * memory[SEAT_X] + s * memory[SEAT_Y], y - s * memory[SEAT_X] - c * memory[SEAT_Y]
                total += 0.5 * memory[SPRING] * (dx * dx + dy * dy)
                continue
            (_, _, _, d, _), e = penetration(row, x, y), row.exponent
            total += row.stiffness * (d ** (e + 1.0) / (e + 1.0) + 0.25 * SMOOTH**2 * d ** (e - 1.0) / (e - 1.0))
        return float(total)

    def total(self, state: State) -> float:
        """Kinetic and potential energy, J."""
        potential = self.weight(state) + self.strain(state) + self.oil(state) + self.contact(state)
        return self.kinetic(state) + potential

    def powers(self, state: State) -> Array:
        """Return the power of the drives into the boom, and of damping and of contact out of it; shape (3,), W."""
        return np.array([self.drive_power(state), self.damping_power(state), self.contact_power(state)])

    def drive_power(self, state: State) -> float:
        """Power that the drives put in, W: a drive that lengthens against compression (N < 0) does work.

        So does one whose oil gets stiffer on its way: the spring is as long as before, and stores more.
        """
        drives, step = state.drives[0], 1e-6
        stiffening = (self._oil(drives + step)[0] - self._oil(drives - step)[0]) / (2.0 * step)
        stiffened = 0.5 * stiffening * self._stretch(state) ** 2
        return float((stiffened - state.z[self._forces]) @ state.drives[1])

    def damping_power(self, state: State) -> float:
        """Power that beams, oil dampers and the base's hinge take, W."""
        rates = state.history[V]
        own, slip = rates[: len(state.z)], rates[self._lengths] - state.drives[1]
        return float(own @ self._damping @ own + self._oil(state.drives[0])[1] @ slip**2)

    def contact_power(self, state: State) -> float:
        """Power that contacts take, by restitution and friction, W; of linearised pins, their dampers."""
        rates, total = state.history[V], 0.0
        for row, memory in zip(self._pins, state.contacts, strict=True):
            x, y, vx, vy = state.z[row.z], state.z[row.z + 1], rates[row.z], rates[row.z + 1]
            if memory[SPRING] > 0.0:
                total += memory[DAMPER] * (vx * vx + vy * vy)
                continue
            nx, ny, _, d, _ = penetration(row, x, y)
            approaching = nx * vx + ny * vy
            share = max(1.0 + row.loss * approaching / approach(memory, nx, ny, vx, vy), LEAST_SHARE)
            total += row.stiffness * d**row.exponent * (share - 1.0) * approaching
            if row.friction > 0.0:
                slip = nx * vy - ny * vx + row.radius * rates[row.turn]
                total += row.friction * memory[FORCE] * slip * slip / math.hypot(slip, SLIP)
        return float(total)


@dataclass(frozen=True)
class EnergyBalance:
    """Energy balance of a motion; energies in J."""

    work: float  # done by the drives and by a force at the tip
    damping: float  # taken by beams, oil dampers and the base's hinge
    contact: float  # taken by contacts
    gap: float  # largest of work less change of energy, damping and contact at any step, in magnitude
    share: float  # `gap` over the largest of that work, kinetic energy, and change of the weight's energy


def energy_balance(course: DriveCourse, dt: float) -> EnergyBalance:
    """Return the balance along a motion in steps of at most `dt` (s), divided by `FINER` where journals touch and part."""
    energies, start = Energies(course.plan), course.start
    first, heavy = energies.total(start), energies.weight(start)
    course.work.load[:] = course.first_load
    before, sums = energies.powers(start) + tip_power(course, start), np.zeros(3)
    gap, moved = 0.0, energies.kinetic(start)
    for step, state in states_of(course, dt):
        now = energies.powers(state) + tip_power(course, state)
        sums += 0.5 * step * (before + now)
        before = now
        left = sums[0] - sums[1] - sums[2] - (energies.total(state) - first)
        gap = max(gap, abs(float(left)))
        moved = max(moved, abs(sums[0]), energies.kinetic(state), abs(energies.weight(state) - heavy))
    work, damping, lost = sums.tolist()
    return EnergyBalance(work, damping, lost, gap, share_of(gap, float(moved)))


def share_of(gap: float, moved: float) -> float:
    """Return a gap as a share of what moved; 0 at rest."""
    return gap / moved if moved > 0.0 else 0.0


def tip_power(course: DriveCourse, state: State) -> Array:
    """Return the power of the force at the tip, as a summand of `Energies.powers`."""
    tip = course.plan.tables.tip
    return np.array([course.work.load[1] @ state.history[V, tip : tip + 2], 0.0, 0.0])


def states_of(course: DriveCourse, dt: float) -> Iterator[tuple[float, State]]:
    """Yield each step (s) and the state after it, which changes with the next; ``work.load[1]`` is its force at the tip."""
    plan, work, state, row = course.plan, course.work, State(*(array.copy() for array in course.start)), 0
    finer = FINER if (plan.tables.clearances.linear == 0).any() else 1
    steps, counts, drives, rates, loads = course.steps(np.arange(len(course.times)), dt, finer)
    work.load[:] = course.first_load
    for span, count in zip(steps.tolist(), counts.tolist(), strict=True):
        scheme = prepare(GENERALISED_ALPHA, course.rho, span, work.weights)
        for _ in range(count):
            if len(loads):
                work.load[:] = work.load[1], loads[row]
            drive, bounds = (drives[row], rates[row]), (STEP_TOLERANCE, PASSES, LONGEST_INCREMENT)
            status, _, _ = advance(plan.tables, state, work, scheme, *drive, *bounds, None, False)
            assert status == OK, SENTENCES[status]
            row += 1
            yield span, state


BEHIND_PIVOT = np.int64(1)  # the operation outboard of joint A, up to which forces are swept in


class Momenta:
    """Momentum of a boom and the forces from outside; each as x, y and the moment about the base's pivot."""

    def __init__(self, plan: Plan, work: Work) -> None:
        t = plan.tables
        self._plan, self._work = plan, work
        triples = [int(row.history) for rows in (t.bodies, t.links, t.parts) for row in rows]
        points = [int(beam.history) + 2 * i for beam in t.beams for i in range(int(beam.points))]
        rotary = [int(beam.history) + 2 * int(beam.points) + i for beam in t.beams for i in range(int(beam.rotary))]
        self._points = np.array(triples + points, dtype=np.int64)
        self._turns = np.array([at + 2 for at in triples] + rotary, dtype=np.int64)

    def momentum(self, state: State) -> Array:
        """Return momentum and moment of momentum, N s, N s, N m s; shape (3,)."""
        impulses = self._plan.masses * state.history[V]
        found = self._wrench(state, impulses)
        found[2] += impulses[self._turns].sum()
        return found

    def forces(self, state: State, load: Array) -> Array:
        """Return force and moment of weight, of the force `load` (2,) at the tip, and of the base, N, N, N m; shape (3,)."""
        tip = self._plan.tables.tip
        x, y = state.history[X, tip : tip + 2] - self._pivot
        pushed = np.array([*load, x * load[1] - y * load[0]])
        return np.asarray(self._wrench(state, self._plan.weights) + pushed + self._base(state, load))

    def _wrench(self, state: State, forces: Array) -> Array:
        """Sum and moment of `forces` (histories,) at all mass points."""
        x, y = (state.history[X, self._points + i] - self._pivot[i] for i in range(2))
        fx, fy = forces[self._points], forces[self._points + 1]
        return np.array([fx.sum(), fy.sum(), (x * fy - y * fx).sum()])

    @property
    def _pivot(self) -> tuple[float, float]:
        joint = self._plan.tables.joints[0]
        return float(joint.x), float(joint.y)

    def _base(self, state: State, load: Array) -> Array:
        """Return force and moment of the base: at the pivot and the barrel pin of cylinder 1, with friction torques there."""
        t, work = self._plan.tables, self._work
        place(t, state, work)
        motion = Motion(1.0, 0.0, work.position - state.history[A], state.history[V].copy())
        load_pins(t, state, work, motion)
        clear_cut(work, FREE)
        work.p[:2] -= load
        drive, rate, last = state.drives[0], state.drives[1], np.int64(len(t.operations))
        sweep_in(t, state, work, motion, drive, rate, BEHIND_PIVOT, last, FREE)
        barrel, pin = work.own_g[END_C : END_C + 2], state.pins[0, END_C : END_C + 2] - self._pivot
        friction = torque_of(t, work, t.joints[0], PIVOT) + torque_of(t, work, t.cylinders[0], BARREL_END_PIN)
        moment = pin[0] * barrel[1] - pin[1] * barrel[0] - friction
        return np.array([work.p[0] + barrel[0], work.p[1] + barrel[1], moment])


@dataclass(frozen=True)
class MomentumBalance:
    """Gap between the momentum of a motion and the impulses of weight and base."""

    linear_gap: float  # largest difference at any step, N s
    linear_share: float  # of the largest momentum
    angular_gap: float  # likewise for the moment of momentum about the base's pivot, N m s
    angular_share: float


def momentum_balance(course: DriveCourse, dt: float) -> MomentumBalance:
    """Return the balance along a motion, in the steps of `energy_balance`."""
    momenta = Momenta(course.plan, course.plan.work())
    first, before, impulse = momenta.momentum(course.start), momenta.forces(course.start, course.first_load), np.zeros(3)
    rows, gaps = [first], [np.zeros(3)]
    for step, state in states_of(course, dt):
        now = momenta.forces(state, course.work.load[1])
        impulse += 0.5 * step * (before + now)
        before = now
        rows.append(momenta.momentum(state))
        gaps.append(rows[-1] - first - impulse)
    found = [(float(np.hypot(x, y).max()), float(np.abs(turn).max())) for x, y, turn in (np.array(gaps).T, np.array(rows).T)]
    (linear_gap, angular_gap), (linear_moved, angular_moved) = found
    linear, angular = share_of(linear_gap, linear_moved), share_of(angular_gap, angular_moved)
    return MomentumBalance(linear_gap, linear, angular_gap, angular)
