"""Static equilibrium of a boom under gravity for given strokes, with and without clearance in its pins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..compiler.compile import compile_scene
from ..compiler.plan import Plan, first_row, taken_apart
from ..errors import SolverError, UsageError
from ..kernels.elements.linkage import link_angles
from ..kernels.elements.pin_contact import APPROACH, CLOSED, DAMPER, FORCE, NEAR, SEAT_X, SEAT_Y, SLOWEST, SPRING, penetration
from ..kernels.integrators import REST, X, prepare
from ..kernels.tables import OK, Z_LINK_L, Z_LINK_R, Z_SECTION, State, Work
from ..kernels.transfer.clearance_pins import axis_of
from ..kernels.transfer.time_step import ANEW, advance
from ..scene.edit import with_rigid_cylinders
from ..scene.kinematics import joint_angles_of_strokes, posture_angles, skeleton, strokes_of_posture
from ..scene.load import SceneSource, as_scene
from ..scene.schema import Scene
from ..system.summary_display import SummaryDisplay, numbers
from ..types import Array
from .cylinder_drives import spring_free
from .modal import Mode, constraints, natural_modes, negative_pivots

CLAMP = 1e12  # N/m, a pin that is as good as ideal


def clamp_pins(state: State) -> None:
    """Hold all journals in the middle of their bushes."""
    state.contacts[:] = 0.0
    state.contacts[:, SPRING] = CLAMP


def release_pins(plan: Plan, state: State) -> None:
    """Let contact hold every clamped journal, as deep in its bush as its force presses it, with no clearance yet."""
    for row, memory in zip(plan.tables.clearances, state.contacts, strict=True):
        offset = state.z[row.z : row.z + 2]
        distance = float(np.hypot(*offset))
        if distance > 0.0:
            offset *= (CLAMP * distance / row.stiffness) ** (1.0 / row.exponent) / distance
        memory[SPRING], memory[CLOSED], memory[APPROACH] = 0.0, 1.0, SLOWEST


def loosen_pins(plan: Plan, state: State, share: float, more: float) -> Plan:
    """Move every journal outwards by `more` of its clearance; returns the boom with `share` of all clearances."""
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
    """Note which pins touch, and give those that are to be linear their spring and damper at the present force."""
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
    """Write the undeformed boom at relative joint `angles` (rad), shape (n,), into the state; all forces zero."""
    state.z[:] = 0.0
    heading = 0.0
    for i, angle in enumerate(angles):
        z = plan.tables.joints[i].z
        if plan.tables.linkages[i].length_l > 0.0:
            left, right = link_angles(plan.tables.linkages[i], angle)
            state.z[z + Z_LINK_L], state.z[z + Z_LINK_R] = heading + left, heading + right
        heading += angle
        state.z[z + Z_SECTION] = heading
    state.history[X, : len(state.z)] = state.z


SHARE = 0.5  # of the boom's reach, most that the tip may be off the undeformed boom's
INSTANTS = 8  # of a motion, evenly spaced, at which that is looked at; and where the tip is farthest from its start


def beyond_validity(scene: Scene, away: float) -> tuple[str, ...]:
    """A sentence if a tip `away` (m) from the undeformed boom's is outside the model's validity."""
    if away <= SHARE * scene.reach:
        return ()
    return (
        f"the tip is {away:.3g} m from where rigid sections and cylinders would have it, more than half the reach of "
        f"{scene.reach:.3g} m: outside the model's validity. Check stiffnesses, masses and load",
    )


def motion_beyond_validity(scene: Scene, strokes: Array, tip: Array, angles: Array | None) -> tuple[str, ...]:
    """Return the sentence of `beyond_validity` for the worst of some instants of a motion.

    `strokes` (m, n) and `tip` (m, 2) are in m; `angles` (n,) are near the first joint angles, rad.
    """
    rows: NDArray[np.int64] = np.linspace(0, len(tip) - 1, INSTANTS).astype(np.int64)
    rows = np.unique(np.append(rows, np.argmax(np.hypot(*(tip - tip[0]).T))))
    worst, near = 0.0, angles
    for row in rows:
        try:
            near = joint_angles_of_strokes(scene, strokes[row], near=near)
        except UsageError:  # in the cylinder's travel, but out of the joint's range
            continue
        worst = max(worst, float(np.hypot(*(tip[row] - skeleton(scene, near).pivots[-1]))))
    return beyond_validity(scene, worst)


TOLERANCE = 1e-9  # rad in the last pass; what is left is its square
PASSES = 60
LONGEST_INCREMENT = 0.1  # rad in one pass
FIRST_LOAD, LEAST_LOAD = 0.05, 1e-3  # of gravity: first step where the full load at once fails, and the smallest that is tried
LEAST_SHARE = 1e-3  # of the clearances, likewise


@dataclass(frozen=True, repr=False)
class Equilibrium(SummaryDisplay):
    """A boom at rest. n sections.

    Attributes
    ----------
    strokes, lengths : ndarray, shape (n,)
        Drives, and lengths of the cylinders pin to pin less `closed_length`, m: they differ by what the oil gives.
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
        A sentence if it is outside the model's validity, see `analysis.equilibrium`.
    """

    strokes: Array
    lengths: Array
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

    def summary_rows(self) -> dict[str, str]:
        """See `boom_twin.system.summary_display.SummaryDisplay`."""
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
        Absolute strokes of the drives, m; or the name of a posture.
    posture : str, optional
        A posture of the scene; just one of strokes, posture and lengths is given.
    modes : int
        How many natural frequencies are looked for, the lowest first.
    lengths : array_like, shape (n,), optional
        What stroke transducers read of the boom at rest, m: pin to pin less `closed_length`, with the oil compressed.

    Returns
    -------
    Equilibrium
        Tip, joint angles, cylinder forces and natural frequencies of the boom at rest.

    Raises
    ------
    UsageError
        Unknown posture, strokes or lengths outside the cylinders, not exactly one of strokes, posture and lengths.
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
    found = taken_apart(plan, first_row(plan, state))
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
        doubts=beyond_validity(scene, float(np.hypot(*(tip - undeformed)))),
    )


def strokes_and_angles(scene: Scene, strokes: ArrayLike | str | None, posture: str | None) -> tuple[Array, Array]:
    """Strokes (m) and joint angles (rad) of the undeformed boom, both (n,), at `strokes` or in a `posture` of the scene.

    A name given for `strokes` is that of a posture.

    Raises
    ------
    UsageError
        Unknown posture, strokes outside the cylinders, not exactly one of strokes and posture.
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
    """Return `strokes` as an array, shape (n,); UsageError, by `name`, unless each cylinder has one within its travel."""
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
    """Return the drives (m), shape (n,), of the boom that rests with these cylinder `lengths` (m) next to joint `angles` (rad).

    A cylinder at rest is a strut, whatever its oil. So the boom without oil springs gives the forces, and these the springs'
    extension.
    """
    struts, state, _ = rest_at(with_rigid_cylinders(scene), lengths, angles)
    return spring_free(compile_scene(scene), lengths, taken_apart(struts, first_row(struts, state)).cylinder_forces)


