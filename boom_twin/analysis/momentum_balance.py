"""Balance of linear momentum and of its moment along a motion: change = impulse of weight and of what holds the boom.

The base holds a boom in two pins, the pivot of section 1 and the barrel pin of cylinder 1. Their forces are what is left when
all forces and inertia are swept from the tip to the base. All other pins, drives, beams, oil and contacts act between parts of
the boom and cancel; a force that had no opposite would show here, though energy may balance. Linear momentum is of all mass
points, moment of momentum of these about the pivot and of all that turns. What is left over is the error of the trapezoidal
rule that forces are summed by and of the time integration, which fall with the square of the step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compiler.plan import Plan
from ..kernels.elements.cylinder import END_C
from ..kernels.elements.pin_contact import BARREL_END_PIN, PIVOT
from ..kernels.integrators import A, V, X
from ..kernels.tables import Motion, State, Work
from ..kernels.transfer.clearance_pins import load_pins, torque_of
from ..kernels.transfer.forward_kinematics import place
from ..kernels.transfer.riccati_sweep import FREE, clear_cut, sweep_in
from ..types import Array
from .drive import DriveCourse
from .energy_balance import states_of

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

    def forces(self, state: State) -> Array:
        """Return force and moment of weight and base, N, N, N m; shape (3,)."""
        return self._wrench(state, self._plan.weights) + self._base(state)

    def _wrench(self, state: State, forces: Array) -> Array:
        """Sum and moment of `forces` (histories,) at all mass points."""
        x, y = (state.history[X, self._points + i] - self._pivot[i] for i in range(2))
        fx, fy = forces[self._points], forces[self._points + 1]
        return np.array([fx.sum(), fy.sum(), (x * fy - y * fx).sum()])

    @property
    def _pivot(self) -> tuple[float, float]:
        joint = self._plan.tables.joints[0]
        return float(joint.x), float(joint.y)

    def _base(self, state: State) -> Array:
        """Return force and moment of the base: at the pivot and the barrel pin of cylinder 1, with friction torques there."""
        t, work = self._plan.tables, self._work
        place(t, state, work)
        motion = Motion(1.0, 0.0, work.position - state.history[A], state.history[V].copy())
        load_pins(t, state, work, motion)
        clear_cut(work, FREE)
        drive, rate, last = state.drives[0], state.drives[1], np.int64(len(t.operations))
        sweep_in(t, state, work, motion, drive, rate, BEHIND_PIVOT, last, FREE, work.condensed)
        barrel, pin = work.own_g[END_C : END_C + 2], state.pins[0, END_C : END_C + 2] - self._pivot
        friction = torque_of(t, work, t.joints[0], PIVOT) + torque_of(t, work, t.cylinders[0], BARREL_END_PIN)
        moment = pin[0] * barrel[1] - pin[1] * barrel[0] - friction
        return np.array([work.p[0] + barrel[0], work.p[1] + barrel[1], moment])


@dataclass(frozen=True)
class MomentumBalance:
    """Gap between the momentum of a motion and the impulses of weight and base."""

    linear_gap: float  # largest difference at any step, N s
    linear_moved: float  # measure of it: the largest momentum, N s
    angular_gap: float  # likewise for the moment of momentum about the base's pivot, N m s
    angular_moved: float  # N m s

    @property
    def linear_share(self) -> float:
        """`linear_gap` as a share of `linear_moved`."""
        return self.linear_gap / self.linear_moved if self.linear_moved > 0.0 else 0.0

    @property
    def angular_share(self) -> float:
        """`angular_gap` as a share of `angular_moved`."""
        return self.angular_gap / self.angular_moved if self.angular_moved > 0.0 else 0.0

    def __str__(self) -> str:
        return (
            f"momentum: differs from the impulse of weight and base by {self.linear_gap:.3g} N s at most, "
            f"{100.0 * self.linear_share:.2g} % of {self.linear_moved:.4g} N s; its moment about the base's pivot by "
            f"{self.angular_gap:.3g} N m s, {100.0 * self.angular_share:.2g} % of {self.angular_moved:.4g} N m s"
        )


def momentum_balance(course: DriveCourse, dt: float) -> MomentumBalance:
    """Return the balance along a motion, in the steps of `boom_twin.analysis.energy_balance.energy_balance`."""
    momenta = Momenta(course.plan, course.plan.work())
    first, before, impulse = momenta.momentum(course.start), momenta.forces(course.start), np.zeros(3)
    rows, gaps = [first], [np.zeros(3)]
    for step, state in states_of(course, dt):
        now = momenta.forces(state)
        impulse += 0.5 * step * (before + now)
        before = now
        rows.append(momenta.momentum(state))
        gaps.append(rows[-1] - first - impulse)
    found = [(float(np.hypot(x, y).max()), float(np.abs(turn).max())) for x, y, turn in (np.array(gaps).T, np.array(rows).T)]
    (linear_gap, angular_gap), (linear_moved, angular_moved) = found
    return MomentumBalance(linear_gap, linear_moved, angular_gap, angular_moved)
