"""A window of rows by their stamps."""

from __future__ import annotations

import numpy as np

from boom_twin.diagnostics.model_status import INTERVAL, StampWindow


def test_a_window_holds_its_time_and_begins_anew_if_the_clock_is_set_back() -> None:
    window, last = StampWindow(10 * INTERVAL, 1), 200 * INTERVAL
    for stamp in range(0, last + 1, INTERVAL // 4):
        if window.is_due(stamp):
            window.add(stamp, np.array([float(stamp)]))
    assert window.stamps.tolist() == list(range(last - 10 * INTERVAL, last + 1, INTERVAL))
    assert window.is_due(last - INTERVAL)
    window.add(last - INTERVAL, np.zeros(1))
    assert window.stamps.tolist() == [last - INTERVAL]
