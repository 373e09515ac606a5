"""The row of results: every number of it has one name, and kernels and Python call it the same."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.kernels.result_row import estimates_in, places_in, prediction_width, results_in, results_of, row_width


@pytest.mark.parametrize(("joints", "pins"), [(1, 0), (4, 0), (4, 3), (12, 1)])
def test_every_place_has_one_name(joints: int, pins: int) -> None:
    row = np.arange(prediction_width(joints, pins), dtype=float)
    found, estimated = results_in(row, joints, pins), estimates_in(row, joints, pins)
    named = np.concatenate([part.ravel() for part in (*found, *estimated)])
    assert sorted(named) == list(row)
    for name, place in places_in(joints, pins)._asdict().items():
        assert np.array_equal(row[place], getattr(found if hasattr(found, name) else estimated, name).ravel()), name
    assert found.tip.shape == (3, 3) and found.pins.shape == (pins, 4) and estimated.rigid_tip.shape == (2,)
    assert all(np.shares_memory(part, row) for part in (*found, *estimated) if part.size)


@pytest.mark.parametrize("lead", [(), (5,), (2, 5), (0,)])
def test_rows_are_named_as_one_row_is(lead: tuple[int, ...]) -> None:
    rows = np.random.default_rng(1).normal(size=(*lead, row_width(4, 2)))
    found = results_of(rows, 4, 2)
    assert found.tip.shape == (*lead, 3, 3) and found.pins.shape == (*lead, 2, 4)
    for at in np.ndindex(*lead):
        for one, other in zip(results_in(rows[at], 4, 2), found, strict=True):
            assert np.array_equal(one, other[at])
