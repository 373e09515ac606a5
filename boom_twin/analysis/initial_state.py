"""Initial states of a simulation: the undeflected posture with joint rates, or coordinates and rates of an earlier run.

Coordinates q are the unknowns that move (angles, bending coordinates, offsets of journals), forces follow from them. Positions
of all mass points are x(q), their velocities J q', taken as central differences of the exact kinematics. The accelerations
belong to the forces at that instant, and are those of steps so short that they do not move the boom: Newmark's method with
beta = 1/2,

    x' = x + h v + h^2/2 a',

solved for two lengths of h, the error of first order removed (Richardson). Forces are found alike.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..compiler.compile import compile_scene
from ..compiler.plan import Plan
from ..errors import SolverError, UsageError
from ..kernels.elements.linkage import LINK_L, LINK_R
from ..kernels.elements.pin_contact import COLUMNS, LINK_L_PIN, LINK_R_PIN, LOST, PIVOT, Q_PIN
from ..kernels.integrators import NEWMARK, A, P, V, X, prepare
from ..kernels.tables import JOINT_B, OK, SENTENCES, State, Work
from ..kernels.transfer.clearance_pins import offset_of
from ..kernels.transfer.forward_kinematics import link_frame, place
from ..kernels.transfer.time_step import ANEW, LONGEST_INCREMENT, advance
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.load import SceneSource, as_scene
from ..scene.schema import Scene
from ..system.atomic_files import write_atomic
from ..system.received_files import open_received
from ..types import Array
from .drive import PASSES, pchip
from .equilibrium import checked_strokes, rest_at, set_undeformed

SPAN = 1e-3  # rad or m that the fastest coordinate moves in a difference quotient
SHORT = 2e-5  # s, step that accelerations are found with
HALF = math.sqrt(2.0) - 0.5  # gamma of Newmark's method with beta = 1/2
START_TOLERANCE = 1e-9  # rad in the last pass; what is left is its square
OPEN = 1e-6  # m, and m/s: by which a loop may be open
FARTHEST_START = 1e-3  # m, by which a drive may begin away from where the state was taken
STENCIL = ((2.0, -1.0), (1.0, 8.0), (-1.0, -8.0), (-2.0, 1.0))  # of the fourth-order difference, over 12


@dataclass(frozen=True)
class InitialState:
    """Position and velocity of a boom at one instant.

    Attributes
    ----------
    names : tuple of str
        Of the u unknowns, as `boom_twin.compiler.plan.Plan.names` has them: ``theta_1`` (rad, of section 1),
        ``N_1`` (N), ``q1_part1``, ..
    values, rates : ndarray, shape (u,)
        Coordinates (rad, m, 1) and their rates; of forces (N) the rates are 0.
    contacts : ndarray, shape (k, 8)
        What the pins with clearance remember, see `boom_twin.kernels.elements.pin_contact`.
    """

    names: tuple[str, ...]
    values: Array
    rates: Array
    contacts: Array


def undeflected(
    scene: SceneSource, strokes: ArrayLike, joint_rates: Array | None = None, angles: Array | None = None
) -> InitialState:
    """The boom with straight sections on uncompressed cylinders, held there until the motion begins.

    Parameters
    ----------
    scene : Scene, path or mapping
        The boom, of n sections; as for `boom_twin.statics`.
    strokes : array_like, shape (n,)
        m.
    joint_rates : ndarray, shape (n,), optional
        Rates of the joint angles, rad/s; by default none moves.
    angles : ndarray, shape (n,), optional
        Joint angles (rad) next to which the posture is looked for.

    Returns
    -------
    InitialState
        To be given to `boom_twin.simulate`.
    """
    scene = as_scene(scene)
    strokes = checked_strokes(scene, np.asarray(strokes, float))
    found = joint_angles_of_strokes(scene, strokes, near=angles)
    rates = np.zeros(len(found)) if joint_rates is None else np.asarray(joint_rates, float)
    if rates.shape != found.shape or not np.isfinite(rates).all():
        raise UsageError(f"joint_rates = {joint_rates}: give {len(found)} finite values, rad/s.")
    plan = compile_scene(scene)
    state = plan.state()

    def at(share: float) -> Array:
        set_undeformed(plan, state, found + share * rates)
        return state.z.copy()

    contacts = state.contacts
    if plan.pins and plan.tables.clearances.linear.any():  # linearised at the preload of the equilibrium
        contacts = rest_at(scene, strokes, found)[1].contacts
    return InitialState(plan.names, at(0.0), _derivative(at, float(np.abs(rates).max())), contacts)


def _derivative(at: Callable[[float], Array], fastest: float) -> Array:
    """Derivative of `at` at 0, by differences over which what is `fastest` moves by `SPAN`."""
    if fastest == 0.0:
        return np.zeros_like(at(0.0))
    span = SPAN / fastest
    sums: Array = np.sum([weight * at(places * span) for places, weight in STENCIL], axis=0)
    return sums / (12.0 * span)


def state_now(plan: Plan, state: State) -> InitialState:
    """Return the content of `state` as the start of another motion."""
    rates = state.history[V, : len(plan.names)] * plan.tables.moving
    return InitialState(plan.names, state.z.copy(), rates, state.contacts.copy())


def started(
    scene: Scene, initial: InitialState, times: Array, strokes: Array, load: ArrayLike = 0.0
) -> tuple[Plan, State, Work]:
    """Compile a scene and set it in motion; the curve through the drives' first rows (s, m) gives length and rate at the start.

    `load` is the force at the tip then, N. UsageError for coordinates of another boom, or that leave loops open; SolverError
    if no accelerations balance the forces.
    """
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    work.load[:] = load
    _check(plan, initial)
    state.contacts[:] = initial.contacts
    state.contacts[:, LOST] = 0.0
    length, rate = _drive(plan, times, strokes, 0.0)
    state.drives[0], state.drives[1] = length, rate
    _place_moving(plan, state, work, initial)
    _check_loops(plan, state, work, initial, length, rate)
    _check_drives(plan, state, work, length)
    ends = []
    for step in (SHORT, 0.5 * SHORT):
        trial = State(*(array.copy() for array in state))
        scheme, (ahead, speed) = prepare(NEWMARK, HALF, step, work.weights), _drive(plan, times, strokes, step)
        status, _, _ = advance(
            plan.tables, trial, work, scheme, ahead, speed, START_TOLERANCE, PASSES, LONGEST_INCREMENT, None, ANEW
        )
        if status != OK:
            raise SolverError(f"the motion cannot start from the given state: {SENTENCES[status]}.")
        ends.append((trial.history[A], trial.z))
    acceleration, z = (2.0 * fine - coarse for coarse, fine in zip(*ends, strict=True))
    still = plan.tables.moving == 0.0
    state.z[still] = z[still]
    state.history[X, : len(state.z)] = state.z
    state.history[A] = state.history[P] = acceleration
    return plan, state, work


def _check(plan: Plan, initial: InitialState) -> None:
    if initial.names != plan.names:
        odd = sorted(set(initial.names) ^ set(plan.names))
        raise UsageError(
            f"the initial state is of another boom: {', '.join(odd[:6]) or 'its coordinates are in another order'}. "
            "Take the scene that it was made with."
        )
    if initial.contacts.shape != (len(plan.pins), COLUMNS):
        raise UsageError(f"the initial state knows {len(initial.contacts)} pins, the boom has {len(plan.pins)}. Take its own.")
    if not np.isfinite(initial.contacts).all():
        raise UsageError("what the initial state says of the pins is not finite. Give a state that a simulation left.")
    for name, value, rate in zip(initial.names, initial.values, initial.rates, strict=True):
        if not (math.isfinite(value) and math.isfinite(rate)):
            raise UsageError(f"{name} = {value:g}, its rate {rate:g}: not finite. Give numbers.")


def _drive(plan: Plan, times: Array, strokes: Array, after: float) -> tuple[Array, Array]:
    """Length (m) and rate (m/s) of the drives, each (n,), `after` s from the first row."""
    lengths = plan.closed_lengths + strokes
    if len(times) < 2:
        return lengths[0], np.zeros(plan.joints)
    value, slope = pchip(times, lengths, np.array([min(times[0] + after, times[-1])]))
    return value[0], slope[0]


def _place_moving(plan: Plan, state: State, work: Work, initial: InitialState) -> None:
    """Write positions and velocities of all mass points into the history of `state`."""
    fastest = float(np.max(np.abs(initial.rates)))

    def at(share: float) -> Array:
        state.z[:] = initial.values + share * initial.rates
        place(plan.tables, state, work)
        return work.position.copy()

    state.history[X] = at(0.0)
    state.history[X] = at(0.0)  # angles of cylinders are the ones next to those of the first time
    state.history[V] = _derivative(at, fastest)
    at(0.0)


def _check_loops(plan: Plan, state: State, work: Work, initial: InitialState, length: Array, rate: Array) -> None:
    """Raise UsageError if links do not meet, or an incompressible cylinder is not as long, or as fast, as its drive."""

    def at(share: float) -> Array:
        state.z[:] = initial.values + share * initial.rates
        place(plan.tables, state, work)
        return _open_loops(plan, state, work)

    gaps, fastest = at(0.0), float(np.max(np.abs(initial.rates)))
    speeds = _derivative(at, fastest)
    at(0.0)
    names = [f"joint_{i + 1}.Q, {axis}" for i in range(1, plan.joints) for axis in "xy"]
    hard = np.flatnonzero(_incompressible(plan))
    names += [f"cylinder_{i + 1} and its drive" for i in hard]
    gaps[2 * (plan.joints - 1) :] -= length[hard]
    speeds[2 * (plan.joints - 1) :] -= rate[hard]
    for name, gap, speed in zip(names, gaps, speeds, strict=True):
        if abs(gap) > OPEN or abs(speed) > OPEN:
            raise UsageError(
                f"{name}: {gap:.3g} m apart at the start, parting at {speed:.3g} m/s; {OPEN:g} is let pass. Give coordinates "
                "and rates that close the loops, as those of an earlier run do, and an incompressible cylinder the rate of its "
                "drive."
            )


def _check_drives(plan: Plan, state: State, work: Work, length: Array) -> None:
    """Raise UsageError if springs are not as long as the state's own forces make them: the drives begin elsewhere."""
    cylinders = plan.tables.cylinders
    forces = state.z[cylinders.z]
    began = work.position[cylinders.history] - plan.compliances_and_lags(length)[0] * forces
    for i in np.flatnonzero(~_incompressible(plan) & (forces != 0.0) & (np.abs(began - length) > FARTHEST_START)):
        own, given = began[i] - plan.closed_lengths[i], length[i] - plan.closed_lengths[i]
        raise UsageError(
            f"stroke_{i + 1}_m = {given:.5g} m in the first row: the initial state is of a stroke of {own:.5g} m; "
            f"{1e3 * FARTHEST_START:g} mm is let pass. Begin the drive where the state was taken."
        )


