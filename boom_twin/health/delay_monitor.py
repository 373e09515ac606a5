"""Monitor a constant lag of the angles' stamps: readings match the motion of an earlier time by a constant amount.

Readings that are d late differ from the prediction by its change in the d before. Both are averaged over two seconds (a
triangle of blocks), which takes vibration out: a natural frequency that is 1 % wrong puts it out of phase as a lag does.
Spans of 4 s, each less its mean, give d by least squares (Gauss-Newton, since moves do not go on at the same rate for half a
second). The scatter among the spans gives its deviation: other errors of the model depend on the posture, not on its rate.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..types import NANO, Alarm, Array, Stream
from .blocks import BLOCK, Block
from .stream_readings import StreamReadings

LEAST = 0.1  # s, lag from which on it is an alarm
STEP = BLOCK * NANO  # s between means of blocks
HALF = 10  # blocks of half a triangle
SPAN = 40  # blocks of one estimate
FEWEST, CLEAR = 2.0, 0.1  # motions of channels, and share of the squared residual that is left beside a lag that is clear
NEWEST = (30, 15, 7, 3)  # spans that are used: fewer if more show no clear lag, which may have come since
FLOOR = 3e-3  # s, deviation of a lag by the errors of the model
SURE = 5.0  # deviations from which on a lag is an alarm
LONGEST = 1.5  # s, lag that is looked for: of a span more is left than is lost at its ends
ROUNDS, ROUND = 6, 0.25  # of Gauss-Newton, and by how much (s) a lag changes in one at most


class DelayMonitor:
    """Monitor of the joint angles' stamps.

    Attributes
    ----------
    alarm : Alarm or None
        While it lasts.
    """

    def __init__(self) -> None:
        self.alarm: Alarm | None = None
        self.begin()

    def begin(self) -> None:
        """Discard all readings, for the boom starts from rest; an alarm lasts until it is refuted."""
        self._number = 0
        self._blocks: deque[tuple[StreamReadings, NDArray[np.bool_]]] = deque()
        self._spans: deque[tuple[Array, Array]] = deque(maxlen=NEWEST[0])

    def take(self, readings: StreamReadings, masked: NDArray[np.bool_], block: Block) -> list[Alarm]:
        """Take a block without the channels that are `masked`; return an alarm that began or ended."""
        stamps = readings.rows.stamps
        is_empty = len(stamps) < 2 or stamps[-1] <= stamps[0]
        if block.number != self._number + 1 or is_empty:
            self._blocks.clear()
        self._number = block.number
        if is_empty:
            return []
        self._blocks.append((readings, masked | (readings.counts < len(stamps))))
        if len(self._blocks) < SPAN + 2 * (HALF - 1):
            return []
        left_out = np.array([masked for _, masked in self._blocks])
        off = np.where(left_out, np.nan, [each.off for each, _ in self._blocks])
        rows, slopes = _averaged(off), _averaged(np.array([each.rates for each, _ in self._blocks]))
        for _ in range(SPAN):
            self._blocks.popleft()
        is_known = np.isfinite(rows).all(axis=0) & np.isfinite(slopes).all(axis=0)
        self._spans.append((np.where(is_known, rows, 0.0), np.where(is_known, slopes, 0.0)))
        return self._judge(block.end)

    def _judge(self, end: int) -> list[Alarm]:
        rows, slopes = (np.array(each) for each in zip(*self._spans, strict=True))
        estimates = [_lag(rows[-count:], slopes[-count:]) for count in NEWEST if count == NEWEST[0] or count < len(rows)]
        clear = ((lag, sigma) for lag, sigma, is_clear in estimates if is_clear)
        lag, sigma = next(clear, (0.0, math.inf))
        if self.alarm is None and abs(lag) >= max(LEAST, SURE * sigma):
            stream = Stream.ANGLES.value
            self.alarm = Alarm(stream, "late", end, None, f"{stream}.delay", f"by {lag:+.3g} s (+- {sigma:.1g})")
            return [self.alarm]
        newest, spread, _ = estimates[-1]
        if self.alarm is not None and abs(newest) + SURE * spread < LEAST:
            ended, self.alarm = replace(self.alarm, until=end), None
            self._spans.clear()
            return [ended]
        return []


def _averaged(blocks: Array) -> Array:
    """Return means over a triangle of numbers of blocks (.., channels), shape (SPAN, channels)."""
    triangle = np.convolve(np.ones(HALF), np.ones(HALF)) / HALF**2
    return np.column_stack([np.convolve(column, triangle, "valid") for column in blocks.T])


def _lag(rows: Array, slopes: Array) -> tuple[float, float, bool]:
    """Return the lag by these spans, its deviation (infinite if too little has moved), and whether it is clear."""
    lag, off2 = 0.0, math.nan
    for number in range(ROUNDS):
        by, weight, left2 = lag_equations(rows, slopes, lag)
        off2 = left2 if number == 0 else off2
        if not weight.sum() > 0.0:
            return 0.0, math.inf, False
        change = float(by.sum() / weight.sum())
        lag = min(max(lag + min(max(change, -ROUND), ROUND), -LONGEST), LONGEST)
    if weight.sum() ** 2 < FEWEST * (weight**2).sum():
        return 0.0, math.inf, False
    scatter = float(np.sqrt(((by - change * weight) ** 2).sum()) / weight.sum())
    return lag, math.hypot(scatter, FLOOR), left2 < CLEAR * off2


def lag_equations(rows: Array, slopes: Array, lag: float) -> tuple[Array, Array, float]:
    """Return the normal equations of a change of a lag, of every span and channel by itself.

    Beside the lag, readings are off by what is left once the change of the prediction since then is added. This is minus the
    change of the lag times the rates at which they were read. Both count less their mean in a span. A channel's weight is the
    inverse of its noise, for which all is taken that is left.

    Parameters
    ----------
    rows, slopes : ndarray, shape (spans, k, channels)
        Residuals of readings `STEP` apart, and rates of the expected readings.
    lag : float
        s; of a span those readings count whose time lies in it.

    Returns
    -------
    by, weight : ndarray, shape (spans, channels)
        Right and left side.
    left2 : float
        Mean square of what is left.
    """
    change = 0.5 * STEP * (slopes[:, 1:] + slopes[:, :-1])
    gone = np.concatenate([np.zeros_like(slopes[:, :1]), change.cumsum(axis=1)], axis=1)
    place = np.arange(rows.shape[1]) - lag / STEP
    own = (place >= 0.0) & (place <= rows.shape[1] - 1.0)
    before = np.minimum(np.floor(place[own]).astype(int), rows.shape[1] - 2)
    share = (place[own] - before)[:, None]
    rates = (1.0 - share) * slopes[:, before] + share * slopes[:, before + 1]
    then = gone[:, before] + share * STEP * 0.5 * (slopes[:, before] + rates)
    left = rows[:, own] + gone[:, own] - then
    left, rates = left - left.mean(axis=1, keepdims=True), rates - rates.mean(axis=1, keepdims=True)
    noise = (left**2).sum(axis=(0, 1)) + 1e-300
    return -(left * rates).sum(axis=1) / noise, (rates**2).sum(axis=1) / noise, float((left**2).mean())
