"""Check the stamps of a stream: tell regular samples from stray ones, pauses, a clock that was set, and a second source."""

from __future__ import annotations

from enum import Enum

import numpy as np

from ..config.settings import Settings
from ..deviation.predictor import BoomPredictor
from ..types import SECOND, Array, Sample
from .state import NONE, TwinState
from .stroke_check import FAR

STEP = 1.75  # usual intervals; a longer one is looked at
FEW = 8.0  # usual intervals; where strokes are as expected after a step up to that, it need not be confirmed
SMOOTHING = 0.05  # weight of the newest interval in the usual one
KEPT = 1024  # most samples that wait
LASTING = 1_000_000_000  # ns that a second line of stamps has to go on alone before it is followed


class StampCheck:
    """Line of stamps that is followed, and another line that may replace it.

    A sample whose stamp steps ahead or back is held and has no effect. If the next samples continue the old line, it was stray.
    If they follow the held sample, time has stepped: it and they are released together. After a stray stamp within the last
    second there may be two sources. Then the other line must continue alone for longer.

    Parameters
    ----------
    settings : Settings
    state : TwinState
        Where `newest`, `usual` and the number of `held` samples are kept.
    stream : int
        See `boom_twin.twin.blocks.CODES`.

    Attributes
    ----------
    is_second : bool
        Whether that line had been met before, and the one that is followed went on since: there are two sources.
    """

    def __init__(self, settings: Settings, state: TwinState, stream: int) -> None:
        self._state, self._stream = state, stream
        self.newest, self.usual, self.held = None, 0.0, []
        self.is_second = False
        self._since = 0
        self._other: int | None = None
        self._strayed: int | None = None
        self.tune(settings)

    @property
    def newest(self) -> int | None:
        """Stamp (ns) of the newest sample that was taken; None before the first."""
        stamp = int(self._state.newest[self._stream])
        return None if stamp == NONE else stamp

    @newest.setter
    def newest(self, stamp: int | None) -> None:
        self._state.newest[self._stream] = NONE if stamp is None else stamp

    @property
    def usual(self) -> float:
        """Usual time (ns) from one sample to the next; 0 while unknown."""
        return float(self._state.usual[self._stream])

    @usual.setter
    def usual(self, span: float) -> None:
        self._state.usual[self._stream] = span

    @property
    def held(self) -> list[tuple[Sample, str]]:
        """Newest samples of the other line, each with the event reported for it."""
        return self._held

    @held.setter
    def held(self, samples: list[tuple[Sample, str]]) -> None:
        self._held = samples
        self._note_held()

    def _note_held(self) -> None:
        self._state.held[self._stream] = len(self._held)

    def tune(self, settings: Settings) -> None:
        """Set the limits to those of `settings`."""
        self._gap = round(settings.gap * SECOND)

    @property
    def longest(self) -> float:
        """Longest step of a stamp (ns) that needs no confirmation by the next sample."""
        return max(self._gap, STEP * self.usual)

    def is_next(self, stamp: int) -> bool:
        """Return True if a sample comes at its usual time."""
        return self.newest is None or 0 < stamp - self.newest <= (STEP * self.usual or self._gap)

    def is_soon(self, stamp: int) -> bool:
        """Return True if a sample comes early, or after few lost ones."""
        return self.newest is not None and 0 < stamp - self.newest <= min(self.longest, FEW * self.usual or self._gap)

    def take(self, stamp: int) -> None:
        """Take this stamp as the newest of the line; held samples were stray."""
        if self.newest is not None:
            span, usual = stamp - self.newest, self.usual
            self.usual = usual + SMOOTHING * (min(span, 2.0 * usual) - usual) if usual else float(span)
        self.newest = stamp
        if self.held:
            self._other, self.held, self._strayed = self.held[-1][0].stamp, [], stamp

    def hold(self, sample: Sample, event: str, is_apart: bool = False) -> str:
        """Hold a sample, after the held ones that it follows or else in their place; return its event.

        A sample that `is_apart` does not follow the held ones: no cylinder could have moved from their values to its own.
        """
        last = self.held[-1][0].stamp if self.held else self._other
        follows = last is not None and 0 < sample.stamp - last <= self.longest and not is_apart
        if not (self.held and follows):
            self.held, self._since, self.is_second = [], sample.stamp, follows
        if self.is_second and event == "leap":
            event = "second source"
        self._held.append((sample, event))
        if len(self._held) > KEPT:
            del self._held[0]
        self._note_held()
        return event

    def is_confirmed(self, least: float = 0.0) -> bool:
        """Return True if the held samples continue for `least` ns, and until the line that is followed is late."""
        if self._strayed is not None and self.newest is not None and self.newest - self._strayed < LASTING:
            least = max(least, self._gap)
        span = self.held[-1][0].stamp - self._since
        return span > 0 and span >= max(self.usual / STEP, least)

    def release(self) -> list[tuple[Sample, str]]:
        """Return the held samples; their line is followed from now on."""
        held, self.held, self._other = self.held, [], self.newest
        self.usual = self.usual or float(held[-1][0].stamp - held[0][0].stamp) / (len(held) - 1)
        return held


