"""The finite-segment boom as arrays against the same boom by automatic differentiation, state by state."""

from __future__ import annotations

import numpy as np
import pytest
from convergence import motions
from oracle import booms, lagrange, segments
from reference.segments.equations import Equations
from reference.segments.geometry import pieces

from boom_twin import load_scene


def kept(scene, fineness):
    """Which coordinates of `Segments` are those of `Equations`: all but the headings of links."""
    found = []
    for i, joint in enumerate(scene.joints):
        springs = sum(piece.springs for piece in pieces(scene, i, fineness))
        found += [True, *([] if joint.kind == "A" else [False, False]), *([True] * (2 * springs))]
    return np.array(found)


def with_links(equations, own, q, v):
    """Coordinates and rates of `Segments` for those of `Equations`; `own` marks the shared ones."""
    tables, whole, rates = equations.tables, np.zeros(len(own)), np.zeros(len(own))
    whole[own], rates[own] = q, v
    before, after = tables.turn[tables.head[:-1]], tables.turn[tables.root[1:]]
    places = np.flatnonzero(~own).reshape(-1, 2)
    for side, link in enumerate(equations.linkages.angles((after - before) @ q)):
        whole[places[:, side]] = before @ q + link.value
        rates[places[:, side]] = before @ v + link.first * ((after - before) @ v)
    return whole, rates


SCENES = [(load_scene(), "arch"), *((booms.random_boom(seed), "test") for seed in (0, 1, 4, 8, 9, 12, 13, 17, 18, 19))]


@pytest.mark.parametrize("fineness", [0, 1])
@pytest.mark.parametrize(("scene", "posture"), SCENES)
def test_accelerations_are_those_of_lagrange(scene, posture, fineness):
    angles = np.diff(np.radians(scene.postures[posture]), prepend=0.0)
    rng = np.random.default_rng(1)
    start = segments.Segments(scene, 0).lengths(angles)
    drive = motions.smooth_drive(start, 0.02 * rng.standard_normal(len(angles)), 0.3)
    witness, equations = lagrange.Lagrange(scene, drive, fineness), Equations(scene, drive, fineness)
    own = kept(scene, fineness)
    q = witness.model.start(angles)[own] + 1e-3 * rng.standard_normal(own.sum())
    v = 0.1 * rng.standard_normal(own.sum())
    expected, multipliers, boom = witness.accelerations(0.1, *with_links(equations, own, q, v))
    found, forces, placed = equations.accelerations(0.1, q, v)
    assert max((abs(c.v) for c in boom.closures), default=0.0) < 1e-12
    assert np.abs(found - expected[own]).max() < 1e-9 * np.abs(expected).max()
    assert placed.lengths.value == pytest.approx([length.v for length in boom.lengths], abs=1e-12)
    assert placed.tip.value[0] == pytest.approx([boom.tip[0].v, boom.tip[1].v], abs=1e-12)
    assert placed.joints == pytest.approx([joint.v for joint in boom.joints], abs=1e-12)
    assert forces[equations.rigid] == pytest.approx(multipliers, rel=1e-9)
