"""Measured natural frequencies and damping while the boom stood still, beside the model's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.posture_modes import ModeList, nearest_mode
from ..analysis.sample_series import ORDER, Vibration, free_vibrations, is_free, spacing, unbroken
from ..plots import History
from ..scene.schema import Scene
from ..scene.summary import weight_of
from ..types import Array, Stream, stream_of

STILL_SPEED = 1e-3  # m/s of a stroke, above which a boom does not stand still
SPEED_SPAN = 0.2  # s over which that speed is taken
SHORTEST_REST = 3.0  # s; shorter rest periods are not evaluated
EVALUATED = 60.0  # s of a rest period that are evaluated; free vibration has died away then, and memory goes by its square


def vibrations(times: Array, values: Array) -> list[Vibration]:
    """Return the modes by frequency in `values` (k, c) at `times` (k,) in s; none of less than a second or two.

    Samples are averaged at even times first: means of a decaying vibration have the same frequency and damping. A filter would
    spoil the ends.
    """
    rate = 40.0  # Hz, to which samples are thinned out
    columns = [column for column in values.T if 2 * np.isfinite(column).sum() > len(column)]
    if len(times) < 2 or not columns:
        return []
    interval = spacing(times)
    even = np.arange(times[0], times[-1], interval)
    rows = np.stack([np.interp(even, times[np.isfinite(c)], c[np.isfinite(c)]) for c in columns], axis=1)
    step = max(1, round(1.0 / (rate * interval)))
    if len(rows) < 3 * ORDER * step:
        return []
    whole = len(rows) // step * step
    return free_vibrations(step * interval, rows[:whole].reshape(-1, step, rows.shape[1]).mean(axis=1))


@dataclass(frozen=True, slots=True)
class RestPeriod:
    """Rest period (s since the first sample): the model's frequencies (Hz), and by mode what was measured.

    `measured` is empty if a load excited the boom, because the lines of a pump are no natural frequencies.
    """

    start: float
    stop: float
    model: list[float]
    measured: dict[int, Vibration]
    is_shaken: bool


class RestFinder:
    """Search for the rest periods that last `SHORTEST_REST`; of a long one, `EVALUATED` seconds are used."""

    def __init__(self, scene: Scene) -> None:
        shaking_load = 0.003  # share of the boom's weight: standard deviation of a load at the tip that shakes the boom
        self._modes, self._least_load = ModeList(scene), shaking_load * weight_of(scene)

    def find(self, history: History, load: Array) -> list[RestPeriod]:
        """Return the rest periods in the rows of a part of a session. One that goes on in the next part is another one there.

        `load`, shape (rows, 2), is the estimated load at the tip (N), NaN without sensors.
        """
        times, motion = history.stamps_s, measured_motion(history)
        spans = [span for part in unbroken(times) for span in still(times[part], history.strokes[part])]
        return [
            self._rest(start, min(stop, start + EVALUATED), history, load, motion)
            for start, stop in spans
            if stop - start >= SHORTEST_REST
        ]

    def _rest(self, start: float, stop: float, history: History, load: Array, motion: tuple[Array, Array]) -> RestPeriod:
        cycle_sigma = 0.02  # largest deviation of a frequency, in cycles of the rest period; in noise alone about 0.2
        rows, inside = ((times >= start) & (times < stop) for times in (history.stamps_s, motion[0]))
        model = self._modes.at(np.median(history.strokes[rows], axis=0).tolist())
        if float(np.hypot(*load[rows].std(axis=0))) > self._least_load:
            return RestPeriod(start, stop, model, {}, True)
        found = [each for each in vibrations(motion[0][inside], motion[1][inside]) if is_free(each)]
        certain = [each for each in found if each.frequency_sigma * (stop - start) < cycle_sigma]
        return RestPeriod(start, stop, model, _by_mode(certain, model), False)


def still(times: Array, strokes: Array) -> list[tuple[float, float]]:
    """Return begin and end (s) of the intervals in which no stroke (k, n) was faster than `STILL_SPEED`."""
    if len(times) < 2:
        return []
    half = SPEED_SPAN / 2
    before, after = (np.clip(np.searchsorted(times, times + way), 0, len(times) - 1) for way in (-half, half))
    span = np.maximum(times[after] - times[before], 1e-9)
    calm = np.abs(strokes[after] - strokes[before]).max(axis=1) < STILL_SPEED * span
    edges = np.flatnonzero(np.diff(np.concatenate([[0], calm.astype(int), [0]])))
    return [(float(times[a]), float(times[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def measured_motion(history: History) -> tuple[Array, Array]:
    """Return times (k,) in s and the IMU's specific force (k, 2) in m/s^2, or without one the angles (k, n) in rad."""
    if history.imu is not None:
        return history.imu.stamps_s, history.imu.measured
    angles = [trace for name, trace in history.residuals.items() if stream_of(name) is Stream.ANGLES]
    if not angles:
        return np.zeros(0), np.zeros((0, 0))
    left = np.column_stack([trace.values for trace in angles])
    there = np.isfinite(left).any(axis=1)
    times = angles[0].stamps_s[there]
    return times, left[there] + np.column_stack([np.interp(times, history.stamps_s, each) for each in history.joints.T])


def _by_mode(found: list[Vibration], model: list[float]) -> dict[int, Vibration]:
    near: dict[int, Vibration] = {}
    for each in found:
        mode = nearest_mode(each.frequency, model)
        if mode is not None and (mode not in near or each.frequency_sigma < near[mode].frequency_sigma):
            near[mode] = each
    return near
