"""Static equilibrium of a boom under gravity for given strokes, and small vibrations about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..chain.program import State, Work
from ..chain.status import OK
from ..chain.step import advance, observe
from ..errors import SolverError, UsageError
from ..physics.integrators import REST, prepare
from ..plan.compile import compile_scene
from ..plan.plan import Plan
from ..records import Array
from ..scene.kinematics import joint_angles_of_strokes, posture_angles, strokes_of_posture
from ..scene.parts import Scene
from .frequencies import Mode, constraints, natural_modes, negative_pivots
from .posture import rigid_tip, set_undeformed
from .seating import clamp_pins, linearise_pins, loosen_pins, release_pins
from .validity import beyond_validity

TOLERANCE = 1e-9  # rad in the last pass; what is left is its square
PASSES = 60
LONGEST_INCREMENT = 0.1  # rad in one pass
FIRST_LOAD, LEAST_LOAD = 0.05, 1e-3  # of gravity: first step where the full load at once fails, and the smallest that is tried
LEAST_SHARE = 1e-3  # of the clearances, likewise


@dataclass(frozen=True)
class Equilibrium:
    """A boom at rest. n sections.

    Attributes
    ----------
    strokes : ndarray, shape (n,)
        m.
    tip_rigid, tip : ndarray, shape (2,)
        Tip of the undeformed and of the deflected boom, m.
    joints : ndarray, shape (n,)
        Root of section i against head of section i - 1, rad.
    cylinder_forces : ndarray, shape (n,)
        N, positive in tension.
    modes : tuple of Mode
        Undamped, about this equilibrium, ascending.
    outline : ndarray, shape (k, 2)
        Points of the deflected centre line from base to tip, m.
    doubts : tuple of str
        A sentence if it is outside the model's validity, see `analysis.validity`.
    """

    strokes: Array
    tip_rigid: Array
    tip: Array
    joints: Array
    cylinder_forces: Array
    modes: tuple[Mode, ...]
    outline: Array
    doubts: tuple[str, ...] = ()

    @property
    def frequencies(self) -> Array:
        """Natural frequencies, Hz, ascending, shape (modes,)."""
        return np.array([mode.frequency for mode in self.modes])


def statics(scene: Scene, strokes: Array | None = None, posture: str | None = None, modes: int = 6) -> Equilibrium:
    """Equilibrium under gravity at absolute `strokes` (m), shape (n,), or at a named `posture` of the scene.

    Raises
    ------
    UsageError
        Unknown posture, strokes outside the cylinders, not exactly one of strokes and posture.
    SolverError
        No stable equilibrium was found.
    """
    if (strokes is None) == (posture is None):
        raise UsageError("give either strokes or a posture, not both and not neither.")
    if posture is not None:
        strokes, angles = strokes_of_posture(scene, posture), posture_angles(scene, posture)
    else:
        assert strokes is not None
        strokes = checked_strokes(scene, strokes)
        angles = joint_angles_of_strokes(scene, strokes)
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    settle(plan, state, work, strokes, angles)
    row = np.empty(2 * plan.joints + 9)
    observe(plan.tables, state, row)
    n = plan.joints
    undeformed, tip = rigid_tip(scene, angles), state.frames[-1, :2].copy()
    return Equilibrium(
        strokes=strokes,
        tip_rigid=undeformed,
        tip=tip,
        joints=row[:n],
        cylinder_forces=row[n : 2 * n],
        modes=natural_modes(plan, state, work, modes),
        outline=outline(plan, state, work.position),
        doubts=beyond_validity(scene, float(np.hypot(*(tip - undeformed)))),
    )


def checked_strokes(scene: Scene, strokes: Array) -> Array:
    """`strokes` as an array, shape (n,); UsageError unless there is one for every cylinder, within its travel."""
    values = np.asarray(strokes, dtype=float)
    n = len(scene.joints)
    if values.shape != (n,):
        raise UsageError(f"strokes = {values.size} values: the scene has {n} cylinders. Give {n} values in m.")
    for i, value in enumerate(values):
        most = scene.joints[i].cylinder.max_stroke
        if not 0.0 <= value <= most:
            raise UsageError(f"stroke_{i + 1} = {value:g} m: cylinder {i + 1} travels 0 to {most:g} m. Give it in metres.")
    return values


def settle(plan: Plan, state: State, work: Work, strokes: Array, angles: Array) -> None:
    """Bring `state` to rest in equilibrium at `strokes` (m), from the undeformed boom at joint `angles` (rad).

    The full load at once is tried first, then gradually, both with ideal pins; then those with clearance are let go,
    likewise. Histories are left without motion.
    """
    drive, where = plan.closed_lengths + strokes, ", ".join(f"{stroke:.4f}" for stroke in strokes)
    state.drives[0], state.drives[1], state.pace[0] = drive, 0.0, 0
    clamp_pins(state)
    set_undeformed(plan, state, angles)
    if not _rests(plan, state, work, drive, 1.0):
        set_undeformed(plan, state, angles)
        share = _load_gradually(plan, state, work, drive)
        if share < 1.0:
            raise SolverError(
                f"no equilibrium at strokes {where} m: the boom carries {share:.2g} of its weight, then it moves on and on or "
                "folds a linkage over. Check masses, payload, stiffnesses, and how near the posture is to the end of a joint's "
                "range."
            )
    if plan.pins:
        release_pins(plan, state)
        if _loosen_gradually(plan, state, work, drive) < 1.0:
            raise SolverError(
                f"no equilibrium at strokes {where} m with clearance in {', '.join(plan.pins)}, though there is one with ideal "
                "pins. Check radial_clearance (m), and how near the posture is to a dead centre."
            )
        linearise_pins(plan, state)


def _load_gradually(plan: Plan, state: State, work: Work, drive: Array) -> float:
    """Follow the equilibrium from no gravity towards all of it; returns the share that was reached."""
    return _gradually(state, FIRST_LOAD, LEAST_LOAD, lambda share, aim: _rests(plan, state, work, drive, aim))


def _loosen_gradually(plan: Plan, state: State, work: Work, drive: Array) -> float:
    """Follow the equilibrium from no clearance to all of it, at once if that goes; returns the share that was reached."""

    def rests(share: float, aim: float) -> bool:
        return _rests(loosen_pins(plan, state, aim, aim - share), state, work, drive, 1.0)

    return _gradually(state, 1.0, LEAST_SHARE, rests)


def _gradually(state: State, step: float, least: float, rests: Callable[[float, float], bool]) -> float:
    """Follow what `rests` solves from share to share, in steps that halve down to `least` where it fails and double."""
    share = 0.0
    while share < 1.0 and step >= least:
        z, history, aim = state.z.copy(), state.history.copy(), min(share + step, 1.0)
        if rests(share, aim):
            share, step = aim, 2.0 * step
        else:
            state.z[:], state.history[:] = z, history
            step *= 0.5
    return share


def _rests(plan: Plan, state: State, work: Work, drive: Array, load: float) -> bool:
    """Solve for equilibrium under `load` times gravity from the present guess; whether there is a stable one."""
    loaded = replace(plan, tables=plan.tables._replace(gravity=load * plan.tables.gravity))
    scheme, still = prepare(REST, 0.0, 0.0, work.weights), np.zeros(plan.joints)
    status, _, _ = advance(loaded.tables, state, work, scheme, drive, still, TOLERANCE, PASSES, LONGEST_INCREMENT, None)
    return bool(status == OK and is_stable(loaded, state, work))


def is_stable(plan: Plan, state: State, work: Work) -> bool:
    """Whether energy has a minimum here: as many negative pivots as there are forces among the unknowns."""
    try:
        return negative_pivots(plan, state, work, 0.0) == constraints(plan)
    except SolverError:
        return False


def outline(plan: Plan, state: State, position: Array) -> Array:
    """Points (k, 2) of the centre line, base to tip, m; `position` holds all history positions."""
    frames, points = plan.outline[:, 0] == 0, plan.outline[:, 0] == 1
    line = np.empty((len(plan.outline), 2))
    line[frames] = state.frames[plan.outline[frames, 1], :2]
    at = plan.outline[points, 1]
    line[points, 0], line[points, 1] = position[at], position[at + 1]
    return line[1:]
