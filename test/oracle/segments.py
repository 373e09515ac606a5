"""Statics of the finite-segment boom of `reference.segments`: forces, small vibrations, extrapolation."""

from __future__ import annotations

import math

import numpy as np
from reference.segments.boom import Segments
from reference.segments.equilibrium import energy, equilibrium
from reference.segments.geometry import oil_stiffness
from scipy.linalg import eigh, null_space

from boom_twin import SolverError


def mass_matrix(boom):
    """Of all coordinates."""
    rows = [math.sqrt(m.mass) * axis.g for m in boom.masses for axis in (m.x, m.y)]
    rows += [math.sqrt(m.inertia) * m.turn.g for m in boom.masses]
    jacobian = np.array(rows).reshape(-1, len(boom.tip[0].g))
    return jacobian.T @ jacobian


def frequencies(model, boom, hessian, count=6):
    """Lowest natural frequencies (Hz) within the constraints, if the equilibrium is stable."""
    _, constraints = energy(model, boom, np.array([length.v for length in boom.lengths]))
    free = null_space(np.array([c.g for c in constraints])) if constraints else np.eye(len(hessian))
    if free.shape[1] == 0:
        return np.zeros(0)
    values = eigh(free.T @ hessian @ free, free.T @ mass_matrix(boom) @ free, eigvals_only=True)
    if values[0] <= 0.0:
        raise SolverError("the equilibrium of the finite-segment boom is not stable.")
    return np.sqrt(values[:count]) / (2.0 * math.pi)


def statics(scene, fineness, drive, angles, modes=6):
    """Tip (2,), joints (n,), cylinder forces (n,) and frequencies (<= modes,) in one row."""
    model = Segments(scene, fineness)
    _, boom, multipliers, hessian = equilibrium(model, drive, angles)
    tip, joints = [boom.tip[0].v, boom.tip[1].v], [joint.v for joint in boom.joints]
    forces = cylinder_forces(scene, boom, drive, multipliers[len(boom.closures) :])
    return np.concatenate([tip, joints, forces, frequencies(model, boom, hessian, modes)])


def cylinder_forces(scene, boom, drive, multipliers):
    """Tension between barrel and rod (N), shape (n,): of the spring, or the multiplier of a rigid cylinder."""
    rigid = iter(multipliers)
    return np.array(
        [
            oil_stiffness(joint.cylinder, reference) * (length.v - reference) if joint.cylinder.is_compressible else next(rigid)
            for joint, length, reference in zip(scene.joints, boom.lengths, drive, strict=True)
        ]
    )


def extrapolated(scene, drive, angles, coarse=2, modes=6):
    """`statics` with Richardson extrapolation from `coarse` and twice that."""
    a, b = (statics(scene, fineness, drive, angles, modes) for fineness in (coarse, 2 * coarse))
    return b + (b - a) / 3.0
