"""Dense frequency response, all unknowns in one complex solve: of the finite-segment boom, and of the model's own equations."""

from __future__ import annotations

import numpy as np
from kernels.dense import Dense, slopes
from oracle import segments
from reference.segments.geometry import oil_stiffness

from boom_twin.kernels.elements.cylinder import compliance_and_lag
from boom_twin.kernels.tables import Motion


class SegmentResponse:
    """The finite-segment boom linearised at rest: Hessian of its energy, matrices of mass and damping."""

    def __init__(self, scene, fineness, angles):
        self.scene, model = scene, segments.Segments(scene, fineness)
        drive = segments.Segments(scene, 0).lengths(angles)
        _, boom, _, self.stiffness = segments.equilibrium(model, drive, angles)
        n = len(self.stiffness)
        self.closures, self.lengths = np.array([c.g for c in boom.closures]).reshape(-1, n), [c.g for c in boom.lengths]
        self.rigid = [i for i, joint in enumerate(scene.joints) if not joint.cylinder.is_compressible]
        self.k = np.array([oil_stiffness(joint.cylinder, at) for joint, at in zip(scene.joints, drive, strict=True)])
        beyond = np.array([oil_stiffness(joint.cylinder, at + 1e-6) for joint, at in zip(scene.joints, drive, strict=True)])
        stretch = np.array([length.v for length in boom.lengths]) - drive
        self.by_drive = self.k - (beyond - self.k) / 1e-6 * stretch  # of k(s) (l - s)
        self.constraints = np.vstack([self.closures, *(self.lengths[i] for i in self.rigid)])
        self.mass, self.damping = segments.mass_matrix(boom), np.zeros((n, n))
        for _, d, elongation in boom.springs:
            self.damping += d * np.outer(elongation.g, elongation.g)
        for joint, length in zip(scene.joints, self.lengths, strict=True):
            self.damping += (joint.cylinder.d or 0.0) * np.outer(length, length)
        self.tip, self.joints = np.array([boom.tip[0].g, boom.tip[1].g]), np.array([joint.g for joint in boom.joints])

    def rows(self, frequencies, load):
        """Amplitudes (k, 2 + n + n) of tip, joints, cylinder forces under a `load` (2 + n,): force at the tip, drives."""
        return np.array([self._row(2j * np.pi * f, np.asarray(load)) for f in frequencies])

    def _row(self, s, load):
        n, g, dampers = len(self.stiffness), self.constraints, [joint.cylinder.d or 0.0 for joint in self.scene.joints]
        right = np.zeros(n + len(g), complex)
        right[:n] = load[:2] @ self.tip
        for i, (d, moved) in enumerate(zip(dampers, load[2:], strict=True)):
            if i in self.rigid:
                right[n + len(self.closures) + self.rigid.index(i)] = moved
            else:
                right[:n] += (self.by_drive[i] + s * d) * moved * self.lengths[i]
        matrix = np.block([[self.stiffness + s * self.damping + s**2 * self.mass, g.T], [g, np.zeros((len(g),) * 2)]])
        found = np.linalg.solve(matrix, right)
        q, multiplier = found[:n], iter(found[n + len(self.closures) :])
        forces = [
            next(multiplier) if i in self.rigid else (self.k[i] + s * d) * (length @ q) - (self.by_drive[i] + s * d) * moved
            for i, (d, length, moved) in enumerate(zip(dampers, self.lengths, load[2:], strict=True))
        ]
        return np.concatenate([self.tip @ q, self.joints @ q, forces])


def extrapolated(scene, angles, frequencies, load, coarse=2):
    """`SegmentResponse.rows` with Richardson extrapolation from `coarse` and twice that."""
    a, b = (SegmentResponse(scene, fineness, angles).rows(frequencies, load) for fineness in (coarse, 2 * coarse))
    return b + (b - a) / 3.0


class DenseModel:
    """The model's equations without any condensing (`kernels.dense`), linearised at rest: K, D, M of all unknowns."""

    GAIN, RATE = 1e4, 1e2  # 1/s^2, 1/s; about those of the highest frequency

    def __init__(self, plan, z, drive):
        self.plan, still, at_rest = plan, np.zeros(plan.joints), Motion(0.0, 0.0, *np.zeros((2, len(plan.masses))))
        rows = plan.tables.cylinders
        self.lags = np.array([compliance_and_lag(row, plan.tables.oils, at)[1] for row, at in zip(rows, drive, strict=True)])

        def of_drive(drives):
            return np.asarray(Dense(plan, at_rest, drives, still).residual(z), float)

        steps = 1e-6 * np.eye(plan.joints)
        self.by_drive = np.array([(of_drive(drive - h) - of_drive(drive + h)) / 2e-6 for h in steps])
        dense = Dense(plan, Motion(0.0, 0.0, np.zeros(len(plan.masses)), np.zeros(len(plan.masses))), drive, still)
        position = dense.positions(z)[: len(plan.masses)].copy()

        def tangent(gain, rate):
            dense.motion = Motion(gain, rate, position, -rate * position)
            return np.array(list(slopes(dense.residual, z))).T

        self.stiffness = tangent(0.0, 0.0)
        self.mass = (tangent(self.GAIN, 0.0) - self.stiffness) / self.GAIN
        self.damping = (tangent(0.0, self.RATE) - self.stiffness) / self.RATE
        self.tip = np.array(list(slopes(dense.positions, z))).T[plan.tables.tip : plan.tables.tip + 2]

    def unknowns(self, frequencies, load):
        """Amplitudes (k, unknowns) under a `load` (2 + n,): force at the tip, drives."""
        cylinders, found, load = self.plan.tables.cylinders, [], np.asarray(load)
        for s in 2j * np.pi * np.asarray(frequencies):
            right = self.tip.T.astype(complex) @ load[:2]
            right += load[2:] @ self.by_drive
            right[cylinders.z] += self.lags * s * load[2:]
            found.append(np.linalg.solve(self.stiffness + s * self.damping + s**2 * self.mass, right))
        return np.array(found)
