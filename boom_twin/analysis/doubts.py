"""Reasons to doubt a result: estimated errors of a simulated motion, ringing, deflections beyond the model's validity.

While stepping, the changes of the tip's acceleration give the error of its place (`step_error_warning`). The same motion run
again gives errors of acceleration and forces too: a finer step shows what stepping adds, every second row of the drive what
the curve between the rows adds (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, 1993, section II.4).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..config.settings import STROKE_RATE
from ..errors import UsageError
from ..kernels.result_row import Results
from ..kernels.tables import OK
from ..scene.checks.geometry import LEVER, TRANSMISSION_DEG
from ..scene.kinematics import RANGE_SAMPLES, joint_angles_of_strokes, joint_curve, linkage, skeleton
from ..scene.schema import Scene
from ..types import Array
from .drive import DriveCourse, Run

COARSE = 0.01  # estimated error as a share of the tip's travel
SHORTEST_PATH = 1e-3  # m of travel that an error is measured against at least
RINGING = 1.0  # sum of the changes of acceleration over that of the accelerations: 2 if it changes sign from step to step


@dataclass(frozen=True)
class EstimatedError:
    """Estimated largest error of one quantity."""

    what: str  # the quantity
    share: float  # its error, as a share of `of`
    of: str  # what it is measured against
    bound: float  # share above which it is doubted
    time: float  # when it is largest, s

    def __str__(self) -> str:
        share = f"about {self.share:.1%}" if self.share < 1.0 else "100 % or more"
        return f"{self.what} may be off by {share} of {self.of} at t = {self.time:g} s (bound {self.bound:.0%})"


def step_error_warning(jolt: float, shake: float, travel: float, square: float) -> str:
    """Return a warning with its remedy, or nothing.

    One step of a second-order scheme errs by about h^2/12 |a' - a|. For `jolt`, `shake` (m) see
    `kernels.transfer.time_step.run`; `travel` is how far the tip got (m), `square` the sum over all steps of h^2 (s^2).
    """
    share = jolt / 12.0 / max(travel, SHORTEST_PATH)
    for sentence in ringing(jolt, shake, square):
        return sentence
    if share > COARSE:
        return f"the step is coarse: the tip may be wrong by about {min(share, 1.0):.0%} of its path; take a smaller step"
    return ""


def warnings_of(deviations: Iterable[EstimatedError], cause: str, remedy: str) -> tuple[str, ...]:
    """A sentence for each deviation beyond its bound."""
    return tuple(f"{cause}: {deviation}; {remedy}" for deviation in deviations if not deviation.share <= deviation.bound)


def ringing(jolt: float, shake: float, square: float) -> tuple[str, ...]:
    """A sentence where the tip's acceleration changes sign from step to step; parameters as of `step_error_warning`."""
    quiet = 1e-3  # m/s^2, mean acceleration below which ringing is rounding
    rings = jolt > RINGING * shake and shake > quiet * square
    sentence = "the accelerations change sign from step to step; take more numerical damping, a rho well below 1"
    return (sentence,) if rings else ()


def too_fast(times: Array, rates: Array) -> tuple[str, ...]:
    """A sentence for each stroke that is somewhere faster than `STROKE_RATE`; rates (m/s), shape (times, n)."""
    speeds = np.abs(rates)
    return tuple(
        f"stroke_{i + 1} moves at {speeds[row, i]:.3g} m/s at t = {times[row]:g} s, and no cylinder is faster than "
        f"{STROKE_RATE:g} m/s (stroke_rate); give strokes that a pump can make"
        for i, row in enumerate(speeds.argmax(axis=0))
        if speeds[row, i] > STROKE_RATE
    )


ACCELERATION, FORCE = 0.05, 0.02  # bounds of the error of acceleration and force, as shares of the largest


def step_errors(course: DriveCourse, own: Run, dt: float) -> tuple[EstimatedError, ...]:
    """Return the errors that steps of at most `dt` (s) added to the motion `own`; `differences` names the quantities."""
    by_steps = 2.0  # error over the change that a finer step makes; by halves 4/3 for smooth motions, 2 for impacts and kinks
    rows, finer = np.arange(len(course.times)), 8 if course.plan.pins else 2
    return _compared(course.times, own.rows, course.stepped(rows, dt, finer), by_steps)


def row_errors(course: DriveCourse, own: Run) -> tuple[EstimatedError, ...]:
    """Return the errors of the curve between the rows of the motion `own`; nothing for less than three rows.

    Odd and even rows are left out in turn, because a kink shows in one way only.
    """
    by_rows = 1.5  # error over the change that every second row makes: 1/3 for smooth drives, 1 and more at kinks
    last = len(course.times) - 1
    if last < 2:
        return ()
    found: list[tuple[EstimatedError, ...]] = []
    for first in (0, 1):
        rows = np.unique(np.concatenate([[0], np.arange(first, last, 2), [last]]))
        if len(rows) <= last:
            found.append(_compared(course.times[rows], own.rows.at(rows), course.stepped(rows, own.longest), by_rows))
    return tuple(max(pair, key=lambda deviation: deviation.share) for pair in zip(*found, strict=True))


