"""Run of the twin, from a start of the model at rest to the next start, and checks of the values and stamps of strokes.

`Run` checks strokes or angles. It updates CHECKED, TRUSTED and OTHERS of `boom_twin.twin.state.TwinState.clock`.
A line is the sequence of stamps of one source. `StampCheck` follows one line and notes another line beside it. `verdict_on`
judges a stroke sample that is not the next one of its line: follow it, refuse it, or continue with the other line.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..config.settings import Settings
from ..deviation.predictor import BoomPredictor
from ..types import NANO, SECOND, Array, Sample
from .state import (
    BESIDE,
    CHECKED,
    IN_SLOT,
    NEWEST,
    NONE,
    OTHERS,
    SHORTEST_STEP,
    TRUSTED,
    USUAL_STEP,
    Limits,
    TwinState,
    is_next,
    longest_step,
    note_stamp,
    reach_of_strokes,
)
from .update import matched

MAX_IMPLAUSIBLE = 5  # consecutive implausible readings without a jump that are left out; the next one is used
SILENT_AFTER = 100_000_000  # ns after which a missing stroke is reported
JUMP_ACCEPTED_AFTER = 1_000_000_000  # ns after which the model restarts where a reading jumped and stayed
USUAL_RATE = 0.1  # motion during a jump: at most this share of the maximum rate, plus twice the estimated rate
Flags = NDArray[np.bool_]


class Run:
    """State of the twin since the last start from rest, in addition to `TwinState`, and check of the strokes that drive it."""

    def __init__(self, state: TwinState, stamp: int, is_again: bool) -> None:
        self.start, self.is_again, self._state, self._clock = stamp, is_again, state, state.clock
        self.is_predicted = False
        self._before = NONE  # stamp (ns) of the newest irregular sample
        self._jumped = np.zeros(0, np.int64)  # stamp (ns) of a stroke's jump; NONE without one
        state.clock[NEWEST] = stamp
        state.clock[IN_SLOT] = -1
        state.interval[:] = 0.0
        state.past.bounds[:] = 0

    @property
    def newest(self) -> int:
        """Stamp (ns) of the newest strokes that were followed."""
        return int(self._state.clock[NEWEST])

    @property
    def interval(self) -> float:
        """Running mean of the time between strokes, s."""
        return float(self._state.interval[0])

    @property
    def strokes(self) -> Array:
        """Newest strokes less their zeros, m, shape (n,); NaN where missing."""
        return self._state.strokes

    def strokes_at(self, stamp: int) -> Array | None:
        """Return the measured strokes at `stamp` (ns), linear between samples, m, shape (n,); None if not in memory."""
        past = self._state.past
        row, share = matched(past, stamp)
        if row < 0:
            return None
        old = past.strokes[row - 1]
        return np.asarray(past.strokes[row] if share == 1.0 else old + share * (past.strokes[row] - old))

    def is_of_others(self, stamp: int, values: Array, estimate: Array, limits: Limits) -> bool:
        """Return True if two or more strokes are out of reach of their cylinders, probably of another boom.

        After `MAX_IMPLAUSIBLE` such samples in a row the result is False.
        """
        limit = self._limit(stamp, limits)
        if np.count_nonzero(_are_far(values, estimate, limit)) < 2:
            self._clock[OTHERS] = 0
            return False
        self._clock[OTHERS] += 1
        return bool(self._clock[OTHERS] <= MAX_IMPLAUSIBLE)

    def _limit(self, stamp: int, limits: Limits) -> float:
        return float(reach_of_strokes(limits.far, limits.rate, stamp - int(self._clock[CHECKED])))

    def checked(
        self, stamp: int, values: Array, before: Array, estimate: Array | None, rates: Array, limits: Limits
    ) -> tuple[Array, list[str]]:
        """Return the strokes (n,) for the model, NaN = missing, and events. The caller then checks `must_restart`.

        `values` and those `before` are measured, m; `estimate` is None for the first sample of a run; `rates` (m/s) are
        estimated at the sample before. `stamp` is in ns.
        """
        if estimate is None:
            self._implausible = np.zeros(len(values), np.int64)
            self._seen = np.full(len(values), stamp)  # stamp (ns) of the newest reading used of every stroke
            self._jumped = np.full(len(values), NONE)
            self._clock[CHECKED] = self._clock[TRUSTED] = stamp
            return values, []
        limit = self._limit(stamp, limits)
        far = _are_far(values, estimate, limit)
        self._clock[CHECKED] = stamp
        if not far.any() and np.isfinite(values).all():
            self._clock[TRUSTED] = stamp
            return values, []
        if self._clock[TRUSTED] > self._before:  # a regular sample came since the last irregular one
            self._implausible[:], self._seen[:], self._jumped[:] = 0, self._clock[TRUSTED], NONE
        self._before = stamp
        step = values - before
        jumps, is_onward = np.abs(step) > limit, step * (before - estimate) > 0.0
        returned = jumps & (
            np.abs(values - estimate) <= limit + self._travel(stamp, USUAL_RATE * limits.rate + 2.0 * np.abs(rates))
        )
        is_back = self._note_jumps(stamp, far, jumps, is_onward, returned)
        return self._accepted(stamp, values, far & ~is_back)

    @property
    def must_restart(self) -> bool:
        """Return True if a stroke stays where it jumped for `JUMP_ACCEPTED_AFTER`: no motion leads there."""
        jumped = self._jumped != NONE
        return bool(jumped.any() and (self._before - self._jumped[jumped]).max() >= JUMP_ACCEPTED_AFTER)

    def _travel(self, stamp: int, rates: Array) -> Array:
        """Return the distance of each reading at these `rates` since its jump, shape (n,)."""
        elapsed = np.where(self._jumped == NONE, 0, stamp - self._jumped) * NANO
        return np.asarray(rates * elapsed)

    def _note_jumps(self, stamp: int, far: Flags, jumps: Flags, is_onward: Flags, returned: Flags) -> Flags:
        """Note the stamps of jumps; return the strokes that jumped back. A second jump onward is motion, sampled slowly."""
        is_away = self._jumped != NONE
        is_back: Flags = is_away & returned
        is_over = is_back | ~far | (is_away & jumps & is_onward)
        self._jumped = np.where(is_over, NONE, np.where(far & jumps, stamp, self._jumped))
        return is_back

    def _accepted(self, stamp: int, values: Array, far: Flags) -> tuple[Array, list[str]]:
        """Return the strokes without implausible ones, which are NaN, and events."""
        self._implausible = np.where(far, self._implausible + 1, np.where(np.isnan(values), self._implausible, 0))
        implausible = far & ((self._implausible <= MAX_IMPLAUSIBLE) | (self._jumped != NONE))
        taken = np.where(implausible, np.nan, values)
        self._implausible[far & ~implausible] = 0
        self._seen = np.where(np.isfinite(taken), stamp, self._seen)
        silent = np.isnan(taken) & (stamp - self._seen > SILENT_AFTER)
        events = ["implausible"] if implausible.any() else []
        if silent.any():
            events.append("held")
        return taken, events


def _are_far(values: Array, estimate: Array, limit: float) -> Flags:
    return np.asarray(np.abs(values - estimate) > limit)


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
