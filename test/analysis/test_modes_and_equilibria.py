"""Natural modes by their orthogonality, and equilibria wherever the joints reach and however soft the boom is."""

from __future__ import annotations

import numpy as np
import pytest
from analysis.resting import at_rest
from default_boom import strokes_of_angles
from oracle import booms
from reference.segments import equilibrium as segments
from scipy.linalg import eigh, null_space

from boom_twin import SolverError, load_scene, statics
from boom_twin.analysis.modal import damping_ratio, natural_modes
from boom_twin.validation.study import scenes as made

CASES = [pytest.param(load_scene(), "arch", id="default"), pytest.param(booms.random_boom(28), "test", id="boom 28")]


@pytest.mark.parametrize("scene, posture", CASES)
def test_modes_are_orthonormal_and_complete(scene, posture):
    """All modes below 500 Hz: unit modal mass, no mode missing between them (counted), state left as it was."""
    plan, state, work = at_rest(scene, posture)
    before = state.z.copy()
    modes = natural_modes(plan, state, work, 100, highest=2 * np.pi * 500.0)
    motions = np.array([mode.motion for mode in modes])
    assert len(modes) > 8
    assert (motions * plan.masses) @ motions.T == pytest.approx(np.eye(len(modes)), abs=1e-5)
    assert np.all(np.diff([mode.frequency for mode in modes]) > 0.0)
    assert np.array_equal(state.z, before)


@pytest.mark.parametrize("scene, posture", CASES)
def test_damping_ratios_are_those_of_the_oracle(scene, posture):
    """Dissipation of the oracle's modes at their own frequency, extrapolated from two subdivisions."""
    plan, state, work = at_rest(scene, posture)
    found = [damping_ratio(plan, mode) for mode in natural_modes(plan, state, work, 4)]
    coarse, fine = (_ratios(segments.Segments(scene, fineness), posture) for fineness in (2, 4))
    assert found == pytest.approx(fine + (fine - coarse) / 3.0, rel=2e-3)


def _ratios(model, posture):
    angles = np.diff(np.radians(model.scene.postures[posture]), prepend=0.0)
    drive = segments.Segments(model.scene, 0).lengths(angles)
    _, boom, _, hessian = segments.equilibrium(model, drive, angles)
    _, constraints = segments.energy(model, boom, drive)
    free = null_space(np.array([c.g for c in constraints]))
    values, vectors = eigh(free.T @ hessian @ free, free.T @ segments.mass_matrix(boom) @ free)
    modes = free @ vectors[:, :4]
    rows = [np.sqrt(damping) * elongation.g for _, damping, elongation in boom.springs]
    rows += [np.sqrt(j.cylinder.d or 0.0) * c.g for j, c in zip(model.scene.joints, boom.lengths, strict=True)]
    return np.sum((np.array(rows) @ modes) ** 2, axis=0) / (2.0 * np.sqrt(values[:4]))


def anywhere(scene, rng, ends):
    """Joint angles anywhere in range_deg; a share `ends` of them exactly at its ends."""
    ranges = np.radians([joint.range_deg for joint in scene.joints])
    angles = rng.uniform(ranges[:, 0], ranges[:, 1])
    sides = ranges[np.arange(len(ranges)), rng.integers(0, 2, len(ranges))]
    return np.where(rng.random(len(ranges)) < ends, sides, angles)


@pytest.mark.parametrize("ends", [0.0, 0.5])
def test_equilibrium_wherever_the_joints_reach(ends):
    """Random postures over the whole range, folded ones and the ends included; each sags but stays near its posture."""
    scene, rng = load_scene(), np.random.default_rng(11)
    for _ in range(60):
        angles = anywhere(scene, rng, ends)
        strokes = strokes_of_angles(scene, angles)
        found = statics(scene, strokes=strokes, modes=1)
        heading = np.cumsum(angles)
        lengths = np.array([section.length for section in scene.sections])
        assert found.tip_rigid == pytest.approx([lengths @ np.cos(heading), lengths @ np.sin(heading)], abs=1e-8)
        assert np.abs(found.joints - angles).max() < 0.08
        assert found.frequencies[0] > 0.3


def test_overloaded_linkage_has_no_equilibrium():
    """Joint 4 near its dead centre, far too heavy: both the oracle and the model say so instead of giving a number."""
    spec = booms.document() | {"tip": {"payload": 80.0}, "line_fill": 12.0}
    angles = np.radians([67.6, -165.0, -57.6, -165.0])
    scene = booms.scene_of(spec | {"postures": {"folded": list(np.degrees(np.cumsum(angles)))}})
    with pytest.raises(SolverError, match="no equilibrium"):
        segments.equilibrium(segments.Segments(scene, 1), segments.Segments(scene, 0).lengths(angles), angles)
    with pytest.raises(SolverError, match="no equilibrium at strokes"):
        statics(scene, posture="folded")


def test_what_no_boom_carries_is_refused_with_the_share_that_it_does():
    beyond = made.freed(load_scene(), 1, -178.0, 0.6, -172.0)
    with pytest.raises(SolverError, match=r"carries 0\.\d+ of its weight"):
        statics(beyond, posture="case")
