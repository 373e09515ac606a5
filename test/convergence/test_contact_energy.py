"""In a closed system contact never gives energy: a boom shaken by its drives, which then stand still."""

from __future__ import annotations

import numpy as np
import pytest
from bench.contact_energy import Closed, booms_with

LONG = {1e-3: 2000, 1e-4: 5000, 1e-5: 5000}


@pytest.mark.parametrize("step", LONG)
@pytest.mark.parametrize(("law", "restitution"), [("hertz", 1.0), ("lankarani-nikravesh", 0.9)])
def test_energy_never_exceeds_the_first(law, restitution, step):
    closed = Closed(booms_with(law, restitution), "arch", step)
    rise, left, lost = closed.watch(LONG[step], 10)
    assert rise < 1e-3
    assert left < 1.0 + 1e-6
    assert lost > 0 or step < 1e-4


def test_elastic_contact_loses_little_where_it_is_resolved():
    _, left, _ = Closed(booms_with("hertz", 1.0), "arch", 1e-4).watch(3000, 10)
    assert 0.999 < left < 1.0 + 1e-6


def test_friction_only_takes():
    _, without, _ = Closed(booms_with("lankarani-nikravesh", 0.9), "arch", 1e-3).watch(500, 10)
    rise, left, _ = Closed(booms_with("lankarani-nikravesh", 0.9, friction=0.1), "arch", 1e-3).watch(500, 10)
    assert rise < 1e-3 and left < without
    assert np.isfinite(left)
