"""Static equilibrium of a boom under gravity for given strokes, with and without clearance in its pins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..compiler.compile import compile_scene
from ..compiler.plan import Plan
from ..errors import SolverError, UsageError
from ..kernels.elements.linkage import link_angles
from ..kernels.elements.pin_contact import APPROACH, CLOSED, DAMPER, FORCE, NEAR, SEAT_X, SEAT_Y, SLOWEST, SPRING, penetration
from ..kernels.integrators import REST, X, prepare
from ..kernels.tables import OK, Z_LINK_L, Z_LINK_R, Z_SECTION, State, Work
from ..kernels.transfer.clearance_pins import axis_of
from ..kernels.transfer.time_step import advance
from ..scene.edit import with_rigid_cylinders
from ..scene.kinematics import joint_angles_of_strokes, plain, posture_angles, skeleton, strokes_of_posture
from ..scene.load import SceneSource, as_scene
from ..scene.schema import Scene
from ..system.result_text import SummaryDisplay, numbers
from ..types import Array
from .doubts import beyond_validity
from .drive import spring_free
from .modal import Mode, constraints, natural_modes, negative_pivots

CLAMP = 1e12  # N/m, stiffness of a practically ideal pin


def clamp_pins(state: State) -> None:
    """Hold all journals in the middle of their bushes by stiff springs."""
    state.contacts[:] = 0.0
    state.contacts[:, SPRING] = CLAMP


def release_pins(plan: Plan, state: State) -> None:
    """Replace every clamp by contact with zero clearance, at the penetration that gives the same force."""
    for row, memory in zip(plan.tables.clearances, state.contacts, strict=True):
        offset = state.z[row.z : row.z + 2]
        distance = float(np.hypot(*offset))
        if distance > 0.0:
            offset *= (CLAMP * distance / row.stiffness) ** (1.0 / row.exponent) / distance
        memory[SPRING], memory[CLOSED], memory[APPROACH] = 0.0, 1.0, SLOWEST


def loosen_pins(plan: Plan, state: State, share: float, more: float) -> Plan:
    """Move every journal outwards by the fraction `more` of its clearance; return the plan with `share` of all clearances."""
    worn = plan.tables.clearances.copy()
    for row in worn:
        offset = state.z[row.z : row.z + 2]
        distance = float(np.hypot(*offset))
        if distance > 0.0:
            offset *= 1.0 + more * row.gap / distance
        state.history[X, row.z : row.z + 2] = offset
        row.gap *= share
    return replace(plan, tables=plan.tables._replace(clearances=worn))


def linearise_pins(plan: Plan, state: State) -> None:
    """Store which pins touch, and set spring and damper of linearised pins at the present force."""
    for row, memory in zip(plan.tables.clearances, state.contacts, strict=True):
        offset = state.z[row.z : row.z + 2]
        distance = float(np.hypot(*offset))
        memory[CLOSED] = float(distance > row.gap - NEAR)
        _, _, _, depth, _ = penetration(row, *offset)
        memory[FORCE] = row.stiffness * depth**row.exponent
        if row.linear:
            memory[SPRING] = row.exponent * memory[FORCE] / depth
            memory[DAMPER] = row.loss * memory[FORCE] / SLOWEST
            x, y = offset * (1.0 - memory[FORCE] / (memory[SPRING] * distance))
            c, s = axis_of(plan.tables, state, row)
            memory[SEAT_X], memory[SEAT_Y] = c * x + s * y, c * y - s * x


def set_undeformed(plan: Plan, state: State, angles: Array) -> None:
    """Set the state to the undeformed boom at joint `angles` (rad), shape (n,), with all forces zero."""
    state.z[:] = 0.0
    heading = 0.0
    for linkage, z, angle in zip(plan.tables.linkages, plan.tables.joints.z.tolist(), angles, strict=True):
        row = plain(linkage)
        if row.length_l > 0.0:
            left, right = link_angles(row, angle)
            state.z[z + Z_LINK_L], state.z[z + Z_LINK_R] = heading + left, heading + right
        heading += angle
        state.z[z + Z_SECTION] = heading
    state.history[X, : len(state.z)] = state.z


TOLERANCE = 1e-9  # rad, increment in the last pass; the remaining error is its square
PASSES = 60
LONGEST_INCREMENT = 0.1  # rad per pass


@dataclass(frozen=True, repr=False)
class Equilibrium(SummaryDisplay):
    """State of a boom at rest, with n sections.

    Attributes
    ----------
    strokes, lengths : ndarray, shape (n,)
        Drives, and cylinder lengths (pin to pin minus `closed_length`), m. They differ by the oil's compression.
    tip_rigid, tip : ndarray, shape (2,)
        Tip of the undeformed and of the deflected boom, m.
    joints : ndarray, shape (n,)
        Angle from head of section i - 1 to root of section i, rad.
    cylinder_forces : ndarray, shape (n,)
        N, positive in tension.
    modes : tuple of Mode
        Undamped modes about this equilibrium, ascending.
    outline : ndarray, shape (k, 2)
        Points of the deflected centre line from base to tip, m.
    base_turn : float, optional
        Turn of an elastic base under the load, rad; None for a rigid one.
    doubts : tuple of str
        Warning if the boom is outside the model's validity, see `beyond_validity`.
    """

    strokes: Array
    lengths: Array
    tip_rigid: Array
    tip: Array
    joints: Array
    cylinder_forces: Array
    modes: tuple[Mode, ...]
    outline: Array
    base_turn: float | None = None
    doubts: tuple[str, ...] = ()

    @property
    def frequencies(self) -> Array:
        """Natural frequencies, Hz, ascending, shape (modes,)."""
        return np.array([mode.frequency for mode in self.modes])

    def summary_rows(self) -> dict[str, str]:
        """See `boom_twin.system.result_text.SummaryDisplay`."""
        return {
            "tip": f"{numbers(self.tip)} m",
            "deflection": f"{numbers(self.tip - self.tip_rigid, 1e3)} mm",
            "cylinder forces": f"{numbers(self.cylinder_forces, 1e-3)} kN",
            "frequencies": f"{numbers(self.frequencies)} Hz",
            "doubts": "; ".join(self.doubts) or "none",
        }


def statics(
    scene: SceneSource = None,
    strokes: ArrayLike | str | None = None,
    posture: str | None = None,
    modes: int = 6,
    lengths: ArrayLike | None = None,
) -> Equilibrium:
    """Find the equilibrium under gravity at given drives, at given cylinder lengths, or in a posture of the scene.

    Parameters
    ----------
    scene : Scene, path or mapping
        The boom, of n sections: a `Scene`, a scene file, a dict with its keys; None: the default scene.
    strokes : array_like, shape (n,), or str, optional
        Absolute strokes of the drives, m, or a posture name.
    posture : str, optional
        A posture of the scene. Give exactly one of strokes, posture and lengths.
    modes : int
        Number of natural frequencies, lowest first.
    lengths : array_like, shape (n,), optional
        Stroke transducer readings at rest, m: pin to pin minus `closed_length`, with the oil compressed.

    Returns
    -------
    Equilibrium
        Tip, joint angles, cylinder forces and natural frequencies of the boom at rest.

    Raises
    ------
    UsageError
        Unknown posture, strokes or lengths out of range, or not exactly one of strokes, posture and lengths.
    SolverError
        No stable equilibrium was found.
    """
    scene = as_scene(scene)
    if lengths is None:
        strokes, angles = strokes_and_angles(scene, strokes, posture)
    elif strokes is None and posture is None:
        lengths = checked_strokes(scene, np.asarray(lengths, dtype=float), "length")
        angles = joint_angles_of_strokes(scene, lengths, name="length")
        strokes = drives_at_rest(scene, lengths, angles)
    else:
        raise UsageError("give one of strokes, posture and lengths, not two.")
    plan, state, work = rest_at(scene, strokes, angles)
    found = plan.observed(state)
    undeformed, tip = skeleton(scene, angles).pivots[-1], state.frames[-1, :2].copy()
    return Equilibrium(
        strokes=strokes,
        lengths=found.lengths,
        tip_rigid=undeformed,
        tip=tip,
        joints=found.joints,
        cylinder_forces=found.cylinder_forces,
        modes=natural_modes(plan, state, work, modes),
        outline=outline(plan, state.frames, work.position),
        base_turn=None if scene.base.stiffness is None else float(state.z[plan.tables.hinges.z[0]]),
        doubts=beyond_validity(scene, float(np.hypot(*(tip - undeformed)))),
    )


def strokes_and_angles(scene: Scene, strokes: ArrayLike | str | None, posture: str | None) -> tuple[Array, Array]:
    """Return strokes (m) and joint angles (rad) of the undeformed boom, both (n,), at `strokes` or in a `posture`.

    A string as `strokes` is a posture name. UsageError if not exactly one is given, or if it is unknown or out of range.
    """
    if isinstance(strokes, str):
        strokes, posture = None, strokes if posture is None else None
    if (strokes is None) == (posture is None):
        raise UsageError("give either strokes or a posture, not both and not neither.")
    if posture is not None:
        return strokes_of_posture(scene, posture), posture_angles(scene, posture)
    found = checked_strokes(scene, np.asarray(strokes, dtype=float))
    return found, joint_angles_of_strokes(scene, found)


def checked_strokes(scene: Scene, strokes: Array, name: str = "stroke") -> Array:
    """Return `strokes` as an array (n,); UsageError, with `name`, unless each cylinder has one within its travel."""
    values = np.asarray(strokes, dtype=float)
    n = len(scene.joints)
    if values.shape != (n,):
        raise UsageError(f"{name}s = {values.size} values: the scene has {n} cylinders. Give {n} values in m.")
    for i, value in enumerate(values):
        most = scene.joints[i].cylinder.max_stroke
        if not 0.0 <= value <= most:
            raise UsageError(f"{name}_{i + 1} = {value:g} m: {travel_words(i, most)}")
    return values


def drives_at_rest(scene: Scene, lengths: Array, angles: Array) -> Array:
    """Return the drives (m), shape (n,), of the boom at rest with cylinder `lengths` (m), near joint `angles` (rad).

    Cylinder forces at given lengths do not depend on the oil. They are computed with rigid cylinders, and give the extension
    of the oil springs.
    """
    struts, state, _ = rest_at(with_rigid_cylinders(scene), lengths, angles)
    return spring_free(compile_scene(scene), lengths, struts.observed(state).cylinder_forces)


def travel_words(i: int, most: float) -> str:
    """Return the stroke range of cylinder `i` (0-based) and the remedy, for an error message."""
    return f"cylinder {i + 1} travels 0 to {most:g} m. Give in m by how much it is longer than closed_length."


def rest_at(scene: Scene, strokes: Array, angles: Array, load: ArrayLike = 0.0) -> tuple[Plan, State, Work]:
    """Compile a scene and solve its equilibrium at `strokes` (m) near joint `angles` (rad), both (n,); see `settle`.

    `load` is a force at the tip, x and y, N.
    """
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    work.load[:] = load
    settle(plan, state, work, strokes, angles)
    return plan, state, work


def settle(plan: Plan, state: State, work: Work, strokes: Array, angles: Array) -> None:
    """Set `state` to equilibrium at `strokes` (m), starting from the undeformed boom at joint `angles` (rad).

    With ideal pins the full load is tried first, then load steps. Then the clearances are introduced in the same way.
    Histories end without motion.
    """
    first_load, least_load = 0.05, 1e-3  # first and smallest load step, as fractions of gravity, if the full load fails
    drive, where = plan.closed_lengths + strokes, ", ".join(f"{stroke:.4f}" for stroke in strokes)
    state.drives[0], state.drives[1], state.pace[0] = drive, 0.0, 0
    clamp_pins(state)
    set_undeformed(plan, state, angles)
    if not _rests(plan, state, work, drive, 1.0):
        set_undeformed(plan, state, angles)
        share = _gradually(state, first_load, least_load, lambda share, aim: _rests(plan, state, work, drive, aim))
        if share < 1.0:
            raise SolverError(
                f"no equilibrium at strokes {where} m: the boom carries {share:.2g} of its weight, then it keeps moving or a "
                "linkage folds over. Check masses, payload, stiffnesses, and how near the posture is to the end of a joint's "
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


def _loosen_gradually(plan: Plan, state: State, work: Work, drive: Array) -> float:
    """Follow the equilibrium from zero to full clearance, in one step if possible; return the fraction reached."""
    least_clearance_step = 1e-3  # smallest clearance step, as a fraction of the clearances

    def rests(share: float, aim: float) -> bool:
        return _rests(loosen_pins(plan, state, aim, aim - share), state, work, drive, 1.0)

    return _gradually(state, 1.0, least_clearance_step, rests)


def _gradually(state: State, step: float, least: float, rests: Callable[[float, float], bool]) -> float:
    """Return the largest fraction reached. A step doubles if `rests` succeeds, and halves, to `least`, if it fails."""
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
    """Solve for equilibrium under `load` times gravity from the present guess; return True if a stable one is found."""
    loaded = plan if load == 1.0 else replace(plan, tables=plan.tables._replace(gravity=load * plan.tables.gravity))
    scheme, still = prepare(REST, 0.0, 0.0, work.weights), np.zeros(plan.joints)
    state.history[X, plan.tables.parts.history + 2] = 0.0  # barrels and rods: within half a turn after failed attempts
    status, _, _ = advance(loaded.tables, state, work, scheme, drive, still, TOLERANCE, PASSES, LONGEST_INCREMENT, None, False)
    return bool(status == OK and is_stable(loaded, state, work))


def is_stable(plan: Plan, state: State, work: Work) -> bool:
    """Return True if energy is minimal: negative pivots equal the constraint forces among the unknowns in number."""
    try:
        return negative_pivots(plan, state, work, 0.0) == constraints(plan)
    except SolverError:
        return False


def outline(plan: Plan, frames: Array, position: Array) -> Array:
    """Return points (.., k, 2) of the centre line from base to tip, m.

    `frames` (.., operations + 1, 5) are those of `boom_twin.kernels.tables.State`, `position` (.., histories) all positions.
    """
    are_frames, are_points = plan.outline[:, 0] == 0, plan.outline[:, 0] == 1
    line = np.empty((*frames.shape[:-2], len(plan.outline), 2))
    line[..., are_frames, :] = frames[..., plan.outline[are_frames, 1], :2]
    at = plan.outline[are_points, 1]
    line[..., are_points, 0], line[..., are_points, 1] = position[..., at], position[..., at + 1]
    return line[..., 1:, :]