def _incompressible(plan: Plan) -> NDArray[np.bool_]:
    """Return a mask of the cylinders that have neither k nor oil, shape (n,)."""
    cylinders = plan.tables.cylinders
    return np.asarray((cylinders.compliance == 0.0) & (cylinders.oil < 0))


def _open_loops(plan: Plan, state: State, work: Work) -> Array:
    """Return how far links miss each other (m, two a six-bar), then lengths (m) of incompressible cylinders."""
    t, z, found = plan.tables, state.z, []
    for k in np.flatnonzero(t.operations.kind == JOINT_B):
        joint, linkage, turns = (row[t.operations[k].row] for row in (t.joints, t.linkages, state.turns))
        ends = []
        for side, length, pins in (
            (LINK_L, linkage.length_l, (LINK_L_PIN, Q_PIN)),
            (LINK_R, linkage.length_r, (PIVOT, LINK_R_PIN)),
        ):
            bx, by, c, s = link_frame(side, linkage, turns)
            offsets = np.sum([offset_of(t, z, joint, pin) for pin in pins], axis=0)
            ends.append(np.array([bx + length * c, by + length * s]) + offsets)
        found += [*(ends[0] - ends[1])]
    return np.array([*found, *work.position[t.cylinders.history[_incompressible(plan)]]])


