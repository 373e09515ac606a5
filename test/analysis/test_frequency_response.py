"""Frequency response against finite segments, natural frequencies, statics and reciprocity."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import posture_angles, strokes_of_posture
from oracle import booms
from oracle.clearance.scenes import RODS, with_pins
from reference.segments import equilibrium as segments
from reference.segments.geometry import oil_stiffness
from scipy.optimize import brentq

from boom_twin import UsageError, frequency_response, load_scene, statics
from boom_twin.analysis.frequency_response import linearised_boom, with_all_shapes


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


BAND = np.geomspace(0.05, 30.0, 40)  # Hz
FORCES = ([1.0, 0.0], [0.0, 1.0])


def apart(found, expected):
    """Largest distance of rows, over the rows' size."""
    return np.max(np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1))


@pytest.mark.parametrize("modes, stiffness", [(1, None), (3, None), (3, 5.0e6)])
def test_tip_force_against_finite_segments(modes, stiffness):
    """An independent model, by energy: 0.05 % up to 30 Hz, however few shapes the scene has for its time steps."""
    scene = booms.on_elastic_base(load_scene().model_copy(update={"modes": modes}), stiffness)
    load = np.array([0.6, 0.8, 0.0, 0.0, 0.0, 0.0])
    expected = extrapolated(scene, posture_angles(scene, "arch"), BAND, load)
    found = frequency_response(scene, BAND, posture="arch", tip_force=(0.6, 0.8))
    for own, other in (
        (found.tip, expected[:, :2]),
        (found.joints, expected[:, 2:6]),
        (found.cylinder_forces, expected[:, 6:]),
    ):
        assert apart(own, other) < 5e-4


@pytest.mark.parametrize("seed", [2, 31])
def test_drive_against_finite_segments(seed):
    """Of a cylinder with oil, whose stiffness the drive changes, too; of a boom with a rigid section and a rigid cylinder."""
    scene = booms.random_boom(seed)
    n = len(scene.joints)
    load = np.eye(2 + n)[2 + n // 2]
    expected = extrapolated(scene, posture_angles(scene, "test"), BAND, load)
    found = frequency_response(scene, BAND, posture="test", drive=1 + n // 2)
    assert apart(found.tip, expected[:, :2]) < 1e-3
    assert apart(found.joints, expected[:, 2 : 2 + n]) < 1e-3


@pytest.mark.parametrize("scene, posture", [(booms.scene_of(booms.undamped()), p) for p in ("arch", "horizontal")])
def test_poles_are_the_natural_frequencies(scene, posture):
    boom = linearised_boom(scene, posture=posture)
    for natural in statics(with_all_shapes(scene), posture=posture).frequencies:
        gain = [lambda f, load=load: 1.0 / boom.respond(np.array([f]), load).tip[0].real.sum() for load in np.eye(6)[:2]]
        around = natural * np.array([1.0 - 1e-4, 1.0 + 1e-4])
        passing = next(g for g in gain if g(around[0]) * g(around[1]) < 0.0)
        assert brentq(passing, *around, xtol=1e-12) == pytest.approx(natural, rel=1e-8)


def test_a_boom_with_play_in_its_pins_is_refused():
    with pytest.raises(UsageError, match=r"clearance.pins = cylinder_1.rod, .* or simulate"):
        frequency_response(with_pins(booms.document(), RODS, 1e-4), BAND, posture="arch")


def richardson(of, size):
    """Derivative at 0 of a function, from central differences over `size`, half and a quarter of it."""
    d = [(of(h) - of(-h)) / (2.0 * h) for h in (size, size / 2.0, size / 4.0)]
    a, b = d[1] + (d[1] - d[0]) / 3.0, d[2] + (d[2] - d[1]) / 3.0
    return b + (b - a) / 15.0


def test_static_limit_is_that_of_statics():
    """A little more payload; a little more of every stroke."""
    spec = booms.document() | {"tip": {"payload": 40.0}}
    scene, strokes = booms.scene_of(spec), strokes_of_posture(booms.scene_of(spec), "arch")

    def loaded(more):
        rest = statics(booms.scene_of(spec | {"tip": {"payload": 40.0 + more}}), strokes=strokes, modes=0)
        return np.concatenate([rest.tip, rest.joints, 1e-6 * rest.cylinder_forces])

    def of(response):
        row = np.concatenate([response.tip, response.joints, 1e-6 * response.cylinder_forces], axis=1)[0]
        assert np.all(row.imag == 0.0)
        return row.real

    at_rest = np.zeros(1)
    expected = richardson(loaded, 8.0) / -9.81
    found = of(frequency_response(scene, at_rest, strokes=strokes))
    assert np.linalg.norm(found - expected) < 1e-9 * np.linalg.norm(expected)
    for i in range(4):

        def moved(more, i=i):
            rest = statics(scene, strokes=strokes + more * np.eye(4)[i], modes=0)
            return np.concatenate([rest.tip, rest.joints, 1e-6 * rest.cylinder_forces])

        found = of(frequency_response(scene, at_rest, strokes=strokes, drive=i + 1))
        expected = richardson(moved, 1e-2)
        assert np.linalg.norm(found - expected) < 1e-9 * np.linalg.norm(expected)


def test_forces_and_drives_are_reciprocal():
    """What a force at the tip does to cylinder i, the drive of cylinder i does to the tip (Betti)."""
    scene = load_scene()
    by_drive = [frequency_response(scene, BAND, posture="high", drive=i + 1).tip for i in range(4)]
    for axis, force in enumerate(FORCES):
        forces = frequency_response(scene, BAND, posture="high", tip_force=force).cylinder_forces
        for i in range(4):
            assert forces[:, i] == pytest.approx(by_drive[i][:, axis], rel=1e-8, abs=1e-8 * np.abs(forces).max())
