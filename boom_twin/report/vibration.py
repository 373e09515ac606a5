"""Natural frequencies and damping as measured while the boom stood still, beside those of the model in the same postures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..monitor.modes import Modes
from ..records import Array
from ..scene.parts import Scene
from ..view import History
from .decay import Vibration, vibrations

PACE = 1e-3
"""m/s of every stroke, above which a boom does not stand still."""
OVER = 0.2
"""s over which the pace is taken."""
LEAST = 3.0
"""s; the shortest stretch that is looked at."""
NEAR = 0.2
"""A vibration belongs to the nearest mode of the model, if it is no further from it than this share."""
SURE = 0.02
"""Largest standard deviation of a frequency, in cycles over the stretch; in noise alone it is about 0.2."""
POINTS = 60
"""Most times at which the model's frequencies are told."""


@dataclass(frozen=True, slots=True)
class Hold:
    """A stretch (s since the first sample) of standing still; the model's frequencies (Hz), and by mode what was measured."""

    start: float
    stop: float
    model: list[float]
    measured: dict[int, Vibration]


def holds(history: History, scene: Scene) -> list[Hold]:
    """All stretches of a session in which the boom stood still for `LEAST`."""
    times, values = measured_motion(history)
    modes, found = Modes(scene), []
    for start, stop in still(history.stamps_s, history.strokes):
        inside, there = _between(history.stamps_s, start, stop), _between(times, start, stop)
        model = modes.at(np.median(history.strokes[inside], axis=0).tolist())
        sure = [each for each in vibrations(times[there], values[there]) if each.frequency_sigma * (stop - start) < SURE]
        found.append(Hold(start, stop, model, _by_mode(sure, model)))
    return found


def course(history: History, scene: Scene) -> tuple[Array, Array]:
    """Times (k,) in s and natural frequencies (k, modes) of the model in the postures then; NaN without an equilibrium."""
    modes, count = Modes(scene), len(history.stamps_s)
    places = np.unique(np.linspace(0, count - 1, min(count, POINTS)).astype(int))
    rows = [modes.at(history.strokes[place].tolist()) for place in places]
    table = np.full((len(rows), max(map(len, rows))), np.nan)
    for row, found in zip(table, rows, strict=True):
        row[: len(found)] = found
    return history.stamps_s[places], table


def still(times: Array, strokes: Array) -> list[tuple[float, float]]:
    """From and to (s) where no stroke (k, n) moved faster than `PACE`, for `LEAST` at least."""
    if len(times) < 2:
        return []
    before, after = (np.clip(np.searchsorted(times, times + half), 0, len(times) - 1) for half in (-OVER / 2, OVER / 2))
    span = np.maximum(times[after] - times[before], 1e-9)
    calm = np.abs(strokes[after] - strokes[before]).max(axis=1) < PACE * span
    edges = np.flatnonzero(np.diff(np.concatenate([[0], calm.astype(int), [0]])))
    spans = [(float(times[a]), float(times[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [(start, stop) for start, stop in spans if stop - start >= LEAST]


def measured_motion(history: History) -> tuple[Array, Array]:
    """Times (k,) and values (k, c): the IMU's specific force (m/s^2), or without one the angles (rad)."""
    if history.imu is not None:
        return history.imu.stamps_s, history.imu.measured
    places = [i for i, name in enumerate(history.residual_names) if name.startswith("joint_")]
    there = np.isfinite(history.residual_values[:, places]).any(axis=1)
    times, left = history.residual_stamps_s[there], history.residual_values[there][:, places]
    predicted = [np.interp(times, history.stamps_s, history.joints[:, i]) for i in range(len(places))]
    return times, left + np.stack(predicted, axis=1) if places else left


def _between(times: Array, start: float, stop: float) -> np.ndarray:
    return np.asarray((times >= start) & (times < stop))


def _by_mode(found: list[Vibration], model: list[float]) -> dict[int, Vibration]:
    """The surest vibration near every mode."""
    near: dict[int, Vibration] = {}
    for each in found if model else ():
        mode = int(np.argmin(np.abs(np.array(model) - each.frequency)))
        is_near = abs(each.frequency - model[mode]) <= NEAR * model[mode]
        if is_near and (mode not in near or each.frequency_sigma < near[mode].frequency_sigma):
            near[mode] = each
    return near
