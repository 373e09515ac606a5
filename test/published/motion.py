"""A boom let go from rest anywhere, in equilibrium or not, and stepped along drives in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import compiled
import numpy as np
from compiled import RHO, Plan, compile_scene, set_undeformed

from boom_twin.analysis.drive import PASSES
from boom_twin.kernels.integrators import DEPTH, GENERALISED_ALPHA, HAT, NEW_A, A, P, Scheme, X, new_weights
from boom_twin.kernels.tables import State, Work
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.time_step import advance

INSTANT = 1e-4  # s, over which accelerations at rest are found; their relative error is about its square
TOLERANCE = 1e-11  # rad in the last pass of a step


@dataclass(frozen=True)
class Start:
    """A compiled boom at rest with consistent accelerations."""

    plan: Plan
    state: State
    work: Work

    @property
    def lengths(self):
        """Of the cylinders, m, shape (n,)."""
        return np.array([self.work.position[cylinder.history] for cylinder in self.plan.tables.cylinders])


def released(scene, angles):
    """The undeformed boom at joint `angles` (rad), let go from rest.

    At rest the jerk is zero, so x = x0 + a t^2/2 to the fourth order of t: one solve over an instant gives a.
    """
    plan = compile_scene(scene)
    start = Start(plan, plan.state(), plan.work())
    state, work = start.state, start.work
    set_undeformed(plan, state, np.asarray(angles, dtype=float))
    place(plan.tables, state, work)
    state.history[X] = begin = work.position.copy()
    weights = new_weights(DEPTH)
    weights[HAT, X] = weights[P, NEW_A] = weights[A, NEW_A] = 1.0
    instant = Scheme(np.int64(GENERALISED_ALPHA), 0.0, 0.0, 2.0 / INSTANT**2, 0.0, weights)
    still = np.zeros(plan.joints)
    status, _, _ = advance(plan.tables, state, work, instant, start.lengths, still, TOLERANCE, PASSES, 1.0, None, False)
    assert status == 0
    state.history[X] = begin
    return start


def stepped(start, step, count, every, drive=None, rho=RHO):
    """Tip x, y, angle and their rates and accelerations, shape (count/every + 1, 3, 3), from t = 0.

    `drive` gives lengths (m) and rates (m/s) of the cylinders, each (m, n), at times (m,); without it they keep their length.
    """
    plan, state, work = start.plan, State(*(array.copy() for array in start.state)), start.work
    if drive is None:
        lengths = np.tile(start.lengths, (count, 1))
        rates = np.zeros_like(lengths)
    else:
        lengths, rates = drive(step * np.arange(1, count + 1))
    return plan.results(compiled.stepped(plan, state, work, step, every, lengths, rates, rho, TOLERANCE)).tip


def halved(start, step, duration, rows, drive=None, halvings=3, rho=RHO):
    """Results of `stepped` at equal distances for `step` and its halves, shape (halvings + 1, rows + 1, 3, 3)."""
    count = round(duration / step)
    assert count % rows == 0 and abs(count * step - duration) < 1e-9
    return np.array([stepped(start, step / 2**k, count * 2**k, count * 2**k // rows, drive, rho) for k in range(halvings + 1)])


def orders(errors):
    """Orders of convergence from errors of steps that halve, along the first axis."""
    return np.log2(errors[:-1] / errors[1:])


def extrapolated(results):
    """Richardson's limit of the two finest of results that converge with the square of the step."""
    return (4.0 * results[-1] - results[-2]) / 3.0
