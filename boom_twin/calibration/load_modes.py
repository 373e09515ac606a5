"""Reduced model of a boom's small motions along a session, in the lowest natural modes of its postures.

Deviations from the prediction are u = Psi q, with the modes Psi of the present posture (unit modal mass) as shapes:

    q'' + D q' + K q = Phi^T f + N d

f (2), N: force at the tip; d (n), m: what the strokes are longer by; Phi, N: the shapes' motion of the tip and forces of the
cylinders.

Modes are made at knots along the strokes' travel. Those of a knot are turned into the ones of the knot before by the rotation
that is nearest in the sense of the masses, so that no coupling by the change of shapes is left, crossing modes do no harm, and
all matrices may be interpolated between knots. They have to be, at every instant: in steps they would shake the boom, several
times a second, as often as it swings by itself.
"""

from __future__ import annotations

import math
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..analysis.bending_moments import increments_by_tip_force
from ..analysis.equilibrium import settle
from ..analysis.modal import Mode, joint_increments, natural_modes
from ..compiler.compile import compile_scene
from ..compiler.plan import Plan
from ..errors import SolverError
from ..kernels.elements.linkage import cylinder_length
from ..kernels.tables import FRAME_ANGLE
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.schema import Scene
from ..types import Array
from .sessions import SessionCourse

TRAVEL = 0.05  # rad at most that a section turns from one knot to the next
APART = 0.005  # rad, at least between two holds that have knots of their own
EVERY = 20  # instants, at which the turns are looked at
HIGHEST = 25.0  # Hz; faster modes follow a force without vibration of their own
MODES = 9  # most that are looked for
WIDTH = 1e-6  # relative accuracy of frequencies


class ModesAlong(NamedTuple):
    """Reduced models of a boom at k postures, m shapes, n joints.

    Attributes
    ----------
    damping, stiffness : ndarray, shape (k, m, m)
    forces : ndarray, shape (k, m, n)
        Of the cylinders per unit of q.
    tip : ndarray, shape (k, m, 3)
        Motion of the tip: x, y, angle.
    joints : ndarray, shape (k, m, n)
        Joint angles.
    follow : ndarray, shape (k, n, 2)
        Joint angles by all faster modes, which follow a force at once, rad/N.
    slopes : ndarray, shape (k, n)
        Change of stroke with joint angle, m.
    heading : ndarray, shape (k,)
        Angle of the tip, rad.
    """

    damping: Array
    stiffness: Array
    forces: Array
    tip: Array
    joints: Array
    follow: Array
    slopes: Array
    heading: Array


class PosturePath(NamedTuple):
    """Knots along a course: `strokes` and joint `angles` of the undeformed boom (k, n) there, m and rad.

    `places` (m,): where every instant of the course is among them, from 0 to k - 1.
    """

    strokes: Array
    angles: Array
    places: Array


def posture_path(scene: Scene, course: SessionCourse) -> PosturePath:
    """Return the knots of a course, `TRAVEL` apart at most; two at least."""
    travelled = _travelled(scene, course)
    moving = course.moving.max(axis=1) > 0.0
    held = travelled[~moving & np.append(moving[1:], True)]  # the last instants of holds: frequencies are to be exact there
    ends = [0.0]
    for at in (*held.tolist(), travelled[-1]):
        if at > ends[-1] + APART:
            ends.append(at)
    ends = ends if len(ends) > 1 else [0.0, APART]
    pieces = [np.linspace(a, b, 1 + math.ceil((b - a) / TRAVEL))[1:] for a, b in pairwise(ends)]
    knots = np.concatenate([[0.0], *pieces])
    strokes = course.strokes[np.minimum(np.searchsorted(travelled, knots), len(travelled) - 1)]
    angles = np.array([joint_angles_of_strokes(scene, at) for at in strokes])
    return PosturePath(strokes, angles, np.interp(travelled, knots, np.arange(float(len(knots)))))


