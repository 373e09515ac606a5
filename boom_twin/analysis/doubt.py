"""What gives reason to doubt a motion: a step too coarse, ringing, rows of the drive too far apart, strokes too fast.

Two estimates of errors. While stepping, the changes of the tip's acceleration give that of its place for nothing (`doubt`).
A second run gives that of acceleration and forces too (`differences`): with half the step what steps add, by every second row
of the drive what the curve between the rows adds (Richardson's extrapolation; Hairer, Norsett and Wanner, Solving Ordinary
Differential Equations I, II.4).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..records import Array
from .rows import Rows

COARSE = 0.01  # estimated error as a share of the tip's travel
SHORTEST = 1e-3  # m of travel that an error is measured against at least
RINGING = 1.0  # sum of the changes of acceleration over that of the accelerations: 2 if it changes sign from step to step
QUIET = 1e-3  # m/s^2, mean acceleration below which ringing is rounding

ACCELERATION, FORCE = 0.05, 0.02  # bounds of the error of acceleration and force, as shares of the largest
LEAST_ACCELERATION = 0.02  # m/s^2 that an error is measured against at least
LEAST_FORCE = 0.01  # likewise, of the largest force of all cylinders
FIRST_ORDER = 2.0  # error over the change that half the step makes: 4/3 for smooth motions, 2 for impacts and kinks
ROWS_ORDER = 1.0  # error over the change that every second row makes
STROKE_RATE = 0.5  # m/s, no cylinder is faster


@dataclass(frozen=True)
class Deviation:
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
    if rings(jolt, shake, square):
        return "the accelerations change sign from step to step; take more numerical damping, a rho well below 1"
    if share > COARSE:
        return f"the step is coarse: the tip may be wrong by about {min(share, 1.0):.0%} of its path; take a smaller step"
    return ""


def differences(times: Array, found: Rows, other: Rows, factor: float) -> tuple[Deviation, ...]:
    """Errors of the tip's place, its acceleration and the worst cylinder's force: `factor` times what `other` differs by.

    Parameters
    ----------
    times : ndarray, shape (m,)
        Of the rows, which are the same instants in both.
    """
    tip, acceleration = found.tip[:, 0, :2], found.tip[:, 2, :2]
    sizes = np.abs(found.cylinder_forces).max(axis=0)
    sizes = np.maximum(sizes, max(LEAST_FORCE * sizes.max(), 1.0))
    forces = factor * np.abs(other.cylinder_forces - found.cylinder_forces) / sizes
    worst = int(np.argmax(forces.max(axis=0)))
    return (
        _largest("the tip", times, factor * _lengths(other.tip[:, 0, :2] - tip), _lengths(tip - tip[0]), SHORTEST,
                 "its path", COARSE),
        _largest("the tip's acceleration", times, factor * _lengths(other.tip[:, 2, :2] - acceleration),
                 _lengths(acceleration), LEAST_ACCELERATION, "its largest", ACCELERATION),
        _largest(f"the force of cylinder {worst + 1}", times, forces[:, worst], np.ones(1), 1.0, "its largest", FORCE),
    )  # fmt: skip


def told(deviations: Iterable[Deviation], cause: str, remedy: str) -> tuple[str, ...]:
    """A sentence for each deviation beyond its bound."""
    return tuple(f"{cause}: {deviation}; {remedy}" for deviation in deviations if not deviation.share <= deviation.bound)


def rings(jolt: float, shake: float, square: float) -> bool:
    """Whether the acceleration of the tip changes sign from step to step; parameters as those of `doubt`."""
    return jolt > RINGING * shake and shake > QUIET * square


def too_fast(times: Array, rates: Array) -> tuple[str, ...]:
    """A sentence for each stroke that is somewhere faster than `STROKE_RATE`; rates (m/s), shape (times, n)."""
    speeds = np.abs(rates)
    return tuple(
        f"stroke_{i + 1} moves at {speeds[row, i]:.3g} m/s at t = {times[row]:g} s, and no cylinder is faster than "
        f"{STROKE_RATE:g} m/s (stroke_rate); give strokes that a pump can make"
        for i, row in enumerate(speeds.argmax(axis=0))
        if speeds[row, i] > STROKE_RATE
    )


def _largest(what: str, times: Array, errors: Array, sizes: Array, least: float, of: str, bound: float) -> Deviation:
    row = int(np.argmax(errors))
    return Deviation(what, float(errors[row] / max(sizes.max(), least)), of, bound, float(times[row]))


def _lengths(vectors: Array) -> Array:
    return np.asarray(np.hypot(vectors[:, 0], vectors[:, 1]))
