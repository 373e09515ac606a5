"""What a step of the strokes' stamps means, by where the strokes went on: a pause, a clock that was set, either, or neither."""

from __future__ import annotations

from enum import Enum

import numpy as np

from .following import Following
from .plausible import FAR
from .records import Array
from .settings import Settings

SHARE = 0.1  # of the fastest cylinder's way in a usual interval, by which strokes that go on may surprise
SURE = 3.0  # deviations by which a cylinder must be moving, to tell a pause from a clock that was set
RATIO = 10.0  # how much better strokes must fit where the usual interval would have put them, than after a pause
LONGEST = 1.0  # s for which a speed is taken to last


class TimeStep(Enum):
    """Why stamps stepped."""

    PAUSE = "pause"
    CLOCK = "clock"
    EITHER = "pause or clock"
    NEITHER = "neither"


def surprise(strokes: Array, expected: Array) -> float:
    """Largest difference of strokes, m; those that are missing do not count, and none at all is 0."""
    return float(np.fmax.reduce(np.abs(strokes - expected), initial=0.0))


def closeness(usual: float, settings: Settings) -> float:
    """How far strokes may be from where they are expected, m: noise, and some of what a usual interval (s) lets them move."""
    return float(FAR * settings.stroke_variance**0.5 + SHARE * settings.stroke_rate * usual)


def is_close(strokes: Array, expected: Array, usual: float, settings: Settings) -> bool:
    """Whether strokes (m) are where they are expected."""
    return surprise(strokes, expected) <= closeness(usual, settings)


def goes_on(boom: Following, before: Array, strokes: Array, span: float, usual: float, settings: Settings) -> bool:
    """Whether strokes (m) are where those of the newest sample, `before`, would be `span` s later."""
    return surprise(strokes, nearest(boom, before, strokes, span)) <= closeness(usual, settings)


def nearest(boom: Following, before: Array, strokes: Array, span: float) -> Array:
    """Where strokes would be `span` s later, from their estimates or from what was measured, whichever fits better; (n,) m."""
    now, later = boom.extrapolated(0.0), boom.extrapolated(span)
    other = later + np.where(np.isfinite(before), before - now, 0.0)
    return np.where(np.abs(strokes - other) < np.abs(strokes - later), other, later)


def explain(
    boom: Following, before: Array, strokes: tuple[Array, Array], span: float, apart: float, usual: float, settings: Settings
) -> TimeStep:
    """Tell why stamps stepped by `span` (s).

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
    """
    first, later = strokes
    after = ((first, usual), (later, usual + apart))
    miss = max(surprise(y, nearest(boom, before, y, time)) for y, time in after)
    fits = miss <= closeness(usual, settings)
    if not 0.0 < span <= settings.restart_gap:
        return TimeStep.CLOCK if fits else TimeStep.NEITHER
    if fits and RATIO * miss < boom.least_way(min(max(span - usual, 0.0), LONGEST), SURE):
        return TimeStep.CLOCK
    reach = FAR * settings.stroke_variance**0.5 + settings.stroke_rate * span
    if surprise(first, boom.extrapolated(0.0)) <= reach:
        return TimeStep.EITHER if fits else TimeStep.PAUSE
    return TimeStep.NEITHER


def jerk_densities(boom: Following, strokes: Array, span: float, settings: Settings) -> Array:
    """Of white jerk (n,), m^2/s^5, during a pause of `span` s: as expected, or more where `strokes` (m) after it show so."""
    shown = 20.0 * (strokes - boom.extrapolated(span)) ** 2 / span**5
    return np.asarray(np.fmax(shown, settings.jerk_density))
