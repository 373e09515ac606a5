"""Transfer matrices of the elements in the papers' state vector Z = [x, y, theta, M, qx, qy, 1], of one time step.

Every element is written as the map from its input to its output vector that the papers' signs ask for: a massless hinge passes
q unchanged, m a = q_I - q_O + m g, with accelerations a = A (r - r_hat) and velocities C r + D of the step's scheme. Its
transfer matrix is the derivative of that map, by complex steps exact to rounding (Squire and Trapp, SIAM Review 40, 1998),
with a last column that makes it exact at the vector it was taken at. Nothing here knows of the sweeps, which `substructures`
compares with it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from boom_twin.kernels.elements.cylinder import compliance_and_lag
from boom_twin.kernels.tables import Motion, Tables

Complex = NDArray[np.complex128]
Vector = Any  # of floats, or complex while a map is differentiated
X, Y, THETA, M, QX, QY = range(6)
TINY = 1e-40  # of a complex step: no difference is taken, so nothing cancels


class Step(NamedTuple):
    """A time step about a state: the boom's tables, the scheme's weights and history, lengths and rates of the drives."""

    tables: Tables
    motion: Motion
    drive: np.ndarray
    drive_rate: np.ndarray


def jacobian(function: Callable[[Vector], Vector], at: np.ndarray) -> np.ndarray:
    """Derivatives (k, n) of an analytic map at a point (n,)."""
    columns = []
    for i in range(len(at)):
        shifted = at.astype(complex)
        shifted[i] += 1j * TINY
        columns.append(np.imag(np.asarray(function(shifted))) / TINY)
    return np.stack(columns, axis=1)


def affine(function: Callable[[Vector], Vector], at: np.ndarray) -> np.ndarray:
    """Transfer matrix (7, 7) of a map between state vectors of six entries, the seventh being 1."""
    u, found = jacobian(function, at), np.eye(7)
    found[:6, :6], found[:6, 6] = u, np.real(function(at.astype(complex))) - u @ at
    return found


def condensed(function: Callable[[Vector, Vector], tuple[Vector, Vector]], at: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Transfer matrix (7, 7) of a map with inner unknowns: (Z_I, u) -> (Z_O, residual), the residual being zero.

    Z_O = o + o_Z dZ + o_u du,  0 = r + r_Z dZ + r_u du.
    """
    count = len(at)
    both = np.concatenate([at, inner])
    outs = np.concatenate([np.real(part) for part in function(at.astype(complex), inner.astype(complex))])
    whole = jacobian(lambda z: np.concatenate(function(z[:count], z[count:])), both)
    o_z, o_u, r_z, r_u = whole[:6, :count], whole[:6, count:], whole[6:, :count], whole[6:, count:]
    gains = np.linalg.solve(r_u, np.column_stack([r_z, outs[6:]]))
    u, found = o_z - o_u @ gains[:, :count], np.eye(7)
    found[:6, :6], found[:6, 6] = u, outs[:6] - o_u @ gains[:, count] - u @ at
    return found


