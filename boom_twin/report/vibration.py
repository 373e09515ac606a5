"""Measured natural frequencies and damping while the boom stood still, beside the model's."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from ..analysis.even_times import spacing, unbroken
from ..analysis.free_vibration import ORDER, Vibration, free_vibrations, is_free
from ..analysis.posture_modes import ModeList
from ..plots import History
from ..scene.schema import Scene
from ..scene.summary import weight_of
from ..types import Array, Stream, stream_of

RATE = 40.0  # Hz, to which samples are thinned out


def vibrations(times: Array, values: Array) -> list[Vibration]:
    """Return the modes by frequency in `values` (k, c) at `times` (k,) in s; none of less than a second or two."""
    return free_vibrations(*_thinned(times, values))


def _thinned(times: Array, values: Array) -> tuple[float, Array]:
    """Return step (s) and values (n, c) at even times, each the mean of those in a step; no rows if there are too few.

    Means of a decaying vibration decay with the same frequency and damping. A filter would spoil the ends.
    """
    columns = [column for column in values.T if 2 * np.isfinite(column).sum() > len(column)]
    if len(times) < 2 or not columns:
        return 1.0, np.zeros((0, 1))
    interval = spacing(times)
    even = np.arange(times[0], times[-1], interval)
    rows = np.stack([np.interp(even, times[np.isfinite(c)], c[np.isfinite(c)]) for c in columns], axis=1)
    step = max(1, round(1.0 / (RATE * interval)))
    if len(rows) < 3 * ORDER * step:
        return 1.0, np.zeros((0, 1))
    whole = len(rows) // step * step
    return step * interval, rows[:whole].reshape(-1, step, rows.shape[1]).mean(axis=1)


PACE = 1e-3
"""m/s of every stroke, above which a boom does not stand still."""
OVER = 0.2
"""s over which the pace is taken."""
LEAST = 3.0
"""s; the shortest interval that is looked at."""
LONGEST = 60.0
"""s; the longest: free vibration has died away by then, and memory goes by the square of it."""
SHAKEN = 0.003  # of the boom's weight, standard deviation of a load at the tip that shakes the boom
NEAR = 0.2
"""A vibration belongs to the nearest mode of the model, if it is no further from it than this share."""
SURE = 0.02
"""Largest standard deviation of a frequency, in cycles over the stretch; in noise alone it is about 0.2."""
POINTS = 60
"""Most times at which the model's frequencies are told."""


@dataclass(frozen=True, slots=True)
class HoldInterval:
    """Rest period (s since the first sample): the model's frequencies (Hz), and by mode what was measured.

    `measured` is empty if a load excited the boom, because the lines of a pump are no natural frequencies.
    """

    start: float
    stop: float
    model: list[float]
    measured: dict[int, Vibration]
    is_shaken: bool


class HoldFinder:
    """Search for the rest periods of a session that last `LEAST`; of a long one, `LONGEST` is evaluated.

    Parameters
    ----------
    scene : Scene
    """

    def __init__(self, scene: Scene) -> None:
        self._modes, self._least_load = ModeList(scene), SHAKEN * weight_of(scene)
        self._found: list[HoldInterval] = []
        self._strokes = self._motion = self._load = _NOTHING  # times and values, from where an interval may have begun
        self._told_to = -inf  # s; end of an interval of `LONGEST`, which may go on

    def add(self, history: History, load: Array) -> None:
        """Add the next rows, all of them; a rest period that lasts to their end waits for those that follow.

        `load`, shape (rows, 2), is the estimated load at the tip (N), NaN without sensors that tell it.
        """
        self._strokes = _appended(self._strokes, (history.stamps_s, history.strokes))
        self._load = _appended(self._load, (history.stamps_s, load))
        self._motion = _appended(self._motion, measured_motion(history))
        waits_from = self._look(is_last=False)
        self._strokes, self._motion, self._load = (
            _from(rows, waits_from) for rows in (self._strokes, self._motion, self._load)
        )

    def finish(self) -> list[HoldInterval]:
        """Return all rest periods; to be called once, after the last `add`."""
        self._look(is_last=True)
        return self._found

    def _look(self, is_last: bool) -> float:
        """Evaluate the rest periods that have ended; return from where on (s) rows are still needed."""
        times, strokes = self._strokes
        if not len(times):
            return 0.0
        waits_from = float(times[-1]) - OVER
        for start, stop in [span for part in unbroken(times) for span in still(times[part], strokes[part], 0.0)]:
            is_open = not is_last and stop > times[-1] - OVER
            if start <= self._told_to:
                self._told_to = stop
            elif is_open and stop - start < LONGEST:
                waits_from = start - OVER
            elif stop - start >= LEAST:
                self._found.append(self._interval(start, min(stop, start + LONGEST)))
                self._told_to = stop if is_open else self._told_to
        return waits_from

    def _interval(self, start: float, stop: float) -> HoldInterval:
        (times, strokes), (moved, values) = self._strokes, self._motion
        inside, there = _between(times, start, stop), _between(moved, start, stop)
        model = self._modes.at(np.median(strokes[inside], axis=0).tolist())
        load = self._load[1][_between(self._load[0], start, stop)]
        if float(np.hypot(*load.std(axis=0))) > self._least_load:
            return HoldInterval(start, stop, model, {}, True)
        found = [each for each in vibrations(moved[there], values[there]) if is_free(each)]
        sure = [each for each in found if each.frequency_sigma * (stop - start) < SURE]
        return HoldInterval(start, stop, model, _by_mode(sure, model), False)


