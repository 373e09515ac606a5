"""Rows that arrive one by one: kept in order, forgotten from the front, a window by stamps."""

from __future__ import annotations

import numpy as np

from boom_twin.diagnostics.model_status import INTERVAL, StampWindow
from boom_twin.diagnostics.sensor_status import RowBuffer


def test_rows_keep_their_order_beyond_any_room() -> None:
    buffer = RowBuffer(2)
    for stamp in range(1000):
        buffer.add(stamp, np.array([stamp, -stamp]))
        buffer.forget(stamp % 3 == 2)
    assert buffer.stamps.tolist() == list(range(333, 1000))
    np.testing.assert_array_equal(buffer.rows, np.outer(buffer.stamps, [1.0, -1.0]))
    buffer.forget(len(buffer.rows))
    assert buffer.rows.shape == (0, 2)


def test_a_window_holds_its_time_and_begins_anew_if_the_clock_is_set_back() -> None:
    window, last = StampWindow(10 * INTERVAL, 1), 200 * INTERVAL
    for stamp in range(0, last + 1, INTERVAL // 4):
        if window.is_due(stamp):
            window.add(stamp, np.array([float(stamp)]))
    assert window.stamps.tolist() == list(range(last - 10 * INTERVAL, last + 1, INTERVAL))
    assert window.is_due(last - INTERVAL)
    window.add(last - INTERVAL, np.zeros(1))
    assert window.stamps.tolist() == [last - INTERVAL]
