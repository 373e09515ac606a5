"""Rows of a long table are thinned out, and a picture of what is left still shows every extreme."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.plots.extreme_rows import ExtremeRows


def table(rows: int, part: int, most: int) -> tuple[ExtremeRows, np.ndarray]:
    """A table that came in parts, and all that came."""
    values = np.random.default_rng(5).standard_t(2.0, (rows, 3))
    values[rows // 3 : rows // 2, 1] = np.nan
    whole = np.column_stack([np.arange(float(rows)), values])
    found = ExtremeRows(most, ("keys",))
    for first in range(0, rows, part):
        rows = whole[first : first + part]
        found.add({"number": rows[:, 0], "keys": rows[:, 1:3], "other": rows[:, 3]})
        if found.is_full:
            found.thin(found.columns["number"] == 777.0)
    return found, whole


def test_few_rows_stay_as_they_are() -> None:
    found, whole = table(1000, 100, 1000)
    assert not found.is_thin
    assert np.array_equal(np.column_stack([*found.columns.values()]), whole, equal_nan=True)


@pytest.mark.parametrize("rows", [5_000, 50_000])
def test_of_many_the_extremes_stay(rows: int) -> None:
    found, whole = table(rows, 700, 2000)
    numbers = found.columns["number"].astype(int)
    assert found.is_thin and 400 < len(numbers) <= 2700
    assert np.array_equal(np.column_stack([*found.columns.values()]), whole[numbers], equal_nan=True)
    assert np.all(np.diff(numbers) > 0) and 777 in numbers
    width = 2 ** int(np.ceil(np.log2(rows / 250)))  # that of a picture's column of pixels, or several
    for first in range(0, rows - rows % width, width):
        here = numbers[(numbers >= first) & (numbers < first + width)]
        for column in (1, 2):
            wanted, left = whole[first : first + width, column], whole[here, column]
            if np.isfinite(wanted).any():
                assert np.nanmin(left) == np.nanmin(wanted) and np.nanmax(left) == np.nanmax(wanted)
