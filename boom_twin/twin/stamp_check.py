"""Check of stroke stamps: regular and stray stamps, pauses, a clock that was set back, a second source.

A line is the sequence of stamps of one source. `StampCheck` follows one line and notes another line beside it. `verdict_on`
judges a stroke sample that is not the next one of its line: follow it, refuse it, or continue with the other line.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..config.settings import Settings
from ..deviation.predictor import BoomPredictor
from ..types import NANO, SECOND, Array, Sample
from .run import Run
from .state import BESIDE, NONE, SHORTEST_STEP, USUAL_STEP, Limits, TwinState, is_next, longest_step, note_stamp

EARLY_STEP = 8.0  # usual intervals, longest step ahead that needs no confirmation if the strokes are as expected
SECOND_LINE = 1_000_000_000  # ns after a stray stamp in which another line must be confirmed for the setting `gap`
SURPRISE = 0.1  # tolerance of strokes that go on: share of the fastest cylinder's travel in a usual interval


class StampCheck:
    """Line of stamps that is followed, and another line that may replace it.

    A sample whose stamp steps ahead or back has no effect, and begins another line. If the next samples continue the old line,
    the stamp was stray. If they continue the other line, the clock was set, and that line is followed from then on. After a
    stray stamp within the last second there may be two sources. Then the other line must continue alone for longer.

    `is_second` is True if both lines continue: there are two sources.
    """

    def __init__(self, settings: Settings, state: TwinState, stream: int) -> None:
        self._state, self._stream = state, stream
        self.is_second = False
        self._first = 0  # stamp with which the other line began
        self._other: Sample | None = None  # newest sample of the other line
        self._strayed: int | None = None
        self._state.clock[BESIDE] = 0
        self.tune(settings)

    @property
    def newest(self) -> int | None:
        """Stamp (ns) of the newest sample that was taken; None before the first."""
        stamp = int(self._state.newest[self._stream])
        return None if stamp == NONE else stamp

    @property
    def usual(self) -> float:
        """Usual time (ns) from one sample to the next; 0 while unknown."""
        return float(self._state.usual[self._stream])

    def tune(self, settings: Settings) -> None:
        """Set the limits to those of `settings`."""
        self._gap = round(settings.gap * SECOND)

    @property
    def longest(self) -> float:
        """Longest step of a stamp (ns) that needs no confirmation by the next sample."""
        return float(longest_step(self.usual, self._gap))

    def is_next(self, stamp: int) -> bool:
        """Return True if a sample comes at its usual time."""
        return self.newest is None or bool(is_next(self.newest, self.usual, self._gap, stamp))

    def is_soon(self, stamp: int) -> bool:
        """Return True if a sample comes early, or after few lost ones."""
        return self.newest is not None and 0 < stamp - self.newest <= min(self.longest, EARLY_STEP * self.usual or self._gap)

    def take(self, stamp: int) -> None:
        """Take this stamp as the newest of the line; those beside it were stray."""
        note_stamp(self._state, self._stream, stamp)
        if self._state.clock[BESIDE]:
            self._state.clock[BESIDE], self._strayed = 0, stamp

    def note(self, sample: Sample, limits: Limits) -> None:
        """Add a sample to the other line. Strokes that no cylinder could have reached since then begin another line."""
        other, is_open = self._other, bool(self._state.clock[BESIDE])
        follows = other is not None and 0 < sample.stamp - other.stamp <= self.longest
        if follows and is_open and other is not None:
            reach = limits.far + limits.rate * (sample.stamp - other.stamp) * NANO
            follows = _largest_difference(sample.values, other.values) <= reach
        if not (is_open and follows):
            self._first, self.is_second = sample.stamp, follows
        self._other, self._state.clock[BESIDE] = sample, 1

    def is_confirmed(self, least: float = 0.0) -> bool:
        """Return True if the other line spans `least` ns (after a recent stray stamp: `gap`), and about a usual interval."""
        assert self._other is not None
        if self._strayed is not None and self.newest is not None and self.newest - self._strayed < SECOND_LINE:
            least = max(least, self._gap)
        span = self._other.stamp - self._first
        return span > 0 and span >= max(self.usual / USUAL_STEP, least)

    def change_over(self) -> None:
        """Follow the other line from now on."""
        assert self._other is not None
        before, self._state.newest[self._stream] = self.newest, NONE
        self._other = None if before is None else Sample(self._other.stream, before, self._other.values)
        self._state.clock[BESIDE] = 0


# -- strokes whose stamp is not the next one -----------------------------------------------------------------------------


def _largest_difference(strokes: Array, expected: Array) -> float:
    return float(np.fmax.reduce(np.abs(strokes - expected), initial=0.0))


def _is_close(strokes: Array, expected: Array, usual: float, limits: Limits) -> bool:
    """Return True if strokes differ by at most their noise and a share of the largest motion in a usual interval (s)."""
    return _largest_difference(strokes, expected) <= limits.far + SURPRISE * limits.rate * usual


def _is_continuous(boom: BoomPredictor, before: Array, strokes: Array, span: float, limits: Limits) -> bool:
    """Return True if strokes (m) continue the estimate or the newest sample `before`, extrapolated by `span` (s)."""
    now, later = boom.extrapolated(0.0), boom.extrapolated(span)
    other = later + np.where(np.isfinite(before), before - now, 0.0)
    return _is_close(strokes, np.where(np.abs(strokes - other) < np.abs(strokes - later), other, later), 0.0, limits)


class Verdict(NamedTuple):
    """Event of a stroke sample (empty for a regular one); whether it is followed, or noted as one of another line."""

    event: str
    is_followed: bool = False
    is_noted: bool = False


def verdict_on(
    sample: Sample, values: Array, line: StampCheck, run: Run, boom: BoomPredictor, limits: Limits, settings: Settings
) -> Verdict:
    """Return the verdict on a stroke sample that is not the next one of its line. `values` (n,) are without zeros, m.

    A confirmed other line is followed after a pause (``gap``) or from rest (``restart``, ``jump back``).
    """
    span = sample.stamp - run.newest
    if 0 <= span < SHORTEST_STEP:
        return Verdict("duplicate" if _is_close(values, run.strokes, 0.0, limits) else "second source")
    if line.is_soon(sample.stamp) and _is_continuous(boom, run.strokes, values, span * NANO, limits):
        return Verdict("", is_followed=True)
    then = run.strokes_at(sample.stamp)
    is_back = -settings.jump_back <= span * NANO < 0
    if then is not None and is_back and np.array_equal(then, values):
        return Verdict("late")
    is_late = is_back and (then is None or _is_close(values, then, run.interval, limits))
    line.note(sample, limits)
    event = "late" if is_late else "second source" if line.is_second else "leap"
    if not line.is_confirmed(limits.gap if is_late or line.is_second else 0.0):
        return Verdict(event, is_noted=True)
    reach = limits.far + limits.rate * abs(span) * NANO
    if 0.0 < span * NANO <= settings.restart_gap and _largest_difference(values, boom.extrapolated(0.0)) <= reach:
        return Verdict("gap", is_followed=True)
    is_recent = run.is_again and run.newest - run.start < SECOND
    is_in_time = 0 < span <= limits.gap  # no pause: all strokes jumped at once
    if not line.is_confirmed(SECOND if is_recent or is_in_time or line.is_second else limits.gap):
        return Verdict(event, is_noted=True)
    return Verdict("restart" if span > 0 else "jump back", is_followed=True)
