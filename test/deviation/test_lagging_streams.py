"""Streams whose clock is not that of the strokes: lag and drift are estimated, and the estimate is as with right stamps."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import strokes_of_posture

from boom_twin import Sample, Stream, Twin, load_scene, statics
from boom_twin.twin.blocks import block_of
from boom_twin.types import SECOND, Array

SCENE = load_scene()
LENGTHS = statics(SCENE, strokes=strokes_of_posture(SCENE, "arch")).lengths
STEP = 10_000_000  # ns
NOISE = 2e-4  # rad


def lengths_at(times: Array, amplitude: float) -> Array:
    return LENGTHS + amplitude * (1.0 - np.cos(np.outer(times, [0.9, 0.7, 1.2, 0.5])))


def angles_of(times: Array, amplitude: float) -> Array:
    """What a twin on the lengths alone predicts."""
    twin = Twin(SCENE)
    rows = [twin.update(Sample(Stream.STROKES, k * STEP, row)) for k, row in enumerate(lengths_at(times, amplitude))]
    return np.array([row.prediction.joints for row in rows])


def samples(times: Array, angles: Array, amplitude: float, lag: float, drift: float) -> list[Sample]:
    """Strokes, and angles that arrive when they are read, with the stamps of another clock."""
    noise, found = np.random.default_rng(4).normal(0.0, NOISE, angles.shape), []
    for k, (time, lengths) in enumerate(zip(times.tolist(), lengths_at(times, amplitude), strict=True)):
        found.append(Sample(Stream.STROKES, k * STEP, lengths))
        stamp = k * STEP + round((lag + drift * time) * SECOND)
        if k and stamp > 0:
            found.append(Sample(Stream.ANGLES, stamp, angles[k] + noise[k]))
    return found


@pytest.mark.parametrize(("lag", "drift"), [(0.0, 0.0), (-0.02, 5e-5), (0.04, -5e-5)])
def test_lag_and_drift_are_estimated_where_joints_move(lag: float, drift: float) -> None:
    """Within 1 ms and 3 deviations; the residuals are those of right stamps."""
    times, amplitude = np.arange(0.0, 40.0, 1e-9 * STEP), 0.03
    twin, residuals = Twin(SCENE, lagging=[Stream.ANGLES]), []
    for sample in samples(times, angles_of(times, amplitude), amplitude, lag, drift):
        residuals += [each for each in twin.update(sample).residuals if each.stream is Stream.ANGLES]
    clock = twin.clocks[Stream.ANGLES]
    assert clock.lag == pytest.approx(lag + drift * times[-1], abs=1e-3)
    assert clock.drift == pytest.approx(drift, abs=3.0 * clock.drift_sigma) and clock.drift_sigma < 4e-5
    late = np.array([each.values for each in residuals[len(residuals) // 2 :]])
    assert late.std() == pytest.approx(NOISE, rel=0.1)


def test_a_boom_at_rest_tells_nothing_of_a_lag() -> None:
    times = np.arange(0.0, 20.0, 1e-9 * STEP)
    twin = Twin(SCENE, lagging=[Stream.ANGLES])
    for sample in samples(times, angles_of(times, 0.0), 0.0, -0.02, 0.0):
        twin.update(sample)
    clock = twin.clocks[Stream.ANGLES]
    assert abs(clock.lag) < clock.lag_sigma and clock.lag_sigma > 0.02


def test_a_block_of_samples_gives_what_they_give_one_by_one() -> None:
    """A replay takes blocks, a node single samples."""
    times, amplitude = np.arange(0.0, 5.0, 1e-9 * STEP), 0.03
    given = samples(times, angles_of(times, amplitude), amplitude, -0.02, 5e-5)
    one, other = (Twin(SCENE, lagging=[Stream.ANGLES]) for _ in range(2))
    singles = [one.update(each) for each in given]
    reports = [each for k in range(0, len(given), 37) for each in other.take(block_of(given[k : k + 37], 4)).reports(4)]
    assert len(singles) == len(reports) and one.clocks == other.clocks and one.clocks[Stream.ANGLES].lag < -0.01
    for left, right in zip(singles, reports, strict=True):
        assert (left.estimate is None) == (right.estimate is None)
        assert left.estimate is None or (left.estimate.tip == right.estimate.tip).all()
