"""Dense frequency response, all unknowns in one complex solve: of the finite-segment boom, and of the model's own equations."""

from __future__ import annotations

import numpy as np
from kernels.dense import Dense, slopes
from oracle import segments

from boom_twin.kernels.tables import Motion


def of_segments(scene, fineness, drive_lengths, angles, frequencies, force=None, cylinder=None):
    """Amplitudes (k, 2 + n + n) of tip x, y, joints and cylinder forces: energy's Hessian, mass and damping matrices.

    The load is a `force` (2,) at the tip in N, or 1 m of the drive of `cylinder` (0-based).
    """
    model = segments.Segments(scene, fineness)
    _, boom, _, stiffness = segments.equilibrium(model, drive_lengths, angles)
    n = len(stiffness)
    closures = np.array([c.g for c in boom.closures]).reshape(-1, n)
    rigid = [i for i, joint in enumerate(scene.joints) if joint.cylinder.k is None]
    g = np.vstack([closures, *(boom.lengths[i].g for i in rigid)])
    mass, damping = segments.mass_matrix(boom), np.zeros((n, n))
    for _, d, elongation in boom.springs:
        damping += d * np.outer(elongation.g, elongation.g)
    for joint, length in zip(scene.joints, boom.lengths, strict=True):
        damping += (joint.cylinder.d or 0.0) * np.outer(length.g, length.g)
    tip, joints = np.array([boom.tip[0].g, boom.tip[1].g]), np.array([joint.g for joint in boom.joints])
    rows = []
    for f in frequencies:
        s, moved = 2j * np.pi * f, np.zeros(len(scene.joints))
        right = np.zeros(n + len(g), complex)
        if force is not None:
            right[:n] = np.asarray(force) @ tip
        else:
            moved[cylinder] = 1.0
            law = scene.joints[cylinder].cylinder
            if law.k is None:
                right[n + len(closures) + rigid.index(cylinder)] = 1.0
            else:
                right[:n] = (law.k + s * (law.d or 0.0)) * boom.lengths[cylinder].g
        matrix = np.block([[stiffness + s * damping + s**2 * mass, g.T], [g, np.zeros((len(g),) * 2)]])
        found = np.linalg.solve(matrix, right)
        q, multiplier = found[:n], iter(found[n + len(closures) :])
        forces = [
            next(multiplier) if joint.cylinder.k is None
            else (joint.cylinder.k + s * (joint.cylinder.d or 0.0)) * (length.g @ q - shift)
            for joint, length, shift in zip(scene.joints, boom.lengths, moved, strict=True)
        ]  # fmt: skip
        rows.append(np.concatenate([tip @ q, joints @ q, forces]))
    return np.array(rows)


class DenseModel:
    """The model's equations without any condensing (`kernels.dense`), linearised at rest: K, D, M of all unknowns."""

    GAIN, RATE = 1e4, 1e2  # 1/s^2, 1/s; about those of the highest frequency

    def __init__(self, plan, state, position, drive):
        still, self.plan = np.zeros(plan.joints), plan
        z = state.z.copy()

        def tangent(gain, rate):
            dense = Dense(plan, Motion(gain, rate, position, -rate * position), drive, still)
            return np.array(list(slopes(dense.residual, z))).T

        self.stiffness = tangent(0.0, 0.0)
        self.mass = (tangent(self.GAIN, 0.0) - self.stiffness) / self.GAIN
        self.damping = (tangent(0.0, self.RATE) - self.stiffness) / self.RATE
        dense = Dense(plan, Motion(0.0, 0.0, position, 0.0 * position), drive, still)
        self.tip = np.array(list(slopes(dense.positions, z))).T[plan.tables.tip : plan.tables.tip + 2]

    def unknowns(self, frequencies, load):
        """Amplitudes (k, unknowns) under a `load` (2 + n,): force at the tip, drives."""
        t, found = self.plan.tables, []
        for f in frequencies:
            s = 2j * np.pi * f
            right = self.tip.T @ load[:2]
            right[t.cylinders.z] += (1.0 + t.cylinders.lag * s) * load[2:]
            found.append(np.linalg.solve(self.stiffness + s * self.damping + s**2 * self.mass, right))
        return np.array(found)
