"""The oracle's own geometry, its derivatives and its masses."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms, segments
from reference.worn_pin import geometry
from reference.worn_pin.motion import freed

POSTURES = ["horizontal", "arch", "high", "low"]


@pytest.mark.parametrize("posture", POSTURES)
def test_lengths_meet_the_finite_segments(posture):
    document = booms.document()
    headings = np.radians(document["postures"][posture])
    expected = segments.Segments(booms.scene_of(document), 0).lengths(np.diff(headings, prepend=0.0))
    found = [geometry.cylinder_length(document, headings, i) for i in range(4)]
    assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("index", range(4))
def test_derivatives_of_a_part(index):
    document, step = booms.document(), 1e-5
    headings = np.radians(document["postures"]["arch"])
    part = freed(document, headings, index, None).part
    phi = headings[index]
    before, here, after = (part.at(phi + side) for side in (-step, 0.0, step))
    assert (after.inertia - before.inertia) / (2 * step) == pytest.approx(here.slope, rel=1e-6, abs=1e-4)
    assert (after.height - before.height) / (2 * step) == pytest.approx(here.moments, rel=1e-7)
    assert (after.pin.value - before.pin.value) / (2 * step) == pytest.approx(here.pin.first, rel=1e-7)
    assert (after.pin.first - before.pin.first) / (2 * step) == pytest.approx(here.pin.second, rel=1e-6)
    tips = [part.tip_at(phi + side) for side in (-step, step)]
    lengths = [abs(p.pin.value - geometry.pins(document, headings, index)[0]) for p in (before, after)]
    lever = (tips[1] - tips[0]) / (lengths[1] - lengths[0])
    assert geometry.levers(document, headings)[index] == pytest.approx(lever, rel=1e-6)
