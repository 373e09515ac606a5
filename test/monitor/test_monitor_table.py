"""Rows by number and by time, kept and overwritten; their blocks as the page reads them."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from boom_twin.monitor.data.store import Table
from boom_twin.monitor.protocol import ROWS, pack


@pytest.fixture
def table() -> Table:
    """Rows 0 .. 24 at 0, 0.1 .. 2.4 s, of which the newest ten are kept."""
    table = Table("t", ["a_m", "b_m"], 10)
    for row in range(25):
        table.append(0.1 * row, (row, -row))
    return table


def test_the_newest_rows_are_kept_in_order(table: Table) -> None:
    times, values = table.rows(0, 100)
    assert (table.first, table.count, table.newest) == (15, 25, pytest.approx(2.4))
    assert times == pytest.approx(0.1 * np.arange(15, 25))
    assert values[:, 0].tolist() == list(range(15, 25)) and values[:, 1].tolist() == [-row for row in range(15, 25)]


@pytest.mark.parametrize(("time", "row"), [(-1.0, 15), (1.5001, 16), (1.95, 20), (9.0, 25)])
def test_a_time_gives_the_number_of_the_first_row_after_it(table: Table, time: float, row: int) -> None:
    assert table.until(time) == row


def test_an_empty_table_has_no_newest_row() -> None:
    table = Table("t", ["a"], 4)
    assert table.newest == -np.inf and table.until(1.0) == 0 and table.rows(0, 5)[0].shape == (0,)


@pytest.mark.parametrize(("rows", "columns"), [(0, 2), (1, 1), (3, 3), (4, 2), (5, 1)])
def test_a_block_is_laid_out_as_documented(rows: int, columns: int) -> None:
    times, values = np.arange(rows) * 1.5, np.arange(rows * columns, dtype=np.float32).reshape(rows, columns)
    block = pack(ROWS, 7, times, values)
    assert len(block) % 8 == 0
    assert struct.unpack_from("<BBHI", block) == (ROWS, 7, columns, rows)
    assert np.frombuffer(block, "<f8", rows, 8).tolist() == times.tolist()
    assert np.frombuffer(block, "<f4", rows * columns, 8 + 8 * rows).reshape(columns, rows).T.tolist() == values.tolist()


def test_two_blocks_in_a_message_stay_aligned() -> None:
    first = pack(ROWS, 0, np.zeros(3), np.zeros((3, 1), np.float32))
    message = first + pack(ROWS, 1, np.ones(1), np.ones((1, 1), np.float32))
    assert struct.unpack_from("<BBHI", message, len(first)) == (ROWS, 1, 1, 1)