def write_state(path: Path, state: InitialState) -> None:
    """Keep a state as JSON: coordinates with value and rate, and what the pins remember."""
    coordinates = zip(state.names, state.values.tolist(), state.rates.tolist(), strict=True)
    rows = ",\n".join(f"  {json.dumps(name)}: {json.dumps([value, rate])}" for name, value, rate in coordinates)
    write_atomic(path, f'{{"coordinates": {{\n{rows}\n }},\n "pins": {json.dumps(state.contacts.tolist())}}}\n')


def read_state(path: Path) -> InitialState:
    """A state that `write_state` kept; UsageError if the file has another form."""
    try:
        with open_received(path) as file:
            content = json.load(file, object_pairs_hook=_without_repetition)
        pairs = content["coordinates"]
        values = np.array([_numbers(name, row, 2) for name, row in pairs.items()]).reshape(-1, 2)
        pins = np.array([_numbers(f"pins[{i}]", row, COLUMNS) for i, row in enumerate(content["pins"])]).reshape(-1, COLUMNS)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        told = f"no {error}" if isinstance(error, KeyError) else error
        raise UsageError(f"{path}: {told}. Give a file that `boom_twin simulate --save-state` wrote.") from None
    return InitialState(tuple(pairs), values[:, 0], values[:, 1], pins)


def _without_repetition(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"{next(name for name in names if names.count(name) > 1)} is given twice")
    return found


def _numbers(name: str, row: Any, count: int) -> list[float]:
    if not (isinstance(row, list) and len(row) == count and all(type(each) in (int, float) for each in row)):
        raise ValueError(f"{name} = {str(row)[:60]}: must be {count} numbers")
    return [float(each) for each in row]