SHARE = 0.1  # of the fastest cylinder's way in a usual interval, by which strokes that go on may surprise
SURE = 3.0  # deviations by which a cylinder must be moving, to tell a pause from a clock that was set
RATIO = 10.0  # how much better strokes must fit where the usual interval would have put them, than after a pause
LONGEST = 1.0  # s for which a speed is taken to last


class TimeStep(Enum):
    """Reason for a step in the stamps."""

    PAUSE = "pause"
    CLOCK = "clock"
    EITHER = "pause or clock"
    NEITHER = "neither"


def largest_difference(strokes: Array, expected: Array) -> float:
    """Return the largest difference of strokes, m; missing strokes do not count, and 0 if all are missing."""
    return float(np.fmax.reduce(np.abs(strokes - expected), initial=0.0))


def closeness(usual: float, settings: Settings) -> float:
    """Return the allowed difference of strokes from their expected values, m.

    It is the noise plus a share of the largest motion in a usual interval (s).
    """
    return float(FAR * settings.stroke_variance**0.5 + SHARE * settings.stroke_rate * usual)


def is_close(strokes: Array, expected: Array, usual: float, settings: Settings) -> bool:
    """Return True if strokes (m) are at their expected values."""
    return largest_difference(strokes, expected) <= closeness(usual, settings)


def is_continuous(boom: BoomPredictor, before: Array, strokes: Array, span: float, usual: float, settings: Settings) -> bool:
    """Return True if strokes (m) continue the newest sample `before`, extrapolated by `span` (s)."""
    return largest_difference(strokes, nearest(boom, before, strokes, span)) <= closeness(usual, settings)


def nearest(boom: BoomPredictor, before: Array, strokes: Array, span: float) -> Array:
    """Return the strokes extrapolated by `span` (s), shape (n,), m.

    Each starts from its estimate or from its newest measurement, whichever fits `strokes` better.
    """
    now, later = boom.extrapolated(0.0), boom.extrapolated(span)
    other = later + np.where(np.isfinite(before), before - now, 0.0)
    return np.where(np.abs(strokes - other) < np.abs(strokes - later), other, later)


def explain(
    boom: BoomPredictor,
    before: Array,
    strokes: tuple[Array, Array],
    span: float,
    apart: float,
    usual: float,
    settings: Settings,
) -> TimeStep:
    """Return the reason for a step of the stamps by `span` (s).

    A clock was set if both samples are where they would have been after the usual interval. If the stamps went ahead by no more
    than can be bridged, that is also what a pause at rest looks like: then a cylinder has to move, which would have gone on;
    else it may be either.

    Parameters
    ----------
    before : ndarray, shape (n,)
        Strokes as measured before the step, m; NaN where they were not.
    strokes : two ndarray, shape (n,)
        Of the first sample after the step, and of a later one, m.
    apart, usual : float
        Time between these two, and usually from one sample to the next, s.

    Returns
    -------
    TimeStep
        A clock that was set, a pause, either, or neither.
    """
    first, later = strokes
    after = ((first, usual), (later, usual + apart))
    miss = max(largest_difference(y, nearest(boom, before, y, time)) for y, time in after)
    fits = miss <= closeness(usual, settings)
    if not 0.0 < span <= settings.restart_gap:
        return TimeStep.CLOCK if fits else TimeStep.NEITHER
    if fits and RATIO * miss < boom.least_way(min(max(span - usual, 0.0), LONGEST), SURE):
        return TimeStep.CLOCK
    reach = FAR * settings.stroke_variance**0.5 + settings.stroke_rate * span
    if largest_difference(first, boom.extrapolated(0.0)) <= reach:
        return TimeStep.EITHER if fits else TimeStep.PAUSE
    return TimeStep.NEITHER