_NOTHING = np.zeros(0), np.zeros((0, 0))


def _appended(held: tuple[Array, Array], more: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return times and values with `more` appended; only `more` if its channels are others."""
    if held[1].shape[1] != more[1].shape[1]:
        return more
    return np.concatenate([held[0], more[0]]), np.concatenate([held[1], more[1]])


def _from(rows: tuple[Array, Array], start: float) -> tuple[Array, Array]:
    """Return times and values from `start` (s) on."""
    kept = rows[0] >= start
    return rows[0][kept], rows[1][kept]


def course(history: History, scene: Scene) -> tuple[Array, Array]:
    """Return times (k,) in s and the model's natural frequencies (k, modes) at these times; NaN without an equilibrium."""
    modes, count = ModeList(scene), len(history.stamps_s)
    places = np.unique(np.linspace(0, count - 1, min(count, POINTS)).astype(int))
    rows = [modes.at(history.strokes[place].tolist()) for place in places]
    table = np.full((len(rows), max(map(len, rows))), np.nan)
    for row, found in zip(table, rows, strict=True):
        row[: len(found)] = found
    return history.stamps_s[places], table


def still(times: Array, strokes: Array, least: float = LEAST) -> list[tuple[float, float]]:
    """Return begin and end (s) of intervals of at least `least` seconds in which no stroke (k, n) moved faster than `PACE`."""
    if len(times) < 2:
        return []
    before, after = (np.clip(np.searchsorted(times, times + half), 0, len(times) - 1) for half in (-OVER / 2, OVER / 2))
    span = np.maximum(times[after] - times[before], 1e-9)
    calm = np.abs(strokes[after] - strokes[before]).max(axis=1) < PACE * span
    edges = np.flatnonzero(np.diff(np.concatenate([[0], calm.astype(int), [0]])))
    spans = [(float(times[a]), float(times[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [(start, stop) for start, stop in spans if stop - start >= least]


def measured_motion(history: History) -> tuple[Array, Array]:
    """Return times (k,) and values (k, c): the IMU's specific force (m/s^2), or without one the angles (rad)."""
    if history.imu is not None:
        return history.imu.stamps_s, history.imu.measured
    places = [i for i, name in enumerate(history.residual_names) if stream_of(name) is Stream.ANGLES]
    there = np.isfinite(history.residual_values[:, places]).any(axis=1)
    times, left = history.residual_stamps_s[there], history.residual_values[there][:, places]
    predicted = [np.interp(times, history.stamps_s, history.joints[:, i]) for i in range(len(places))]
    return times, left + np.stack(predicted, axis=1) if places else left


def _between(times: Array, start: float, stop: float) -> np.ndarray:
    return np.asarray((times >= start) & (times < stop))


def _by_mode(found: list[Vibration], model: list[float]) -> dict[int, Vibration]:
    """Return the surest vibration near every mode."""
    near: dict[int, Vibration] = {}
    for each in found if model else ():
        mode = int(np.argmin(np.abs(np.array(model) - each.frequency)))
        is_near = abs(each.frequency - model[mode]) <= NEAR * model[mode]
        if is_near and (mode not in near or each.frequency_sigma < near[mode].frequency_sigma):
            near[mode] = each
    return near
