"""Monitor a constant lag of a stream's stamps: what is read is that of an earlier time, by as much whatever moves.

Readings that are d late differ from the prediction by what that has gone in the d before. Both are averaged over two periods
of the slowest vibration, two seconds at least (a triangle of blocks), which takes vibration out: a natural frequency that is
1 % wrong puts vibration out of phase as a lag does. Spans of 4 s, each less its mean, give d by least squares (Gauss-Newton,
for moves do not go on at the same rate for half a second), and how it scatters among them gives its deviation: whatever else
is wrong with the model goes with where the boom is, not with which way it moves, and does not agree about d.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..kernels.jit import SameTypes
from ..types import Alarm, Array, Ranked, Stream
from .lag_equations import BLOCK, lag_equations
from .sensor_survey import COUNTS, OFF, RATES
from .stream_readings import StreamReadings

LEAST = 10  # blocks of half a triangle, at least
SPAN = 40  # blocks of one estimate
FEWEST = 4.0  # spans, by how much they weigh, before anything is told
FEWEST_CLEAR, CLEAR = 2.0, 0.1  # motions of channels, and share of what is off that is left beside a lag that is clear
NEWEST = (30, 15, 7, 3)  # spans that are looked at: if all show no clear lag, fewer, for it may have come since
FLOOR = 3e-3  # s, deviation of what a lag is taken for, by the model's own
SURE, GONE = 5.0, 3.0  # deviations from which on it is told, and below which it has ended
LONGEST = 1.5  # s, lag that is looked for: of a span more is left than is lost at its ends
ROUNDS, ROUND = 6, 0.25  # of Gauss-Newton, and by how much (s) a lag changes in one at most

_lag_equations = SameTypes(lag_equations)


def delay_cause(stream: Stream) -> str:
    """How alarms call a lag of this stream."""
    return f"{stream.value}.delay"


def delay_remedy(stream: Stream) -> str:
    """What to do about a lag of this stream, for the end of a sentence."""
    return f"; if it stays, add it to `delay` of {stream.value} in the mapping"


class DelayMonitor:
    """Judges one stream.

    Parameters
    ----------
    stream : Stream
    least : float, optional
        s, lag that is told; with one, only a clear lag is told.

    Attributes
    ----------
    alarm : Alarm or None
        While it lasts.
    """

    def __init__(self, stream: Stream, least: float = 0.0) -> None:
        self._stream, self._least = stream, least
        self.alarm: Alarm | None = None
        self.begin()

    def begin(self) -> None:
        """The boom starts from rest; what is known of the lag stays known no longer, an alarm lasts until it is refuted."""
        self._number = 0
        self._blocks: deque[tuple[StreamReadings, NDArray[np.bool_]]] = deque()
        self._spans: deque[tuple[Array, Array]] = deque(maxlen=NEWEST[0])

    def take(
        self,
        number: int,
        readings: StreamReadings,
        masked: NDArray[np.bool_],
        end: int,
        is_doubted: Callable[[], bool] = lambda: False,
        period: float = 1.0,
        shared: float = 0.0,
    ) -> list[Alarm]:
        """Take a block; gives an alarm that began, changed or ended.

        Parameters
        ----------
        number : int
            Of the block; one that does not follow the last begins a new span.
        readings : StreamReadings
        masked : ndarray of bool, shape (channels,)
            Those that are not to be used.
        end : int
            Of the block, ns.
        is_doubted : callable, optional
            Asked once a span is complete: whether another fault puts vibration out of step, so that no alarm begins.
        period : float
            Of the slowest vibration, s.
        shared : float
            Lag (s) of other readings; what both are ahead by is a lag of the prediction, where it smooths fast strokes.
        """
        stamps = readings.rows.stamps
        is_empty = len(stamps) < 2 or stamps[-1] <= stamps[0]
        if number != self._number + 1 or is_empty:
            self._blocks.clear()
        self._number = number
        if is_empty:
            return []
        self._blocks.append((readings, masked))
        half = max(LEAST, math.ceil(period / BLOCK))
        if len(self._blocks) < SPAN + 2 * (half - 1):
            return []
        newest = list(self._blocks)[-(SPAN + 2 * (half - 1)) :]
        numbers, left_out = np.array([each.numbers for each, _ in newest]), np.array([masked for _, masked in newest])
        left_out |= numbers[:, COUNTS] < np.array([[len(each.rows.stamps)] for each, _ in newest])
        off = np.where(left_out, np.nan, numbers[:, OFF])
        rows, slopes = self._averaged(off, half), self._averaged(numbers[:, RATES], half)
        for _ in range(SPAN):
            self._blocks.popleft()
        is_known = np.isfinite(rows).all(axis=0) & np.isfinite(slopes).all(axis=0)
        self._spans.append((np.where(is_known, rows, 0.0), np.where(is_known, slopes, 0.0)))
        return self._judge(end, is_doubted(), shared)

    @staticmethod
    def _averaged(blocks: Array, half: int) -> Array:
        """Of numbers of blocks (.., channels), shape (SPAN, channels); `half` blocks are half of the triangle."""
        triangle = np.convolve(np.ones(half), np.ones(half)) / half**2
        return np.column_stack([np.convolve(column, triangle, "valid") for column in blocks.T])

    def estimate(self) -> tuple[float, float, bool]:
        """Return lag and deviation (s; infinite while too little has moved), and whether nearly all that is off is a lag."""
        if not self._spans:
            return 0.0, math.inf, False
        rows, slopes = (np.array(each) for each in zip(*self._spans, strict=True))
        for count in NEWEST:
            if count == NEWEST[0] or count < len(rows):
                lag, sigma, is_clear = _clear_lag(rows[-count:], slopes[-count:])
                if is_clear:
                    return lag, sigma, True
        return (*_small_lag(rows, slopes), False)

    def _judge(self, end: int, is_doubted: bool, shared: float) -> list[Alarm]:
        lag, sigma, is_clear = self.estimate()
        lag -= min(0.0, max(shared, lag))
        if self.alarm is not None and abs(lag) < GONE * sigma and math.isfinite(sigma):
            ended, self.alarm = replace(self.alarm, until=end), None
            return [ended]
        if abs(lag) < SURE * sigma or (
            self.alarm is None and (is_doubted or (self._least > 0.0 and not (is_clear and abs(lag) >= self._least)))
        ):
            return []
        cause = delay_cause(self._stream)
        told = f"{cause} late: {lag:+.3g} +- {sigma:.1g} s" + delay_remedy(self._stream)
        ranked = (Ranked(cause, 1.0, (("late", lag, sigma, "s"),)),)
        alarm = self.alarm or Alarm(self._stream.value, "late", end, None, cause, told, ranked)
        self.alarm = replace(alarm, told=told, ranked=ranked)
        return [self.alarm]


def _clear_lag(rows: Array, slopes: Array) -> tuple[float, float, bool]:
    """The lag by these spans, its deviation, and whether it is clear."""
    lag, off2 = 0.0, math.nan
    for number in range(ROUNDS):
        by, weight, left2 = normal_equations(rows, slopes, lag)
        off2 = left2 if number == 0 else off2
        if not weight.sum() > 0.0:
            return 0.0, math.inf, False
        change = float(by.sum() / weight.sum())
        lag = min(max(lag + min(max(change, -ROUND), ROUND), -LONGEST), LONGEST)
    if not left2 < CLEAR * off2 or _are_few(weight, FEWEST_CLEAR):
        return 0.0, math.inf, False
    return lag, _deviation(by, weight, change), True


def _small_lag(rows: Array, slopes: Array) -> tuple[float, float]:
    """A lag that is among other faults, and the noise of a boom at rest: so many times the slopes; and its deviation."""
    by, weight = (each.sum(axis=1) for each in normal_equations(rows, slopes, 0.0)[:2])
    if _are_few(weight, FEWEST):
        return 0.0, math.inf
    lag = float(by.sum() / weight.sum())
    return lag, _deviation(by, weight, lag)


def normal_equations(rows: Array, slopes: Array, lag: float) -> tuple[Array, Array, float]:
    """Right and left side for a change of a lag, shape (spans, channels), and the mean square that is left beside the lag."""
    spans, span, channels = rows.shape
    by, weight = np.empty((2, spans, channels))
    return by, weight, _lag_equations(rows, slopes, lag, np.empty((3, span, channels)), np.empty(channels), by, weight)


def _are_few(weight: Array, fewest: float) -> bool:
    """Whether no more than that many count, by how much they weigh."""
    return not weight.sum() > 0.0 or bool(weight.sum() ** 2 < fewest * (weight**2).sum())


def _deviation(by: Array, weight: Array, found: float) -> float:
    """Of a lag (s), by how it scatters."""
    return math.hypot(float(np.sqrt(((by - found * weight) ** 2).sum()) / weight.sum()), FLOOR)
