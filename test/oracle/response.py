"""Frequency response of the finite-segment boom: all unknowns in one complex solve."""

from __future__ import annotations

import numpy as np
from oracle import segments
from reference.segments.geometry import oil_stiffness


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