def _travelled(scene: Scene, course: SessionCourse) -> Array:
    """Return the angle travelled up to every instant of a course, rad; a step adds the rotation of the quickest section."""
    rows = np.unique(np.append(np.arange(0, len(course.strokes), EVERY), len(course.strokes) - 1))
    turns = np.cumsum([joint_angles_of_strokes(scene, at) for at in course.strokes[rows]], axis=1)
    steps = np.abs(np.diff(turns, axis=0)).max(axis=1)
    return np.asarray(np.interp(np.arange(len(course.strokes)), rows, np.concatenate([[0.0], np.cumsum(steps)])))


class _Knot(NamedTuple):
    """Natural modes and kinematics of one posture.

    `joints` (m, n) are the joint rotations in the m modes, `still` (n, 2) those by a static force at the tip. `drives` (n,) are
    the drives' lengths, `slopes` (n,) the derivatives of strokes by angles, `heading` is the angle of the tip.
    """

    modes: tuple[Mode, ...]
    joints: Array
    still: Array
    drives: Array
    slopes: Array
    heading: float


def modes_along(scene: Scene, path: PosturePath) -> ModesAlong:
    """Return reduced models of a boom at the knots of a path, in as many modes as there are at all of them.

    Raises
    ------
    SolverError
        There are none.
    """
    plan = compile_scene(scene)
    knots = _knots(scene, plan, path)
    count, at = min(len(knot.modes) for knot in knots), plan.tables.tip
    if not count:
        raise SolverError(f"the boom has no natural frequency below {HIGHEST:g} Hz.")
    rows, before = [], None
    for knot in knots:
        modes, joints = knot.modes[:count], knot.joints[:count]
        motions, increments = (np.array([getattr(mode, name) for mode in modes]) for name in ("motion", "increments"))
        turn = np.eye(count)
        if before is not None:
            left, _, right = np.linalg.svd((before * plan.masses) @ motions.T)
            turn = left @ right
        before = turn @ motions
        damping, forces = _damping_and_forces(plan, turn @ increments, knot.drives)
        squares = np.array([2.0 * math.pi * mode.frequency for mode in modes]) ** 2
        follow = knot.still - joints.T @ (motions[:, at : at + 2] / squares[:, None])
        tip = before[:, at : at + 3]
        rows.append((damping, turn * squares @ turn.T, forces, tip, turn @ joints, follow, knot.slopes, knot.heading))
    return ModesAlong(*(np.array(each) for each in zip(*rows, strict=True)))


def _knots(scene: Scene, plan: Plan, path: PosturePath) -> list[_Knot]:
    state, work, found = plan.state(), plan.work(), []
    turns = partial(joint_increments, plan, state, work)
    for strokes, angles in zip(path.strokes, path.angles, strict=True):
        settle(plan, state, work, strokes, angles)
        modes = natural_modes(plan, state, work, MODES, WIDTH, 2.0 * math.pi * HIGHEST)
        joints = np.array([turns(mode.increments) for mode in modes])
        still = np.column_stack([turns(column) for column in increments_by_tip_force(plan, state, work).T])
        slopes = np.array([cylinder_length(plan.tables.linkages[i], angle)[1] for i, angle in enumerate(angles)])
        found.append(_Knot(modes, joints, still, state.drives[0].copy(), slopes, float(state.frames[-1, FRAME_ANGLE])))
    return found


def _damping_and_forces(plan: Plan, increments: Array, drives: Array) -> tuple[Array, Array]:
    """Return damping (m, m) and cylinder forces (m, n) in shapes with these increments, at drive lengths `drives`, m."""
    damping = np.zeros((len(increments), len(increments)))
    forces = increments[:, plan.tables.cylinders.z].copy()
    for i, (compliance, lag) in enumerate(zip(*plan.compliances_and_lags(drives), strict=True)):
        damping += lag * compliance * np.outer(forces[:, i], forces[:, i])
    for row, beam in enumerate(plan.tables.beams):
        q = increments[:, beam.z : beam.z + beam.bending]
        work = q @ plan.tables.stiffness[row, : beam.bending, : beam.bending] @ q.T
        if beam.axial:
            stretch = increments[:, beam.z + beam.bending]
            work = work + beam.axial_stiffness * np.outer(stretch, stretch)
        damping += beam.beta * work
    return damping, forces