def _compared(times: Array, found: Results, other: Run, factor: float) -> tuple[EstimatedError, ...]:
    if other.status == OK:
        return differences(times, found, other.rows, factor)
    return tuple(
        EstimatedError(what, math.inf, of, bound, float(times[other.row]))
        for what, of, bound in (TIP, TIP_ACCELERATION, ("the cylinders' forces", "their largest", FORCE))
    )


TIP = ("the tip", "its path", COARSE)
TIP_ACCELERATION = ("the tip's acceleration", "its largest", ACCELERATION)


def differences(times: Array, found: Results, other: Results, factor: float) -> tuple[EstimatedError, ...]:
    """Return errors of tip, its acceleration and the worst cylinder's force: `factor` times the difference to `other`.

    Both have rows at the same `times` (m,), s.
    """
    least_acceleration = 0.02  # m/s^2 that an error is measured against at least
    least_force = 0.01  # likewise, of the largest force of all cylinders
    (tip, acceleration), (place, rate) = ((rows.tip[:, 0, :2], rows.tip[:, 2, :2]) for rows in (found, other))
    path = max(float(_lengths(tip - tip[0]).max()), SHORTEST_PATH)
    largest = max(float(_lengths(acceleration).max()), least_acceleration)
    sizes = np.abs(found.cylinder_forces).max(axis=0)
    sizes = np.maximum(sizes, max(least_force * sizes.max(), 1.0))
    forces = np.abs(other.cylinder_forces - found.cylinder_forces) / sizes
    worst = int(np.argmax(forces.max(axis=0)))
    cylinder = (f"the force of cylinder {worst + 1}", "its largest", FORCE)
    return tuple(
        EstimatedError(what, factor * float(errors.max()), of, bound, float(times[int(np.argmax(errors))]))
        for (what, of, bound), errors in (
            (TIP, _lengths(place - tip) / path),
            (TIP_ACCELERATION, _lengths(rate - acceleration) / largest),
            (cylinder, forces[:, worst]),
        )
    )


def _lengths(vectors: Array) -> Array:
    return np.asarray(np.hypot(vectors[:, 0], vectors[:, 1]))


BEYOND = 1e-3  # rad beyond range_deg that are not reported


def joint_doubts(scene: Scene, times: Array, joints: Array) -> Iterator[str]:
    """Yield warnings of joints that leave their range_deg or come next to a dead centre.

    `joints` (m, n) are angles at `times` (m,), rad and s.
    """
    for i, (joint, angles) in enumerate(zip(scene.joints, joints.T, strict=True)):
        low, high = np.radians(joint.range_deg)
        beyond = np.maximum(low - angles, angles - high)
        if beyond.max() > BEYOND:
            row = int(beyond.argmax())
            yield (
                f"joint_{i + 1} is at {math.degrees(angles[row]):.4g} deg at t = {times[row]:g} s, outside its range_deg "
                f"{joint.range_deg[0]:g} to {joint.range_deg[1]:g}; give strokes that keep it inside"
            )
        own = linkage(scene, i)
        largest = float(np.nanmax(joint_curve(own, np.radians(np.linspace(*joint.range_deg, RANGE_SAMPLES))).levers))
        _, levers, between = joint_curve(own, angles)
        if np.nanmin(between) < TRANSMISSION_DEG:
            row = int(np.nanargmin(between))
            yield (
                f"joint_{i + 1} is next to a dead centre of its links at t = {times[row]:g} s: they meet at "
                f"{between[row]:.2g} deg (bound {TRANSMISSION_DEG:g}); forces of links and pins grow as 1/sin of that"
            )
        if np.nanmin(levers) < LEVER * largest:
            row = int(np.nanargmin(levers))
            yield (
                f"joint_{i + 1} is next to a dead centre of its cylinder at t = {times[row]:g} s: the lever is "
                f"{levers[row]:.3g} m (bound {LEVER * largest:.3g} m); its force grows as one over that"
            )


VALID_DEFLECTION = 0.5  # validity limit of the tip deflection, as a fraction of the boom's reach


def beyond_validity(scene: Scene, away: float) -> tuple[str, ...]:
    """Return a warning if the tip deflection `away` (m) exceeds the model's validity, else an empty tuple."""
    if away <= VALID_DEFLECTION * scene.reach:
        return ()
    return (
        f"the tip is {away:.3g} m from where rigid sections and cylinders would have it, more than half the reach of "
        f"{scene.reach:.3g} m: outside the model's validity. Check stiffnesses, masses and load",
    )


def motion_beyond_validity(scene: Scene, strokes: Array, tip: Array, angles: Array | None) -> tuple[str, ...]:
    """Return the warning of `beyond_validity` for the worst of some instants of `strokes` (m, n) and `tip` (m, 2), m."""
    checked_instants = 8  # evenly spaced instants of a motion to check; the tip's farthest point is added
    rows: NDArray[np.int64] = np.linspace(0, len(tip) - 1, checked_instants).astype(np.int64)
    rows = np.unique(np.append(rows, np.argmax(np.hypot(*(tip - tip[0]).T))))
    worst, near = 0.0, angles
    for row in rows:
        try:
            near = joint_angles_of_strokes(scene, strokes[row], near=near)
        except UsageError:  # within the cylinder's travel but outside the joint's range
            continue
        worst = max(worst, float(np.hypot(*(tip[row] - skeleton(scene, near).pivots[-1]))))
    return beyond_validity(scene, worst)
