"""Response of a boom along a session's postures to a force at its tip, in the natural modes of the posture.

Deviations from the prediction move in the modes j of the present posture (coordinates q_j, unit modal mass):

    q_j'' + 2 zeta_j omega_j q_j' + omega_j^2 q_j = Phi_j^T f,

f (2), N: the force, Phi_j the mode's motion of the tip. Joint angles deviate by Theta_j q_j, the specific force at the tip by
Phi_j q_j'' and by the turn of the tip against gravity. Modes are made at knots along the strokes' travel and interpolated
between; a step of an oscillator with its force held is exact. Modes above `HIGHEST` follow the force at once.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..analysis.equilibrium import settle
from ..analysis.modal import Mode, damping_ratio, joint_increments, natural_modes
from ..compiler.compile import compile_scene
from ..estimation.sensor_model import specific_force
from ..kernels.tables import FRAME_ANGLE
from ..scene.kinematics import gravity_in_base, joint_angles_of_strokes
from ..scene.schema import Scene
from ..types import Array
from .sessions import SessionCourse

TRAVEL = 0.03  # m of the strokes, from one knot to the next
MODES = 8  # at most
HIGHEST = 15.0  # Hz; modes that are faster follow a force without vibration
WIDTH = 1e-3  # relative accuracy of frequencies
STEP = 0.01  # s, longest of the oscillators


class ModesAlong(NamedTuple):
    """The lowest m modes at k instants, of a boom with n joints.

    Attributes
    ----------
    omega, decay : ndarray, shape (k, m)
        Natural frequency, rad/s, and 2 zeta omega, 1/s.
    readings : ndarray, shape (k, m, n + 2)
        Of joint angles, rad, and of the specific force, m/s^2, by the turn of the tip against gravity; per unit of q.
    tip : ndarray, shape (k, m, 2)
        Motion of the tip per unit of q, 1/sqrt(kg).
    felt : ndarray, shape (k, m, 2)
        Specific force per unit of q'', along the axes of the IMU.
    """

    omega: Array
    decay: Array
    readings: Array
    tip: Array
    felt: Array


def modes_along(scene: Scene, course: SessionCourse, times: Array) -> ModesAlong:
    """Modes about the equilibria at the strokes of a course, at `times` (k,) in s after its start."""
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(course.strokes, axis=0)).max(axis=1))])
    knots = np.linspace(0.0, travelled[-1], 2 + int(travelled[-1] / TRAVEL))
    rows = np.minimum(np.searchsorted(travelled, knots), len(travelled) - 1)
    found = _at_postures(scene, course.strokes[rows])
    places = np.interp(np.interp(times, course.times, travelled), knots, np.arange(len(knots)))
    left = np.minimum(places.astype(int), len(knots) - 2)
    share = places - left

    def between(values: Array) -> Array:
        weight = share.reshape(-1, *(1,) * (values.ndim - 1))
        return np.asarray((1.0 - weight) * values[left] + weight * values[left + 1])

    return ModesAlong(*map(between, found))


def _at_postures(scene: Scene, strokes: Array) -> ModesAlong:
    """Modes at the equilibria of strokes (k, n), as many as there are at all of them; their signs follow the postures."""
    plan, gravity = compile_scene(scene), gravity_in_base(scene)
    state, work, tip = plan.state(), plan.work(), slice(plan.tables.tip, plan.tables.tip + 3)
    found: list[list[tuple[Mode, Array]]] = []
    angles = []
    for at in strokes:
        settle(plan, state, work, at, joint_angles_of_strokes(scene, at))
        angles.append(state.frames[-1, FRAME_ANGLE])
        modes = natural_modes(plan, state, work, MODES, WIDTH)
        before = [mode.motion for mode, _ in found[-1]] if found else [mode.motion for mode in modes]
        modes = tuple(_alike(plan.masses, mode, old) for mode, old in zip(modes, before, strict=False))
        found.append([(mode, joint_increments(plan, state, work, mode)) for mode in modes])
    count = min(map(len, found))
    omega = np.array([[2.0 * math.pi * mode.frequency for mode, _ in row[:count]] for row in found])
    decay = np.array([[2.0 * damping_ratio(plan, mode) for mode, _ in row[:count]] for row in found]) * omega
    joints = np.array([[turns for _, turns in row[:count]] for row in found])
    swing = np.array([[mode.motion[tip] for mode, _ in row[:count]] for row in found])
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    felt = np.stack(specific_force(swing[..., 0], swing[..., 1], c, s), axis=-1)
    along_x, along_z = specific_force(-gravity[0], -gravity[1], c, s)
    turned = np.stack([along_z * swing[..., 2], -along_x * swing[..., 2]], axis=-1)
    return ModesAlong(omega, decay, np.concatenate([joints, turned], axis=2), swing[..., :2], felt)


def _alike(masses: Array, mode: Mode, before: Array) -> Mode:
    """The mode, turned round if it moves against the one `before`."""
    if float((masses * mode.motion) @ before) >= 0.0:
        return mode
    return Mode(mode.frequency, -mode.increments, -mode.motion)


def response(modes: ModesAlong, length: float, pieces: int) -> Array:
    """Means over blocks of `length` (s) of what forces held for a block each do.

    The force of the first block has acted for ever. Behind them stand free vibrations from the start on, for every mode one
    of position and one of rate, as large as a force of 1 N held, and let go, makes them.

    Parameters
    ----------
    modes : ModesAlong
        At the middles of `pieces` equal steps of every block.

    Returns
    -------
    ndarray, shape (2 b + 2 m, b, n + 2)
        By forces of 1 N along x and y of the first block, the second, ..; then by free vibrations.
    """
    steps, count = modes.omega.shape
    blocks, h = steps // pieces, length / pieces
    a11, a12, a21, a22 = _oscillate(modes.omega, modes.decay, h)
    quick = modes.omega > 2.0 * math.pi * HIGHEST
    a11[quick] = a12[quick] = a21[quick] = a22[quick] = 0.0
    inertial = np.where(quick, 0.0, 1.0)
    g1, g2 = (1.0 - a11) / modes.omega**2, -a21 / modes.omega**2
    columns = 2 * blocks + 2 * count
    q, rate = np.zeros((2, count, columns))
    q[:, :2] = modes.tip[0] / modes.omega[0, :, None] ** 2
    size = np.linalg.norm(modes.tip[0], axis=1) / modes.omega[0] ** 2
    q[:, 2 * blocks : 2 * blocks + count] = np.diag(size)
    rate[:, 2 * blocks + count :] = np.diag(size * modes.omega[0])
    found = np.zeros((blocks, modes.readings.shape[2], columns))
    imu = slice(found.shape[1] - 2, None)
    for t in range(steps):
        b, tip = t // pieces, modes.tip[t]
        own = slice(2 * b, 2 * b + 2)
        q, rate = a11[t, :, None] * q + a12[t, :, None] * rate, a21[t, :, None] * q + a22[t, :, None] * rate
        q[:, own] += g1[t, :, None] * tip
        rate[:, own] += g2[t, :, None] * tip
        accelerated = -modes.decay[t, :, None] * rate - modes.omega[t, :, None] ** 2 * q
        accelerated[:, own] += tip
        accelerated *= inertial[t, :, None]
        found[b] += modes.readings[t].T @ q / pieces
        found[b, imu] += modes.felt[t].T @ accelerated / pieces
    return np.ascontiguousarray(np.moveaxis(found, 2, 0))


def _oscillate(omega: Array, decay: Array, h: float) -> tuple[Array, Array, Array, Array]:
    """As `boom_twin.estimation.tip_estimate.oscillate`, of arrays."""
    half = 0.5 * decay
    wave = np.sqrt(omega**2 - half**2 + 0j)
    c, s, e = np.cos(wave * h).real, (np.sin(wave * h) / wave).real, np.exp(-half * h)
    return e * (c + half * s), e * s, -(omega**2) * e * s, e * (c - half * s)
