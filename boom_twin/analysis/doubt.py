"""What gives reason to doubt a motion: a step too coarse, ringing, rows of the drive too far apart, strokes too fast.

Two estimates of errors: while stepping, the changes of the tip's acceleration give that of its place for nothing (`doubt`);
the same motion run again gives those of acceleration and forces too (`analysis.estimated_errors`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..records import Array

COARSE = 0.01  # estimated error as a share of the tip's travel
SHORTEST = 1e-3  # m of travel that an error is measured against at least
RINGING = 1.0  # sum of the changes of acceleration over that of the accelerations: 2 if it changes sign from step to step
QUIET = 1e-3  # m/s^2, mean acceleration below which ringing is rounding
STROKE_RATE = 0.5  # m/s, no cylinder is faster


@dataclass(frozen=True)
class EstimatedError:
    """Estimated largest error of one quantity.

    Attributes
    ----------
    what : str
        The quantity.
    share : float
        Its error, as a share of `of`.
    of : str
        What it is measured against.
    bound : float
        Share above which it is doubted.
    time : float
        When it is largest, s.
    """

    what: str
    share: float
    of: str
    bound: float
    time: float

    def __str__(self) -> str:
        share = f"about {self.share:.1%}" if self.share < 1.0 else "100 % or more"
        return f"{self.what} may be off by {share} of {self.of} at t = {self.time:g} s (bound {self.bound:.0%})"


def doubt(jolt: float, shake: float, travel: float, square: float) -> str:
    """A sentence with its remedy, or nothing.

    One step of a second-order scheme errs by about h^2/12 |a' - a|.

    Parameters
    ----------
    jolt, shake : float
        Sums over all steps of h^2 |a' - a| and of h^2 |a'| (m), as `chain.step.run` returns them.
    travel : float
        How far the tip got from where it started, m.
    square : float
        Sum over all steps of h^2, s^2.
    """
    share = jolt / 12.0 / max(travel, SHORTEST)
    for sentence in ringing(jolt, shake, square):
        return sentence
    if share > COARSE:
        return f"the step is coarse: the tip may be wrong by about {min(share, 1.0):.0%} of its path; take a smaller step"
    return ""


def told(deviations: Iterable[EstimatedError], cause: str, remedy: str) -> tuple[str, ...]:
    """A sentence for each deviation beyond its bound."""
    return tuple(f"{cause}: {deviation}; {remedy}" for deviation in deviations if not deviation.share <= deviation.bound)


def ringing(jolt: float, shake: float, square: float) -> tuple[str, ...]:
    """A sentence where the acceleration of the tip changes sign from step to step; parameters as those of `doubt`."""
    rings = jolt > RINGING * shake and shake > QUIET * square
    told = "the accelerations change sign from step to step; take more numerical damping, a rho well below 1"
    return (told,) if rings else ()


def too_fast(times: Array, rates: Array) -> tuple[str, ...]:
    """A sentence for each stroke that is somewhere faster than `STROKE_RATE`; rates (m/s), shape (times, n)."""
    speeds = np.abs(rates)
    return tuple(
        f"stroke_{i + 1} moves at {speeds[row, i]:.3g} m/s at t = {times[row]:g} s, and no cylinder is faster than "
        f"{STROKE_RATE:g} m/s (stroke_rate); give strokes that a pump can make"
        for i, row in enumerate(speeds.argmax(axis=0))
        if speeds[row, i] > STROKE_RATE
    )
