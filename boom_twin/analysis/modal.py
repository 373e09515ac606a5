"""Natural frequencies and modes about an equilibrium, by counting.

The sweep at A = -omega^2 condenses the dynamic stiffness K - omega^2 M with its full tangent. By Sylvester's law the number
of negative pivots of all that is condensed, less the number of forces among the unknowns, is the number of natural
frequencies below omega (the counting of Wittrick and Williams 1971). Bisection on that integer misses no mode and needs no
starting guess; a mode follows by inverse iteration with the same sweep.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..chain.clearance import load_pins
from ..chain.place import place
from ..chain.program import Motion, State, Work
from ..chain.status import OK, SENTENCES
from ..chain.step import observe
from ..chain.sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out
from ..errors import SolverError
from ..plan.plan import Plan
from ..records import Array

HIGHEST = 1e7  # rad/s; no mode is looked for above
RELATIVE_WIDTH = 1e-11  # of the last bracket
SHIFT = 1e-6  # relative distance from the frequency at which a mode is iterated
LOAD = 1e-9  # m, displacement whose inertia forces load the boom for that
TRIES = 20  # frequencies, each a little beside the last, where one meets a pivot that is zero
ABSURD = "Look for values in the scene that are too large or too small by many orders of magnitude."
NUDGE = 1e-6  # rad, for the derivative of positions by unknowns


@dataclass(frozen=True)
class Mode:
    """One undamped mode, scaled to unit modal mass.

    Attributes
    ----------
    frequency : float
        Hz.
    increments : ndarray, shape (unknowns,)
        Of the unknowns, in the order of `Plan.names`, per unit of the modal coordinate (m sqrt(kg)).
    motion : ndarray, shape (histories,)
        Of every mass point and angle.
    """

    frequency: float
    increments: Array
    motion: Array


def constraints(plan: Plan) -> int:
    """Number of forces among the unknowns."""
    return int(np.sum(plan.tables.moving == 0.0))


def negative_pivots(plan: Plan, state: State, work: Work, omega: float) -> int:
    """Negative pivots of K - omega^2 M at the present state; SolverError if it cannot be condensed."""
    place(plan.tables, state, work)
    position, still = work.position.copy(), np.zeros_like(work.position)
    drive = _drive(plan, state, work)
    for _ in range(TRIES):
        status, negative = _condense(plan, state, work, Motion(-omega * omega, 0.0, position, still), drive)
        if status == OK:
            return int(negative) + _negative_eigenvalues(work.blocks) + _negative_eigenvalues(work.ends)
        omega = omega * (1.0 + 1e-12) + 1e-12
    raise SolverError(f"vibration at {omega / (2.0 * math.pi):.6g} Hz cannot be computed: {SENTENCES[status]}. {ABSURD}")


def _condense(plan: Plan, state: State, work: Work, motion: Motion, drive: Array) -> tuple[int, int]:
    """Sweep the whole boom in; status and negative pivots."""
    clear_cut(work, FREE)
    load_pins(plan.tables, state, work, motion)
    operations, still = np.int64(len(plan.tables.operations)), np.zeros(plan.joints)
    status, negative, _ = sweep_in(plan.tables, state, work, motion, drive, still, ROOT, operations, FREE)
    return int(status), int(negative)


def _drive(plan: Plan, state: State, work: Work) -> Array:
    """Drive lengths (m) at which the present state is in equilibrium: its own, less the oil's compression."""
    t = plan.tables
    return np.array([work.position[c.history] - c.compliance * state.z[c.z] for c in t.cylinders])


def _negative_eigenvalues(blocks: Array) -> int:
    """Of small symmetric matrices (k, m, m) whose rows differ by many orders of magnitude: balanced first, signs stay."""
    with np.errstate(all="ignore"):
        for _ in range(6 if len(blocks) else 0):
            size = np.sqrt(np.abs(blocks).max(axis=2))
            size[size == 0.0] = 1.0
            blocks = blocks / (size[:, :, None] * size[:, None, :])
    if not np.isfinite(blocks).all():
        raise SolverError(f"the stiffness of the boom is not finite. {ABSURD}")
    return int(np.sum(np.linalg.eigvalsh(blocks) < 0.0))


