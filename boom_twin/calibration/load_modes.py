"""Reduced model of a boom's small motions along a session, in the lowest natural modes of its postures.

Deviations from the prediction are u = Psi q, with the modes Psi of the present posture (unit modal mass) as shapes:

    q'' + D q' + K q = Phi^T f + N d

f (2), N: force at the tip; d (n), m: what the strokes are longer by; Phi, N: the shapes' motion of the tip and forces of the
cylinders.

Modes are made at knots along the strokes' travel. Those of a knot are turned into the ones of the knot before by the rotation
that is nearest in the sense of the masses, so that no coupling by the change of shapes is left, crossing modes do no harm, and
all matrices may be interpolated between knots.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.equilibrium import settle
from ..analysis.modal import Mode, joint_increments, natural_modes
from ..compiler.compile import compile_scene
from ..compiler.plan import Plan
from ..kernels.elements.linkage import cylinder_length
from ..kernels.tables import FRAME_ANGLE
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.schema import Scene
from ..types import Array
from .sessions import SessionCourse

TRAVEL, PIECES = 0.05, 4  # rad that a section turns from one knot to the next, and interpolated postures for each knot
EVERY = 20  # instants, at which the turns are looked at
HIGHEST = 25.0  # Hz; faster modes follow a force without vibration of their own
MODES = 9  # most that are looked for, of both kinds
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
        Joint angles by modes that follow a force at once, rad/N.
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


def modes_along(scene: Scene, course: SessionCourse) -> tuple[ModesAlong, NDArray[np.int64]]:
    """Models of a boom, and for every instant of `course` (m,) the posture's number."""
    travelled = _travelled(scene, course)
    moving = course.moving.max(axis=1) > 0.0
    knots = np.linspace(0.0, travelled[-1], 2 + int(travelled[-1] / TRAVEL))
    held = travelled[~moving & np.append(moving[1:], True)]  # the last instants of holds: frequencies are to be exact there
    knots = np.unique(np.concatenate([knots, held]))
    rows = np.minimum(np.searchsorted(travelled, knots), len(travelled) - 1)
    found = _at_knots(scene, course.strokes[rows])
    every = np.linspace(0.0, len(knots) - 1.0, 1 + PIECES * (len(knots) - 1))
    left = np.minimum(every.astype(int), len(knots) - 2)
    share = every - left

    def between(values: Array) -> Array:
        weight = share.reshape(-1, *(1,) * (values.ndim - 1))
        return np.asarray((1.0 - weight) * values[left] + weight * values[left + 1])

    places = np.rint(PIECES * np.interp(travelled, knots, np.arange(len(knots)))).astype(np.int64)
    return ModesAlong(*map(between, found)), places


def _travelled(scene: Scene, course: SessionCourse) -> Array:
    """By how much sections have turned so far at every instant of a course, rad: of each step that of the quickest section."""
    rows = np.unique(np.append(np.arange(0, len(course.strokes), EVERY), len(course.strokes) - 1))
    turns = np.cumsum([joint_angles_of_strokes(scene, at) for at in course.strokes[rows]], axis=1)
    steps = np.abs(np.diff(turns, axis=0)).max(axis=1)
    return np.asarray(np.interp(np.arange(len(course.strokes)), rows, np.concatenate([[0.0], np.cumsum(steps)])))


class _Knot(NamedTuple):
    """A posture: m modes with their turns of the joints (m, n), slopes (n,) of strokes by angles, angle of the tip."""

    modes: tuple[Mode, ...]
    joints: Array
    slopes: Array
    heading: float


def _at_knots(scene: Scene, strokes: Array) -> ModesAlong:
    """The models at strokes (k, n), in as many modes as there are at all of them."""
    plan = compile_scene(scene)
    knots = _knots(scene, plan, strokes)
    count, at = min(sum(mode.frequency < HIGHEST for mode in knot.modes) for knot in knots), plan.tables.tip
    rows, before = [], None
    for knot in knots:
        modes = knot.modes[:count]
        motions, increments = (np.array([getattr(mode, name) for mode in modes]) for name in ("motion", "increments"))
        turn = np.eye(count)
        if before is not None:
            left, _, right = np.linalg.svd((before * plan.masses) @ motions.T)
            turn = left @ right
        before = turn @ motions
        damping, forces = _damping_and_forces(plan, turn @ increments, modes[0].drives)
        stiffness = turn * np.array([2.0 * math.pi * mode.frequency for mode in modes]) ** 2 @ turn.T
        tip = before[:, at : at + 3]
        quick = np.array([mode.motion[at : at + 2] / (2.0 * math.pi * mode.frequency) ** 2 for mode in knot.modes[count:]])
        follow = knot.joints[count:].T @ quick.reshape(-1, 2)
        rows.append((damping, stiffness, forces, tip, turn @ knot.joints[:count], follow, knot.slopes, knot.heading))
    return ModesAlong(*(np.array(each) for each in zip(*rows, strict=True)))


def _knots(scene: Scene, plan: Plan, strokes: Array) -> list[_Knot]:
    state, work, found = plan.state(), plan.work(), []
    for at in strokes:
        angles = joint_angles_of_strokes(scene, at)
        settle(plan, state, work, at, angles)
        modes = natural_modes(plan, state, work, MODES, WIDTH)
        joints = np.array([joint_increments(plan, state, work, mode) for mode in modes])
        slopes = np.array([cylinder_length(plan.tables.linkages[i], angle)[1] for i, angle in enumerate(angles)])
        found.append(_Knot(modes, joints, slopes, float(state.frames[-1, FRAME_ANGLE])))
    return found


def _damping_and_forces(plan: Plan, increments: Array, drives: Array) -> tuple[Array, Array]:
    """Damping (m, m) and forces of the cylinders (m, n) in shapes with these increments; drives are as long as `drives`, m."""
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
