"""Energy of a boom, and its balance along a motion: work of the drives = change of energy + what damping and contact take.

What is left over is the time integration's: errors of the trapezoidal rule that the powers are summed by, which fall with the
square of the step, and the numerical damping of generalised-alpha, which takes energy from fast vibrations and little from slow
ones. Coriolis and centrifugal forces do no work, and neither do pins and links.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from ..compiler.plan import Plan
from ..kernels.elements.pin_contact import (
    CLEARANCE,
    DAMPER,
    FORCE,
    LEAST_SHARE,
    SEAT_X,
    SEAT_Y,
    SLIP,
    SMOOTH,
    SPRING,
    approach,
    penetration,
)
from ..kernels.integrators import V, X
from ..kernels.tables import State
from ..kernels.transfer.clearance_pins import axis_of
from ..types import Array
from .drive import DriveCourse

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

    work: float  # done by the drives
    change: float  # kinetic and potential energy at the last row less that at the first
    damping: float  # taken by beams, oil dampers and the base's hinge
    contact: float  # taken by contacts
    gap: float  # largest of work - change - damping - contact at any step, in magnitude
    left: float  # that difference at the end: what time integration took, negative if it gave
    moved: float  # measure of `gap`: the largest of the drives' work, kinetic energy, and change of the weight's energy
    step: float  # longest step, s

    @property
    def share(self) -> float:
        """`gap` as a share of `moved`."""
        return self.gap / self.moved if self.moved > 0.0 else 0.0

    def __str__(self) -> str:
        return (
            f"energy: the drives did {self.work:.6g} J; kinetic and potential energy changed by {self.change:.6g} J, "
            f"damping took {self.damping:.4g} J, contact {self.contact:.4g} J. "
            f"The balance is open by {self.gap:.3g} J at most, {100.0 * self.share:.2g} % of {self.moved:.4g} J moved; "
            f"in the end time integration (steps of {self.step:.3g} s) took {self.left:.3g} J"
        )


def energy_balance(course: DriveCourse, dt: float) -> EnergyBalance:
    """Return the balance along a motion in steps of at most `dt` (s).

    Where journals touch and part, each step is divided by `FINER`, so that powers in impacts can be summed.
    """
    energies, start = Energies(course.plan), course.start
    first, heavy = energies.total(start), energies.weight(start)
    before, sums = energies.powers(start), np.zeros(3)
    gap, left, moved, longest = 0.0, 0.0, energies.kinetic(start), 0.0
    for step, state in states_of(course, dt):
        now = energies.powers(state)
        sums += 0.5 * step * (before + now)
        before, longest = now, max(longest, step)
        left = float(sums[0] - sums[1] - sums[2] - (energies.total(state) - first))
        gap = max(gap, abs(left))
        moved = max(moved, abs(sums[0]), energies.kinetic(state), abs(energies.weight(state) - heavy))
    work, damping, lost = sums.tolist()
    return EnergyBalance(work, work - damping - lost - left, damping, lost, gap, left, float(moved), longest)


def states_of(course: DriveCourse, dt: float) -> Iterator[tuple[float, State]]:
    """Steps (s) and states, as of `DriveCourse.states`, of a motion whose powers or forces are to be summed."""
    impacts = bool((course.plan.tables.clearances.linear == 0).any())
    return course.states(dt, FINER if impacts else 1)
