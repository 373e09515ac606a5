"""What is found in a block of readings, by plain numpy: the reference of `boom_twin.health.sensor_findings`."""

from __future__ import annotations

from typing import Any

import numpy as np

from boom_twin.health.sensor_findings import ENOUGH, JUMP, MEDIAN2, QUIET, REPEATS_FOR, SPIKE
from boom_twin.health.sensor_survey import GAP, LACK, LOUD, LOUDEST_USUAL, NOISE, PATIENCE, STATED
from boom_twin.types import Array


def bends2(values: Array) -> Array:
    """Squares of second differences of neighbours, shape (k - 2, ..); their mean is the variance of white noise."""
    return np.asarray(np.diff(values, 2, axis=0) ** 2 / 6.0)


def rough2(values: Array) -> Array:
    """Likewise of third differences, shape (k - 3, ..)."""
    return np.asarray(np.diff(values, 3, axis=0) ** 2 / 20.0)


def noise2(times: Array, values: Array) -> Array:
    """The less of `rough2` and of what is off a parabola through the times, by least squares; shape (k - 3, ..)."""
    found = np.empty((len(times) - 3, values.shape[1]))
    for t in range(len(found)):
        powers = np.vander((times[t : t + 4] - times[t + 3]) / (times[t + 3] - times[t]), 3)
        normal = np.linalg.qr(powers, mode="complete")[0][:, 3]
        found[t] = (normal @ values[t : t + 4]) ** 2
    return np.fmin(rough2(values), found)


def findings_of(known: Any, rows: int, now: float, is_known: bool, fastest: float) -> dict[str, list[float]]:
    """By kind of finding, of every channel, in a block of so many `rows`; of a jump how far."""
    times, raw, left = (column[: 3 + rows] for column in (known.times, known.raw, known.left))
    steps = np.where((np.diff(times) > known.limits[GAP])[:, None], np.nan, np.diff(left, axis=0))
    stated2 = known.limits[STATED]
    noise = np.sqrt(np.fmax(np.fmax(known.power, stated2), usual_noise2(times, left)))
    live = known.power > QUIET**2 * stated2
    repeated = (known.run >= known.limits[PATIENCE]) & (times[-1] - known.since >= REPEATS_FOR)
    found = {
        "stuck": repeated & bool(len(live) > 1 and live.any()),
        "noise": is_known & (known.power > known.limits[LOUD] * min(known.lately[NOISE], known.limits[LOUDEST_USUAL])),
        "spikes": is_known & spikes(steps, noise),
        "jump": jumps(times, raw, left, steps, noise, fastest),
        "dropout": (now - known.heard > known.limits[GAP]) | (known.missing > known.limits[LACK]),
        "range": known.outside > 0.5 * rows,
    }
    return {kind: each.tolist() for kind, each in found.items()}


def usual_noise2(times: Array, left: Array) -> Array:
    """Variance (channels,) of the noise of readings (k, channels) by the median of `noise2`."""
    each = noise2(times, left)
    known = np.isfinite(each).sum(axis=0)
    middle = np.sort(each, axis=0)[np.maximum((known - 1) // 2, 0), np.arange(each.shape[1])]
    return np.asarray(np.where(known >= ENOUGH, middle / MEDIAN2, 0.0))


def spikes(steps: Array, noise: Array) -> Array:
    """A reading that leaves both neighbours the same way, while these agree; `steps` from each to the next."""
    out, back = steps[:-1], -steps[1:]
    least = np.minimum(np.abs(out), np.abs(back))
    return np.asarray(((least > SPIKE * noise) & (out * back > 0.0) & (np.abs(out - back) < 0.5 * least)).any(axis=0))


def jumps(times: Array, raw: Array, left: Array, steps: Array, noise: Array, fastest: float) -> Array:
    """How far readings changed from one to the next, for good, while the model did not; 0 where they did not."""
    step, measured = steps[1:-1], raw[2:-1] - raw[1:-2]
    lasting = 0.5 * (left[2:-1] + left[3:]) - 0.5 * (left[:-3] + left[1:-2])
    least = np.maximum(JUMP * noise, fastest * (times[2:-1] - times[1:-2])[:, None])
    sudden = (np.abs(measured) > least) & (np.abs(step) > least) & (np.abs(lasting) > 0.7 * np.abs(step))
    sudden &= np.maximum(np.abs(left[3:] - left[2:-1]), np.abs(left[1:-2] - left[:-3])) < 0.3 * np.abs(step)
    return np.asarray(np.where(sudden, step, 0.0).sum(axis=0))
