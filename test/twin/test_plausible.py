"""Strokes that cannot be are kept from the model, those that can are not."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.config.settings import Settings
from boom_twin.twin.regular import NOISE_REACH
from boom_twin.twin.state import new_state
from boom_twin.twin.stroke_check import LASTING, MOST, SILENT, StrokeCheck

MS, SETTINGS = 1_000_000, Settings()
LIMIT = NOISE_REACH * SETTINGS.stroke_variance**0.5 + SETTINGS.stroke_rate * 0.005


class Run:
    """Readings every 5 ms; the estimate is the last that was taken, as the model's own nearly is."""

    def __init__(self) -> None:
        self.plausible, self.stamp, self.estimate = StrokeCheck(new_state(2, np.array([2, 2, 2])).clock), 0, None
        self.before = np.full(2, np.nan)
        self.take(0.3, 0.4)

    def take(self, *values: float):
        before, self.before = self.before, np.array(values)
        taken, events = self.plausible.of(self.stamp, self.before, before, self.estimate, np.zeros(2), SETTINGS)
        self.estimate = taken if self.estimate is None else np.where(np.isnan(taken), self.estimate, taken)
        self.stamp += 5 * MS
        return taken.tolist(), events


def same(found, *wanted):
    return found == pytest.approx(list(wanted), nan_ok=True)


def test_a_single_spike_is_left_out():
    run = Run()
    for size in (0.02, -0.02, 1.01 * LIMIT):
        taken, events = run.take(0.3 + size, 0.4)
        assert same(taken, np.nan, 0.4) and events == ["implausible"]
        assert run.take(0.3, 0.4) == ([0.3, 0.4], [])


def test_what_is_near_passes():
    run = Run()
    assert run.take(0.3 + 0.99 * LIMIT, 0.4)[1] == []


def test_what_jumps_elsewhere_is_held_until_it_jumps_back():
    """A transmitter that is lost for half a second, while the cylinder goes on a little."""
    run = Run()
    for k in range(100):
        taken, events = run.take(0.35, 0.4)
        late = (k + 1) * 5 * MS > SILENT
        assert same(taken, np.nan, 0.4) and events == ["implausible", "held"] if late else ["implausible"]
        assert not run.plausible.must_restart
    assert run.take(0.31, 0.4) == ([0.31, 0.4], [])
    assert run.take(0.31, 0.4) == ([0.31, 0.4], [])


def test_what_stays_elsewhere_for_a_second_is_believed_by_a_start_from_rest():
    run = Run()
    for _ in range(LASTING // (5 * MS)):
        run.take(0.35, 0.4)
        assert not run.plausible.must_restart
    run.take(0.35, 0.4)
    assert run.plausible.must_restart


def test_every_jump_to_and_fro_counts_anew():
    run = Run()
    for k in range(500):
        run.take(0.35 if k // 50 % 2 else 0.25, 0.4)
    assert not run.plausible.must_restart and run.estimate[0] == 0.3


def test_a_sensor_that_tells_new_readings_seldom_is_followed():
    """Ten a second, held between, of a cylinder at 40 mm/s: it may lag by two of them."""
    run, stroke = Run(), 0.3
    for _ in range(50):
        stroke += 0.004
        for _ in range(20):
            run.take(stroke, 0.4)
            assert not run.plausible.must_restart
        assert stroke - run.estimate[0] < 0.0081


def test_an_estimate_that_lags_is_no_jump_and_the_sixth_reading_is_believed():
    """Each reading is where the one before let it be; it is the estimate that stays."""
    run, stroke = Run(), 0.3
    for k in range(MOST + 1):
        stroke += 0.9 * LIMIT
        run.estimate = np.array([0.3 - 0.2 * LIMIT, 0.4])
        taken, events = run.take(stroke, 0.4)
        assert events == (["implausible"] if k < MOST else []) and not run.plausible.must_restart
    assert taken == [pytest.approx(stroke), 0.4]


def test_a_shorter_burst_leaves_no_trace():
    run = Run()
    for _ in range(3):
        for _ in range(MOST):
            assert run.take(0.35, 0.4)[1] == ["implausible"]
        assert run.take(0.3, 0.4) == ([0.3, 0.4], [])


def test_a_fast_move_passes():
    run, stroke = Run(), 0.3
    for _ in range(200):
        stroke += 0.9 * SETTINGS.stroke_rate * 0.005
        assert run.take(stroke, 0.4) == ([pytest.approx(stroke), 0.4], [])


def test_a_pause_allows_as_much_as_it_is_long():
    run = Run()
    run.stamp += 1000 * MS
    assert run.take(0.3 + SETTINGS.stroke_rate, 0.4)[1] == []


def test_a_stroke_that_fell_silent_is_told():
    run = Run()
    for k in range(100):
        taken, events = run.take(np.nan, 0.4)
        late = (k + 1) * 5 * MS > SILENT
        assert same(taken, np.nan, 0.4) and events == (["held"] if late else [])
    assert run.take(0.3, 0.4) == ([0.3, 0.4], [])
    assert same(run.take(np.nan, 0.4)[0], np.nan, 0.4), "silence counts anew"


def test_the_others_of_a_sample_are_taken():
    run = Run()
    taken, events = run.take(0.9, np.nan)
    assert same(taken, np.nan, np.nan) and events == ["implausible"]
