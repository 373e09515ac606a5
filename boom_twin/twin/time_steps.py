"""Decide on a stroke sample whose stamp is not the next one: follow it, refuse it, hold it, or step in time with those held."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

import numpy as np

from ..config.settings import Settings
from ..deviation.predictor import BoomPredictor
from ..types import NANO, SECOND, Array, Sample
from .regular import SHORTEST_STEP
from .run import Run
from .stamp_check import StampCheck
from .state import Limits

SURPRISE = 0.1  # of the fastest cylinder's way in a usual interval, by which strokes that go on may surprise
MOVING = 3.0  # deviations by which a cylinder must be moving, to tell a pause from a clock that was set
CLEARER = 10.0  # how much better strokes must fit where the usual interval would have put them, than after a pause
LASTING_SPEED = 1.0  # s for which a speed is taken to last


class TimeStep(Enum):
    """Reason for a step in the stamps."""

    PAUSE = "pause"
    CLOCK = "clock"
    EITHER = "pause or clock"
    NEITHER = "neither"


def _largest_difference(strokes: Array, expected: Array) -> float:
    """Return the largest difference of strokes, m; missing strokes do not count, and 0 if all are missing."""
    return float(np.fmax.reduce(np.abs(strokes - expected), initial=0.0))


def _closeness(usual: float, limits: Limits) -> float:
    """Return the allowed difference of strokes from their expected values.

    It is the noise plus a share of the largest motion in a usual interval (s).
    """
    return float(limits.far + SURPRISE * limits.rate * usual)


def _is_close(strokes: Array, expected: Array, usual: float, limits: Limits) -> bool:
    """Return True if strokes (m) are at their expected values."""
    return _largest_difference(strokes, expected) <= _closeness(usual, limits)


def _is_continuous(boom: BoomPredictor, before: Array, strokes: Array, span: float, limits: Limits) -> bool:
    """Return True if strokes (m) continue the newest sample `before`, extrapolated by `span` (s)."""
    return _largest_difference(strokes, _nearest(boom, before, strokes, span)) <= _closeness(0.0, limits)


def _nearest(boom: BoomPredictor, before: Array, strokes: Array, span: float) -> Array:
    """Return the strokes extrapolated by `span` (s), shape (n,), m.

    Each starts from its estimate or from its newest measurement, whichever fits `strokes` better.
    """
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

    Parameters
    ----------
    sample : Sample
    line : StampCheck
        Of the strokes.
    run : Run
    boom : BoomPredictor
    limits : Limits
    settings : Settings
    zeroed : callable
        Returns the strokes of a sample less their zeros, m, shape (n,).
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