def turned(angle: Any, point: Any) -> Vector:
    """Body vector `point` turned by `angle` (rad)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])


def cross(a: Any, b: Any) -> Any:
    """Moment of a force b at a lever a."""
    return a[0] * b[1] - a[1] * b[0]


def offset(z: Vector, point: Any) -> Vector:
    """Rigid, massless: output at body vector `point` (m)."""
    lever = turned(z[THETA], point)
    return np.array([z[X] + lever[0], z[Y] + lever[1], z[THETA], z[M] - cross(lever, z[QX:]), z[QX], z[QY]])


def give(z: Vector, point: Any, force: Any, torque: Any = 0.0) -> Vector:
    """A second output at body vector `point`, which takes `force` (N) and `torque` (N m) away."""
    lever = turned(z[THETA], point)
    return np.array([*z[:3], z[M] - cross(lever, force) - torque, z[QX] - force[0], z[QY] - force[1]])


def body(step: Step, z: Vector, mass: float, inertia: float, centre: Any, at: int) -> Vector:
    """A mass with its centre at body vector `centre`; `at`: place of its histories."""
    gain, hat = step.motion.gain, step.motion.hat
    lever = turned(z[THETA], centre)
    place = np.array([z[X] + lever[0], z[Y] + lever[1]])
    inertial = mass * (gain * (place - hat[at : at + 2]) - step.tables.gravity)
    return give(z, centre, inertial, inertia * gain * (z[THETA] - hat[at + 2]))


def cylinder(step: Step, index: int, z: Vector) -> Vector:
    """Barrel, drive with oil spring and damper, rod: from pin C at the angle z[2] to pin R.

    The prismatic element's length l follows from the force that it transmits, which pushes outwards with e.q:
    -e.q = N = k (l - l_ref) + d (C l + D - l_ref').
    """
    t, motion = step.tables, step.motion
    row = t.cylinders[index]
    parts = [t.parts[k] for k in range(row.first_part, row.first_part + row.parts)]
    for part in (part for part in parts if part.end == 0):
        z = body(step, z, part.mass, part.inertia, (part.com, 0.0), part.history)
    axis = turned(z[THETA], (1.0, 0.0))
    force = -(axis[0] * z[QX] + axis[1] * z[QY])
    still = motion.offset[row.history] - step.drive_rate[index]
    compliance, lag = compliance_and_lag(row, t.oils, step.drive[index])
    length = (compliance * force + step.drive[index] - lag * still) / (1.0 + lag * motion.rate)
    z = offset(z, (length, 0.0))
    for part in (part for part in parts if part.end == 1):
        z = body(step, z, part.mass, part.inertia, (-part.com, 0.0), part.history)
    return z


def beam(step: Step, row: int, z: Vector, q: Vector) -> tuple[Vector, Vector]:
    """Euler-Bernoulli beam in a frame at its input: output vector, and residual of its modal equations.

    The state vectors of the papers' flexible bodies carry q beside the rest; here it is eliminated inside the element, so that
    their rigid-to-flexible and flexible-to-rigid hinges need no matrices.
    """
    t, motion = step.tables, step.motion
    part = t.beams[row]
    n, points = int(part.bending), int(part.points)
    psi, weights = t.psi[row, : points + 1, :n], t.weights[row, : points + 1, :points]
    stretch = 1.0 + q[n] if part.axial else 1.0
    angles = psi @ q[:n]
    if part.finite:
        c, s = np.cos(angles[:points]), np.sin(angles[:points])
        dc, ds = -s, c
    else:
        c, s, dc, ds = np.ones(points), angles[:points], np.zeros(points), np.ones(points)
    rho = stretch * np.stack([weights @ c, weights @ s], axis=1)
    shapes = psi[:points]
    slopes = stretch * np.stack([weights @ (dc[:, None] * shapes), weights @ (ds[:, None] * shapes)], axis=2)
    if part.axial:
        slopes = np.concatenate([slopes, np.stack([weights @ c, weights @ s], axis=1)[:, None, :]], axis=1)
        psi = np.column_stack([psi, np.zeros(points + 1)])
    spin = np.array([[np.cos(z[THETA]), np.sin(z[THETA])], [-np.sin(z[THETA]), np.cos(z[THETA])]])  # row vectors
    places, slopes = rho @ spin, slopes @ spin
    at = part.history + 2 * np.arange(points)
    hat = np.stack([motion.hat[at], motion.hat[at + 1]], axis=1)
    inertial = t.point_mass[row, :points, None] * (motion.gain * (places[:points] + z[:2] - hat) - t.gravity)
    twist = np.zeros(points, complex)
    if part.rotary:
        twist = (
            t.point_rotary[row, :points]
            * motion.gain
            * (z[THETA] + angles[:points] - motion.hat[part.history + 2 * points + np.arange(points)])
        )
    out = np.array([z[X] + places[-1, 0], z[Y] + places[-1, 1], z[THETA] + angles[-1], 0.0, 0.0, 0.0], complex)
    out[QX:] = z[QX:] - inertial.sum(axis=0)
    levers = places[:points] - places[-1]
    out[M] = z[M] - cross(places[-1], z[QX:]) - np.sum(cross(levers.T, inertial.T)) - twist.sum()
    size = n + int(part.axial)
    rates = motion.rate * q + motion.offset[part.z : part.z + size]
    strained = q + part.beta * rates * (1.0 if part.damped else 0.0)
    elastic = np.concatenate([t.stiffness[row, :n, :n] @ strained[:n], part.axial_stiffness * strained[n:]])
    residual = elastic + np.einsum("pai,pi->a", slopes[:points], inertial) + twist @ psi[:points]
    return out, residual + slopes[-1] @ out[QX:] + psi[-1] * out[M]
