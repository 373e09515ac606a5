"""Natural frequencies and modes about an equilibrium by Wittrick-Williams counting.

The sweep at A = -omega^2 condenses the dynamic stiffness K - omega^2 M with its full tangent. Its negative pivots, less the
forces among the unknowns, are as many as the natural frequencies below omega (Sylvester's law; Wittrick and Williams 1971).
Bisection on that integer misses no mode and needs no starting guess. A mode follows by inverse iteration with the same sweep.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..compiler.plan import Plan
from ..errors import SolverError
from ..kernels.tables import OK, SENTENCES, State, Work
from ..kernels.transfer.forward_kinematics import place
from ..kernels.transfer.vibration import NOT_COUNTED, bisect_frequency, count_below, inertia_response, position_change
from ..types import Array

HIGHEST_RATE = 1e7  # rad/s, upper limit of the search
RELATIVE_WIDTH = 1e-11  # relative width of the last bracket
LOAD = 1e-9  # m, displacement whose inertia forces are the load there
ABSURD = "Look for values in the scene that are too large or too small by many orders of magnitude."


@dataclass(frozen=True)
class Mode:
    """One undamped mode, scaled to unit modal mass."""

    frequency: float  # Hz
    increments: Array  # (unknowns,), of the unknowns in the order of `Plan.names`, per modal coordinate (m sqrt(kg))
    motion: Array  # (histories,), displacement of every mass point and angle
    drives: Array  # (n,), drive lengths at the equilibrium, m


def constraints(plan: Plan) -> int:
    """Return the number of forces among the unknowns."""
    return int(np.sum(plan.tables.moving == 0.0))


def negative_pivots(plan: Plan, state: State, work: Work, omega: float) -> int:
    """Return the number of negative pivots of K - omega^2 M at the present state; SolverError if it cannot be condensed."""
    return _AtRest(plan, state, work).count_below(omega)


class _AtRest:
    """Boom in equilibrium: arguments of `boom_twin.kernels.transfer.vibration`, with scratch."""

    def __init__(self, plan: Plan, state: State, work: Work) -> None:
        place(plan.tables, state, work)
        position, inner = work.position.copy(), work.condensed.blocks.shape[1]
        still = np.zeros_like(position)
        self._boom = plan.tables, state, work, position, drive_at_rest(plan, state, work), still
        self._scratch, self._hat = np.zeros((inner + 1, inner)), np.zeros_like(position)

    def count_below(self, omega: float) -> int:
        """Return the number of natural frequencies below `omega` (rad/s) plus that of forces among the unknowns."""
        place(*self._boom[:3])
        _, count = _checked(*count_below(*self._boom, omega, self._scratch))
        return count

    def lowest(self, count: int, width: float, highest: float) -> Iterator[float]:
        """Yield the lowest `count` natural frequencies below `highest` (rad/s), to the relative accuracy `width`."""
        base, low = self.count_below(0.0), 0.0
        for k in range(min(count, self.count_below(highest) - base)):
            omega, _ = _checked(*bisect_frequency(*self._boom, base, k, low, width, self._scratch))
            yield omega
            low = omega * (1.0 - 1e-9)

    def response(self, omega: float, load: Array) -> Array:
        """Solve (K - omega^2 M) dz = M load, up to a factor: half the difference of two small loads.

        K depends on forces, so a large load would change it. The residual of the state cancels.
        """
        found = np.zeros_like(self._boom[1].z)
        inertia_response(*self._boom, omega, load, LOAD, self._hat, found)
        return found


def _checked(status: int, count: int, omega: float) -> tuple[float, int]:
    if status != OK:
        told = f"vibration at {omega / (2.0 * math.pi):.6g} Hz cannot be computed"
        raise SolverError(f"{told}: {SENTENCES[status]}. {ABSURD}")
    if count == NOT_COUNTED:
        raise SolverError(f"the stiffness of the boom is not finite. {ABSURD}")
    return omega, count


def drive_at_rest(plan: Plan, state: State, work: Work) -> Array:
    """Return the drive lengths (m) of the equilibrium: cylinder lengths less the oil's deformation."""
    cylinders, (compliances, _) = plan.tables.cylinders, plan.compliances_and_lags(state.drives[0])
    return np.asarray(work.position[cylinders.history] - compliances * state.z[cylinders.z])


def natural_modes(
    plan: Plan, state: State, work: Work, count: int, width: float = RELATIVE_WIDTH, highest: float = HIGHEST_RATE
) -> tuple[Mode, ...]:
    """Return the lowest `count` modes below `highest` (rad/s) about the equilibrium in `state`, or all if fewer.

    `width` is the relative accuracy of the frequencies. The state is unchanged.
    """
    boom, modes = _AtRest(plan, state, work), list[Mode]()
    for omega in boom.lowest(count, width, highest):
        modes.append(_mode(plan, state, work, boom, omega, modes))
    place(plan.tables, state, work)
    return tuple(modes)


def _mode(plan: Plan, state: State, work: Work, boom: _AtRest, omega: float, lower: list[Mode]) -> Mode:
    """Return a mode by inverse iteration close to `omega`, from a random load orthogonal to the `lower` modes."""
    shift = 1e-6  # relative shift from the frequency, for inverse iteration
    rng = np.random.default_rng(1)
    motion = rng.standard_normal(len(plan.masses)) * (plan.masses > 0.0)
    increments = np.zeros(len(plan.names))
    for _ in range(3):
        for mode in lower:
            motion = motion - mode.motion * ((plan.masses * motion) @ mode.motion)
        increments, motion = boom.response(omega * (1.0 - shift), motion), np.zeros_like(motion)
        position_change(plan.tables, state, work, state.z.copy(), increments, _nudge(plan, increments), motion)
        size = math.sqrt(float(plan.masses @ motion**2))
        if not 0.0 < size < math.inf:
            raise SolverError(f"the mode at {omega / (2.0 * math.pi):.6g} Hz cannot be computed. {ABSURD}")
        motion, increments = motion / size, increments / size
    return Mode(omega / (2.0 * math.pi), increments, motion, state.drives[0].copy())


def _nudge(plan: Plan, increments: Array) -> float:
    nudge = 1e-6  # rad, step of the derivative of positions by unknowns
    return nudge / max(float(np.max(plan.tables.scale * np.abs(increments))), 1e-300)


def damping_ratio(plan: Plan, mode: Mode) -> float:
    """Return the damping ratio from the power that oil, beams and base dissipate at the mode's frequency."""
    t, omega = plan.tables, 2.0 * np.pi * mode.frequency
    compliances, lags = plan.compliances_and_lags(mode.drives)
    loss = sum((lags * compliances * mode.increments[t.cylinders.z] ** 2).tolist())
    loss += sum((t.hinges.damping * mode.increments[t.hinges.z] ** 2).tolist())
    columns = (t.beams[name].tolist() for name in ("z", "bending", "beta", "axial", "axial_stiffness"))
    for row, (z, bending, beta, axial, stiffness) in enumerate(zip(*columns, strict=True)):
        q = mode.increments[z : z + bending]
        loss += beta * float(q @ t.stiffness[row, :bending, :bending] @ q)
        if axial:
            loss += beta * stiffness * mode.increments[z + bending] ** 2
    return float(loss / (2.0 * omega))