def travel_words(i: int, most: float) -> str:
    """Return a sentence with the stroke range of cylinder `i` (0-based), and the remedy for another stroke."""
    return f"cylinder {i + 1} travels 0 to {most:g} m. Give in m by how much it is longer than closed_length."


def rest_at(scene: Scene, strokes: Array, angles: Array) -> tuple[Plan, State, Work]:
    """Compile a scene and bring it to rest at `strokes` (m) next to joint `angles` (rad), both (n,); see `settle`."""
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    settle(plan, state, work, strokes, angles)
    return plan, state, work


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
        share = _gradually(state, FIRST_LOAD, LEAST_LOAD, lambda share, aim: _rests(plan, state, work, drive, aim))
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
    """Solve for equilibrium under `load` times gravity from the present guess; return True if there is a stable one."""
    loaded = replace(plan, tables=plan.tables._replace(gravity=load * plan.tables.gravity))
    scheme, still = prepare(REST, 0.0, 0.0, work.weights), np.zeros(plan.joints)
    for cylinder in plan.tables.cylinders:  # angles of barrels and rods within half a turn, whatever was tried
        own = slice(cylinder.first_part, cylinder.first_part + cylinder.parts)
        state.history[X, plan.tables.parts.history[own] + 2] = 0.0
    status, _, _ = advance(loaded.tables, state, work, scheme, drive, still, TOLERANCE, PASSES, LONGEST_INCREMENT, None, ANEW)
    return bool(status == OK and is_stable(loaded, state, work))


def is_stable(plan: Plan, state: State, work: Work) -> bool:
    """Return True if energy has a minimum here: as many negative pivots as there are forces among the unknowns."""
    try:
        return negative_pivots(plan, state, work, 0.0) == constraints(plan)
    except SolverError:
        return False


def outline(plan: Plan, frames: Array, position: Array) -> Array:
    """Points (.., k, 2) of the centre line, base to tip, m.

    Parameters
    ----------
    plan : Plan
    frames : ndarray, shape (.., operations + 1, 5)
        See `boom_twin.kernels.tables.State`.
    position : ndarray, shape (.., histories)
        All history positions.
    """
    are_frames, are_points = plan.outline[:, 0] == 0, plan.outline[:, 0] == 1
    line = np.empty((*frames.shape[:-2], len(plan.outline), 2))
    line[..., are_frames, :] = frames[..., plan.outline[are_frames, 1], :2]
    at = plan.outline[are_points, 1]
    line[..., are_points, 0], line[..., are_points, 1] = position[..., at], position[..., at + 1]
    return line[..., 1:, :]
