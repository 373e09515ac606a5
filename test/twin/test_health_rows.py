"""Residuals as the health monitor takes them, by stream, against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.health.blocks import MeasuredRows
from boom_twin.kernels.jit import SameTypes, hold
from boom_twin.twin.blocks import STREAMS
from boom_twin.twin.health_rows import copy_residuals, count_residuals
from boom_twin.twin.state import new_output

WIDTHS = np.array([4, 4, 2, 4])


@pytest.mark.parametrize(("first", "last"), [(0, 50), (7, 31), (12, 12)])
def test_residuals_are_counted_and_copied_by_stream(first: int, last: int) -> None:
    found, rng = new_output(64, 4, 40, 5, WIDTHS), np.random.default_rng(first)
    found.residual_streams[:] = rng.integers(1, len(STREAMS), len(found.residual_streams))
    found.residual_stamps[:] = rng.integers(0, 10**18, len(found.residual_stamps))
    found.raw[:], found.values[:], found.sigmas[:] = rng.normal(size=(3, *found.raw.shape))
    held, counts, own = hold(found), np.full(len(STREAMS), 9), slice(first, last)
    SameTypes(count_residuals)(held, first, last, counts)
    assert counts.tolist() == np.bincount(found.residual_streams[own], minlength=len(STREAMS)).tolist()
    for code, width in enumerate(WIDTHS.tolist()):
        rows, chosen = MeasuredRows.room(int(counts[code]), width), found.residual_streams[own] == code
        SameTypes(copy_residuals)(held, first, last, code, *rows)
        assert np.array_equal(rows.stamps, found.residual_stamps[own][chosen])
        assert np.array_equal(rows.raw, found.raw[own][chosen, :width])
        assert np.array_equal(rows.left, found.values[own][chosen, :width])
        assert np.array_equal(rows.sigmas, found.sigmas[own][chosen, :width])
