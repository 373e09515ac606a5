"""Rows by number and by time, kept and overwritten; their blocks as the page reads them."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from boom_twin.monitor.data.store import Table
from boom_twin.monitor.protocol import ROWS, pack


def test_the_newest_rows_are_kept_in_order_and_found_by_time() -> None:
    table = Table("t", ["a_m", "b_m"], 10)
    assert table.newest == -np.inf and table.until(1.0) == 0 and table.rows(0, 5)[0].shape == (0,)
    for row in range(25):
        table.append(0.1 * row, (row, -row))
    times, values = table.rows(0, 100)
    assert (table.first, table.count, table.newest) == (15, 25, pytest.approx(2.4))
    assert times == pytest.approx(0.1 * np.arange(15, 25))
    assert values[:, 0].tolist() == list(range(15, 25)) and values[:, 1].tolist() == [-row for row in range(15, 25)]
    assert [table.until(time) for time in (-1.0, 1.5001, 1.95, 9.0)] == [15, 16, 20, 25]


@pytest.mark.parametrize(("rows", "columns"), [(0, 2), (1, 1), (3, 3), (4, 2), (5, 1)])
def test_a_block_is_laid_out_as_documented_and_keeps_the_next_one_aligned(rows: int, columns: int) -> None:
    times, values = np.arange(rows) * 1.5, np.arange(rows * columns, dtype=np.float32).reshape(rows, columns)
    block = pack(ROWS, 7, times, values)
    assert len(block) % 8 == 0
    assert struct.unpack_from("<BBHI", block) == (ROWS, 7, columns, rows)
    assert np.frombuffer(block, "<f8", rows, 8).tolist() == times.tolist()
    assert np.frombuffer(block, "<f4", rows * columns, 8 + 8 * rows).reshape(columns, rows).T.tolist() == values.tolist()
