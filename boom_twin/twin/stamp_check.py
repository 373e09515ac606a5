"""Check the stamps of a stream: tell regular samples from stray ones, pauses, a clock that was set, and a second source.

`StampCheck` follows one line of stamps and holds what leaves it. `verdict_on` decides on a stroke sample that is not the next
one of its line: follow it, refuse it, hold it, or step in time with those held.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

import numpy as np

from ..config.settings import Settings
from ..deviation.predictor import BoomPredictor
from ..types import NANO, SECOND, Array, Sample
from .run import Run
from .state import NONE, SHORTEST_STEP, USUAL_STEP, Limits, TwinState, is_next, longest_step, note_stamp

EARLY_STEP = 8.0  # usual intervals, longest step ahead that is accepted at once if the strokes are as expected
MOST_HELD = 1024  # samples that wait
SECOND_LINE = 1_000_000_000  # ns after a stray stamp in which a step in time must be confirmed for the setting `gap`
SURPRISE = 0.1  # tolerance of strokes that go on: share of the fastest cylinder's travel in a usual interval
MOVING = 3.0  # deviations by which a cylinder must be moving, to tell a pause from a clock that was set
CLEARER = 10.0  # how much better strokes must fit where the usual interval would have put them, than after a pause
LASTING_SPEED = 1.0  # s for which a speed is taken to last


class StampCheck:
    """Line of stamps that is followed, and another line that may replace it. A line is the sequence of stamps of one source.

    A sample whose stamp steps ahead or back is held and has no effect. If the next samples continue the old line, it was
    stray. If they follow the held sample, time has stepped: it and they are released together. After a stray stamp within the
    last second there may be two sources. Then the other line must continue alone for longer.

    `held` has the newest samples of the other line, each with the event reported for it. `is_second` is True if they continue
    a line that was seen before, while the followed one went on: there are two sources.
    """

    def __init__(self, settings: Settings, state: TwinState, stream: int) -> None:
        self._state, self._stream = state, stream
        self._state.usual[stream] = 0.0
        self.held: list[tuple[Sample, str]] = []
        self.is_second = False
        self._since = 0
        self._other: int | None = None
        self._strayed: int | None = None
        self.forget()
        self._note_held()
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

    def forget(self) -> None:
        """Forget the newest stamp: the next one begins the line anew."""
        self._state.newest[self._stream] = NONE

    def _note_held(self) -> None:
        self._state.held[self._stream] = len(self.held)

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
        """Take this stamp as the newest of the line; held samples were stray."""
        note_stamp(self._state, self._stream, stamp)
        if self.held:
            self._other, self.held, self._strayed = self.held[-1][0].stamp, [], stamp
            self._note_held()

    def hold(self, sample: Sample, event: str, is_apart: bool = False) -> str:
        """Append a sample to the held ones if it follows them, else replace them by it; return its event.

        A sample that `is_apart` does not follow the held ones: no cylinder could have moved from their values to its own.
        """
        last = self.held[-1][0].stamp if self.held else self._other
        follows = last is not None and 0 < sample.stamp - last <= self.longest and not is_apart
        if not (self.held and follows):
            self.held, self._since, self.is_second = [], sample.stamp, follows
        if self.is_second and event == "leap":
            event = "second source"
        self.held = [*self.held[1 - MOST_HELD :], (sample, event)]
        self._note_held()
        return event

    def is_confirmed(self, least: float = 0.0) -> bool:
        """Return True if the held samples span `least` ns (after a recent stray stamp: `gap`), and about a usual interval."""
        if self._strayed is not None and self.newest is not None and self.newest - self._strayed < SECOND_LINE:
            least = max(least, self._gap)
        span = self.held[-1][0].stamp - self._since
        return span > 0 and span >= max(self.usual / USUAL_STEP, least)

    def release(self, counts: Counter[str]) -> list[Sample]:
        """Return the held samples; their line is followed from now on. Their events, but the newest, are uncounted."""
        held, self.held, self._other = self.held, [], self.newest
        self._note_held()
        self._state.usual[self._stream] = self.usual or float(held[-1][0].stamp - held[0][0].stamp) / (len(held) - 1)
        counts.subtract(event for _, event in held[:-1])
        for event in {event for _, event in held if not counts[event]}:
            del counts[event]
        return [sample for sample, _ in held]


# -- strokes whose stamp is not the next one -----------------------------------------------------------------------------


class TimeStep(Enum):
    """Reason for a step in the stamps."""

    PAUSE = "pause"
    CLOCK = "clock"
    EITHER = "pause or clock"
    NEITHER = "neither"


def _largest_difference(strokes: Array, expected: Array) -> float:
    return float(np.fmax.reduce(np.abs(strokes - expected), initial=0.0))


def _closeness(usual: float, limits: Limits) -> float:
    """Return the allowed difference of strokes: the noise plus a share of the largest motion in a usual interval (s)."""
    return float(limits.far + SURPRISE * limits.rate * usual)


def _is_close(strokes: Array, expected: Array, usual: float, limits: Limits) -> bool:
    return _largest_difference(strokes, expected) <= _closeness(usual, limits)


def _is_continuous(boom: BoomPredictor, before: Array, strokes: Array, span: float, limits: Limits) -> bool:
    """Return True if strokes (m) continue the newest sample `before`, extrapolated by `span` (s)."""
    return _largest_difference(strokes, _nearest(boom, before, strokes, span)) <= _closeness(0.0, limits)


def _nearest(boom: BoomPredictor, before: Array, strokes: Array, span: float) -> Array:
    """Return strokes (n,) extrapolated by `span` (s): from the estimate or the newest measurement, whichever fits better."""
    now, later = boom.extrapolated(0.0), boom.extrapolated(span)
    other = later + np.where(np.isfinite(before), before - now, 0.0)
    return np.where(np.abs(strokes - other) < np.abs(strokes - later), other, later)


def _explain(
    boom: BoomPredictor,
    before: Array,
    strokes: tuple[Array, Array],
    span: float,
    apart: float,
    usual: float,
    settings: Settings,
    limits: Limits,
) -> TimeStep:
    """Return the reason for a step of the stamps by `span` (s).

    A clock was set if both samples are where they would have been after the usual interval. A short pause at rest looks the
    same. So after a short step ahead, a cylinder must also be moving that would have gone further in a pause; else the reason
    may be either. `before` are the strokes (n,) before the step, `strokes` those of the first sample after it and
    of one `apart` s later; `usual` is the usual time between samples, s.
    """
    first, later = strokes
    after = ((first, usual), (later, usual + apart))
    miss = max(_largest_difference(y, _nearest(boom, before, y, time)) for y, time in after)
    fits = miss <= _closeness(usual, limits)
    if not 0.0 < span <= settings.restart_gap:
        return TimeStep.CLOCK if fits else TimeStep.NEITHER
    if fits and CLEARER * miss < boom.least_way(min(max(span - usual, 0.0), LASTING_SPEED), MOVING):
        return TimeStep.CLOCK
    reach = limits.far + limits.rate * span
    if _largest_difference(first, boom.extrapolated(0.0)) <= reach:
        return TimeStep.EITHER if fits else TimeStep.PAUSE
    return TimeStep.NEITHER


class Action(Enum):
    """Treatment of a sample."""

    FOLLOW = "follow"
    REFUSE = "refuse"
    HOLD = "hold"
    STEP = "step in time"


class Verdict(NamedTuple):
    """Treatment of a sample, its event if it is refused or held, and the reason of a step in time."""

    action: Action
    event: str = ""
    why: TimeStep = TimeStep.NEITHER


def verdict_on(
    sample: Sample,
    line: StampCheck,
    run: Run,
    boom: BoomPredictor,
    limits: Limits,
    settings: Settings,
    zeroed: Callable[[Sample], Array],
) -> Verdict:
    """Return how to treat a stroke sample that is not the next one of its line; hold it there if it must wait.

    `zeroed` returns the strokes (n,) of a sample less their zeros, m.
    """
    stamp, values = sample.stamp, zeroed(sample)
    span = stamp - run.newest
    if 0 <= span < SHORTEST_STEP:
        return Verdict(Action.REFUSE, "duplicate" if _is_close(values, run.strokes, 0.0, limits) else "second source")
    if line.is_soon(stamp) and _is_continuous(boom, run.strokes, values, span * NANO, limits):
        return Verdict(Action.FOLLOW)
    then = run.strokes_at(stamp)
    is_back = -settings.jump_back <= span * NANO < 0.0
    if then is not None and is_back and np.array_equal(then, values):
        return Verdict(Action.REFUSE, "late")
    is_late = is_back and (then is None or _is_close(values, then, run.interval, limits))
    event = line.hold(sample, "late" if is_late else "leap", _is_apart(sample, line, limits))
    if not line.is_confirmed(limits.gap if is_late or line.is_second else 0.0):
        return Verdict(Action.HOLD, event)
    (first, _), (later, _) = line.held[:2]
    step, apart = (first.stamp - run.newest) * NANO, (later.stamp - first.stamp) * NANO
    why = _explain(boom, run.strokes, (zeroed(first), zeroed(later)), step, apart, line.usual * NANO or apart, settings, limits)
    is_recent = run.is_again and run.newest - run.epoch < SECOND
    is_in_time = 0 < first.stamp - run.newest <= limits.gap  # no clock and no pause: all strokes jumped at once
    needed = SECOND if is_recent or is_in_time or line.is_second else limits.gap
    if why is TimeStep.NEITHER and not line.is_confirmed(needed):
        return Verdict(Action.HOLD, event)
    return Verdict(Action.STEP, why=why)


def _is_apart(sample: Sample, line: StampCheck, limits: Limits) -> bool:
    """Return True if some cylinder could not have reached these strokes from the held ones at its maximum speed."""
    if not line.held:
        return False
    last = line.held[-1][0]
    return _largest_difference(sample.values, last.values) > limits.far + limits.rate * abs(sample.stamp - last.stamp) * NANO