def natural_modes(
    plan: Plan, state: State, work: Work, count: int, width: float = RELATIVE_WIDTH, highest: float = HIGHEST
) -> tuple[Mode, ...]:
    """The lowest `count` modes below `highest` (rad/s) about the equilibrium in `state`, or all if there are fewer.

    `width` is the relative accuracy of the frequencies. The state stays as it is.
    """
    base = negative_pivots(plan, state, work, 0.0)

    def below(omega: float) -> int:
        return negative_pivots(plan, state, work, omega) - base

    modes: list[Mode] = []
    low = 0.0
    for k in range(min(count, below(highest))):
        omega = _bisect(below, k, low, width)
        modes.append(_mode(plan, state, work, omega, modes))
        low = omega * (1.0 - 1e-9)
    place(plan.tables, state, work)
    return tuple(modes)


def _bisect(below: Callable[[float], int], k: int, low: float, width: float) -> float:
    """The frequency (rad/s) at which the count rises from at most k to more."""
    high = max(2.0 * low, 1.0)
    while below(high) <= k:
        low, high = high, 2.0 * high
    while high - low > width * high:
        middle = 0.5 * (low + high)
        if below(middle) > k:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def _mode(plan: Plan, state: State, work: Work, omega: float, lower: list[Mode]) -> Mode:
    """Inverse iteration from a random inertial load, a little beside `omega`, free of the `lower` modes."""
    rng = np.random.default_rng(1)
    motion = rng.standard_normal(len(plan.masses)) * (plan.masses > 0.0)
    increments = np.zeros(len(plan.names))
    for _ in range(3):
        for mode in lower:
            motion = motion - mode.motion * ((plan.masses * motion) @ mode.motion)
        increments = _response(plan, state, work, omega * (1.0 - SHIFT), motion)
        motion = _moved(plan, state, work, increments)
        size = math.sqrt(float(plan.masses @ motion**2))
        if not 0.0 < size < math.inf:
            raise SolverError(f"the mode at {omega / (2.0 * math.pi):.6g} Hz cannot be computed. {ABSURD}")
        motion, increments = motion / size, increments / size
    return Mode(omega / (2.0 * math.pi), increments, motion)


def _response(plan: Plan, state: State, work: Work, omega: float, load: Array) -> Array:
    """Solve (K - omega^2 M) dz = M load, up to a factor.

    Half the difference of two small loads: the tangent holds forces too, so a large one would change K, and what the state
    lacks to equilibrium cancels.
    """
    place(plan.tables, state, work)
    position, still = work.position.copy(), np.zeros_like(work.position)
    drive, sides = _drive(plan, state, work), []
    for size in (LOAD, -LOAD):
        motion = Motion(-omega * omega, 0.0, position + size * load, still)
        _condense(plan, state, work, motion, drive)
        sweep_out(plan.tables, state, work, ROOT, np.int64(len(plan.tables.operations)), FREE)
        sides.append(work.dz.copy())
    return np.asarray(sides[0] - sides[1])


def _moved(plan: Plan, state: State, work: Work, increments: Array) -> Array:
    """Linearised motion of all histories by increments of the unknowns; central differences."""
    return along(plan, state, work, increments, lambda: work.position.copy())


def joint_increments(plan: Plan, state: State, work: Work, mode: Mode) -> Array:
    """Change of the joint angles, shape (n,), rad per unit of the modal coordinate."""
    row = np.empty(2 * plan.joints + 9)

    def angles() -> Array:
        observe(plan.tables, state, row)
        return row[: plan.joints].copy()

    return along(plan, state, work, mode.increments, angles)


def along(plan: Plan, state: State, work: Work, increments: Array, read: Callable[[], Array]) -> Array:
    """Derivative of what `read` returns along `increments` of the unknowns."""
    z = state.z.copy()
    size = NUDGE / max(float(np.max(plan.tables.scale * np.abs(increments))), 1e-300)
    sides = []
    for sign in (1.0, -1.0):
        state.z[:] = z + sign * size * increments
        place(plan.tables, state, work)
        sides.append(read())
    state.z[:] = z
    place(plan.tables, state, work)
    return np.asarray((sides[0] - sides[1]) / (2.0 * size))
