"""Equilibrium of the finite-segment reference boom, from its energy; forces, small vibrations, extrapolation there."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import eigh, null_space

from boom_twin import SolverError

from .boom import SegmentBoom, Segments
from .geometry import oil_stiffness
from .jets import Jet

PASSES = 60
SETTLED = 1e-11  # m and rad, largest increment
LONGEST = 0.1  # m and rad, in one pass


def energy(model: Segments, boom: SegmentBoom, drive: np.ndarray) -> tuple[Jet, list[Jet]]:
    """Potential energy (J), and the list of all constraints: closures first, then incompressible cylinders."""
    n = len(boom.tip[0].g)
    v, g, h = 0.0, np.zeros(n), np.zeros((n, n))
    terms = [-m.mass * (model.gravity[0] * m.x + model.gravity[1] * m.y) for m in boom.masses]
    terms += [0.5 * k * (e * e) for k, _, e in boom.springs]
    constraints = list(boom.closures)
    for joint, length, reference in zip(model.scene.joints, boom.lengths, drive, strict=True):
        stretch = length - float(reference)
        if joint.cylinder.is_compressible:
            terms.append(0.5 * oil_stiffness(joint.cylinder, float(reference)) * (stretch * stretch))
        else:
            constraints.append(stretch)
    for term in terms:
        v, g, h = v + term.v, g + term.g, h + term.h
    return Jet(v, g, h), constraints


def equilibrium(
    model: Segments, drive: np.ndarray, angles: np.ndarray
) -> tuple[np.ndarray, SegmentBoom, np.ndarray, np.ndarray]:
    """Newton's method on the energy, from the undeformed boom at relative joint `angles` (rad); SolverError if it fails.

    Coordinates, boom, multipliers of the constraints, Hessian of the Lagrangian.
    """
    q, multipliers = model.start(angles), None
    for iteration in range(PASSES):
        boom = model.place(q)
        potential, constraints = energy(model, boom, drive)
        jacobian = np.array([c.g for c in constraints]).reshape(-1, len(q))
        if multipliers is None:
            multipliers = np.zeros(len(constraints))
        hessian = potential.h.copy()
        for multiplier, constraint in zip(multipliers, constraints, strict=True):
            hessian += multiplier * constraint.h
        matrix = np.block([[hessian, jacobian.T], [jacobian, np.zeros((len(constraints),) * 2)]])
        right = np.concatenate([potential.g, [c.v for c in constraints]])
        step = np.linalg.solve(matrix, -right)
        dq = step[: len(q)]
        size = float(np.abs(dq).max(initial=0.0))
        if size < SETTLED and iteration > 0:  # the first pass finds the multipliers of a boom that cannot move
            return q, boom, multipliers, hessian
        share = LONGEST / max(size, LONGEST)
        q = q + share * dq
        multipliers = step[len(q) :] if share == 1.0 else multipliers + share * (step[len(q) :] - multipliers)
    raise SolverError("the finite-segment boom found no equilibrium. Check masses and stiffnesses, or take another posture.")


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
