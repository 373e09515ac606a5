"""Lag of a stream behind the strokes: delay at which its readings match those expected from the strokes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..types import NANO, Array

SPAN = 4.0  # s, span whose mean is removed, so that zeros and slow model errors are no lag
LONGEST, COARSE = 1.0, 0.05  # s, largest lag of the search, and spacing of the first guesses
ROUNDS = 6  # Gauss-Newton steps
FEWEST = 3.0  # least effective number of moving spans and channels
CLEAR = 0.5  # largest squared residual with the lag, relative to that without
FLOOR = 1e-3  # s, standard deviation of a lag by model errors


class Lag(NamedTuple):
    """Lag of a stream and standard deviation, s. `sigma` is infinite if no lag is found."""

    lag: float
    sigma: float


def lag_of(stamps: NDArray[np.int64], read: Array, expected: Array) -> Lag:
    """Return the lag of readings behind expected ones, both (k, channels), at `stamps` (k,) in ns.

    Gauss-Newton starts from the best of several guesses. The scatter among spans gives the deviation.
    """
    times = (stamps - stamps[0]) * NANO
    spans = (times // SPAN).astype(int)
    off = [_left(times, spans, read, expected, lag)[0] for lag in np.arange(-LONGEST, LONGEST + COARSE, COARSE)]
    sizes = np.array([np.nansum(each**2, axis=0) for each in off])
    scale = np.fmax(np.nanmin(sizes, axis=0), 1e-300) / max(len(times), 1)
    lag = float(np.arange(-LONGEST, LONGEST + COARSE, COARSE)[int((sizes / scale).sum(axis=1).argmin())])
    before = float((np.nansum(_left(times, spans, read, expected, 0.0)[0] ** 2, axis=0) / scale).sum())
    for _ in range(ROUNDS):
        left, slopes = _left(times, spans, read, expected, lag)
        by, weight = (_summed(spans, np.nan_to_num(each / scale)) for each in (-left * slopes, slopes**2))
        if not weight.sum() > 0.0 or weight.sum() ** 2 < FEWEST * (weight**2).sum():
            return Lag(0.0, math.inf)
        change = float(by.sum() / weight.sum())
        lag += min(max(change, -COARSE), COARSE)
    after = float((np.nansum(left**2, axis=0) / scale).sum())
    if abs(lag) > LONGEST or (abs(lag) > COARSE and after > CLEAR * before):
        return Lag(0.0, math.inf)
    scatter = math.sqrt(float(((by - change * weight) ** 2).sum())) / float(weight.sum())
    return Lag(lag, math.hypot(scatter, FLOOR))


def _left(times: Array, spans: NDArray[np.int64], read: Array, expected: Array, lag: float) -> tuple[Array, Array]:
    """Return residuals to the readings expected `lag` s before, and their rates, each less its mean in a span."""
    then, step = times - lag, 0.005
    columns = [np.interp(then, times, column) for column in expected.T]
    slopes = [(np.interp(then + step, times, c) - np.interp(then - step, times, c)) / (2.0 * step) for c in expected.T]
    left = read - np.column_stack(columns)
    left[(then < times[0]) | (then > times[-1])] = np.nan
    return _less_mean(spans, left), _less_mean(spans, np.where(np.isfinite(left), np.column_stack(slopes), np.nan))


def _less_mean(spans: NDArray[np.int64], values: Array) -> Array:
    known = np.isfinite(values)
    sums = _summed(spans, np.where(known, values, 0.0))
    counts = np.maximum(_summed(spans, known.astype(float)), 1.0)
    return np.asarray(values - (sums / counts)[spans])


def _summed(spans: NDArray[np.int64], values: Array) -> Array:
    return np.column_stack([np.bincount(spans, column, spans.max() + 1) for column in values.T])
