"""Measured sessions as arrays, with strokes smoothed forth and back on a uniform grid.

The filter is Butterworth's of third order run in both directions, so that its gain is 1 / (1 + (omega/omega_c)^6) without any
lag: its corner is that of a smoother of drives whose jerk is white, of the density `JERK`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from heapq import merge
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from ..bag.joint_names import refuse_other_names
from ..bag.reader import Session, check_topic, files_sha256, scan
from ..bag.time_window import WHOLE, TimeWindow
from ..config.settings import Settings
from ..errors import BagError
from ..messages.topic_table import Topics
from ..offline.reader_process import SampleReader
from ..types import NANO, SENSORS, Array, Change, Sample, Stream, channels_of
from .stroke_holds import held

NEEDED = (Stream.STROKES, Stream.ANGLES)  # streams without which nothing can be estimated
SHOWN = 12  # hex digits of a hash
LOADS = ("payload", "line_fill")
MISSING = 0.5  # largest share of values of a channel that may be missing


@dataclass(frozen=True)
class Series:
    """Samples of one stream: stamps (ns, ascending), shape (m,), and values (SI), shape (m, channels)."""

    stamps: NDArray[np.int64]
    values: Array

    def of(self, start: int, stop: int) -> Series:
        """Return the samples with stamps from `start` to `stop`."""
        inside = (self.stamps >= start) & (self.stamps <= stop)
        return Series(self.stamps[inside], self.values[inside])


@dataclass(frozen=True)
class MeasuredSession:
    """One session.

    Attributes
    ----------
    name : str
    digest : str
        First digits of the SHA-256 of its files.
    series : dict of Stream to Series
        The streams that it has.
    changed : bool
        Whether something was changed while it was recorded: a load, a zero.
    """

    name: str
    digest: str
    series: dict[Stream, Series]
    changed: bool = False

    def samples(self, zeros: Mapping[str, float] | None = None) -> list[Sample]:
        """Return all samples in the order of their stamps, strokes first, less the `zeros` by channel."""
        joints, streams = self.series[Stream.STROKES].values.shape[1], []
        for order, (stream, names) in enumerate(channels_of(joints).items()):
            if stream not in self.series:
                continue
            series, shift = self.series[stream], np.array([(zeros or {}).get(name, 0.0) for name in names])
            pairs = zip(series.stamps.tolist(), series.values - shift, strict=True)
            streams.append([(stamp, order, Sample(stream, stamp, row)) for stamp, row in pairs])
        return [sample for _, _, sample in merge(*streams, key=lambda item: item[:2])]


def read_sessions(paths: Sequence[Path], topics: Topics, joints: int, window: TimeWindow = WHOLE) -> list[MeasuredSession]:
    """Read sessions, all at once, the same window of each.

    Raises
    ------
    BagError
        One cannot be read, is of another boom, or lacks strokes or angles of this one.
    """
    sessions = [scan(path) for path in paths]
    for session in sessions:
        refuse_other_names(session, topics, joints)
    wanted = [_wanted(session, topics) for session in sessions]
    with ExitStack() as stack:
        readers = []
        for session, names in zip(sessions, wanted, strict=True):
            readers.append(SampleReader(session.path, topics, names, joints, window))
            stack.callback(readers[-1].stop)
        return [_measured(session, reader, joints) for session, reader in zip(sessions, readers, strict=True)]


def _wanted(session: Session, topics: Topics) -> list[str]:
    """Return the topics of the streams of `NEEDED`, which must be there, and of the others if they are."""
    names = []
    for stream in Stream:
        topic = topics.inputs[stream]
        found = session.find(topic.name)
        if stream in NEEDED:
            check_topic(session, topic.name, topic.type)
        if stream in NEEDED or (found is not None and found.count):
            names.append(topic.name)
    return list(dict.fromkeys(names))


def _measured(session: Session, samples: SampleReader, joints: int) -> MeasuredSession:
    found: dict[Stream, list[Sample]] = {stream: [] for stream in Stream}
    changed = False
    samples.wait_ready()
    for sample in samples.samples():
        if isinstance(sample, Change):
            changed |= any(sample.zeros.values()) or max(sample.settings.get(load, -1.0) for load in LOADS) >= 0.0
        elif sample is not None:
            found[sample.stream].append(sample)
    series = {stream: _series(group) for stream, group in found.items() if group}
    for stream in NEEDED:
        if stream not in series:
            raise BagError(
                f"{session.path}: no usable value of {SENSORS[stream].named}_1..{joints} (met: {_told(samples)}). "
                "Is it a session of this boom? If its sensors have other names, give a mapping."
            )
    lacking = [f"cylinder_{i + 1}" for i in np.flatnonzero(np.isnan(series[Stream.STROKES].values).mean(axis=0) > MISSING)]
    if lacking:
        raise BagError(
            f"{session.path}: {', '.join(lacking)}: more than half of the values are missing. The scene has {joints} "
            "cylinders: give a session of this boom."
        )
    return MeasuredSession(session.path.resolve().name, files_sha256(session)[:SHOWN], series, changed)


def _series(samples: list[Sample]) -> Series:
    """Return samples by stamp, the first of equal ones."""
    stamps, first = np.unique(np.array([sample.stamp for sample in samples]), return_index=True)
    return Series(stamps, np.array([samples[i].values for i in first]))


def _told(samples: SampleReader) -> str:
    return ", ".join(f"{name}: {count}" for name, count in samples.oddities.items()) or "nothing"


LARGEST_GAP = 0.5  # s between strokes; a session is used from one such gap to the next
REST, SPEED = 1.0, 1e-3  # a course starts where no stroke has gone faster (m/s) than this for so long (s)
SHORTEST = 15.0  # s
HIGHEST = 0.4  # of the grid's frequency, bound of the corner
GRID = 0.005  # s, of the grid on which sessions are compared
JERK = 4e-4  # m^2/s^5, density of the jerk of a drive in a calm move
BAND = 5.0 * math.pi / 9.0  # integral of the gain's square over frequencies of both signs, over the corner


@dataclass(frozen=True)
class SessionCourse:
    """Strokes of a stretch of a session on a uniform grid.

    Attributes
    ----------
    start : int
        Stamp of its first instant, ns.
    step : float
        s.
    strokes : ndarray, shape (m, n)
        As measured, smoothed; m.
    stamps : ndarray of int
        Of the samples that it was made from.
    corner : float
        Of the smoothing, Hz.
    moving : ndarray, shape (m, n)
        How much of the noise of smoothed strokes is in `strokes`: 1, or less where they hold (`stroke_holds`).
    """

    start: int
    step: float
    strokes: Array
    stamps: NDArray[np.int64]
    corner: float
    moving: Array

    @property
    def times(self) -> Array:
        """Times of the grid, s after `start`."""
        return np.asarray(self.step * np.arange(len(self.strokes)))

    @property
    def interval(self) -> float:
        """Usual time between samples, s."""
        return float(np.median(np.diff(self.stamps))) * NANO

    @property
    def duration(self) -> float:
        """Time from the first to the last instant, s."""
        return self.step * (len(self.strokes) - 1)

    def until(self, time: float) -> SessionCourse:
        """Return the part up to `time` (s)."""
        count = 1 + int(time / self.step)
        end = self.start + round(time / NANO)
        return SessionCourse(
            self.start, self.step, self.strokes[:count], self.stamps[self.stamps <= end], self.corner, self.moving[:count]
        )

    def smoothed(self, values: Array) -> Array:
        """Return values at `stamps`, shape (k, ..), interpolated and smoothed on the grid, shape (m, ..)."""
        at: Array = np.asarray((self.stamps - self.start) * NANO)
        return smoothed(_on_grid(at, values, self.times), self.step, self.corner)

    def held(self, variance: float) -> SessionCourse:
        """Return the course with strokes, measured with `variance` (m^2), at their means in rest periods."""
        deviation = math.sqrt(variance * self.interval * BAND * self.corner)
        strokes, moving = held(self.strokes, deviation, self.step)
        return replace(self, strokes=strokes, moving=moving)


def course_of(session: MeasuredSession, settings: Settings) -> SessionCourse:
    """Return the longest stretch of a session without a gap, from where the boom rests.

    Raises
    ------
    BagError
        There is none that is long enough.
    """
    series = _longest(session.series[Stream.STROKES])
    times: Array = np.asarray((series.stamps - series.stamps[0]) * NANO)
    step = GRID
    grid: Array = np.asarray(step * np.arange(int(times[-1] / step) + 1))
    refuse_short(session.name, float(grid[-1]), "without a gap in the strokes")
    noise = settings.stroke_variance * float(np.median(np.diff(times)))  # density, m^2 s
    corner = min((JERK / noise) ** (1.0 / 6.0) / (2.0 * np.pi), HIGHEST / step)
    moved = smoothed(_on_grid(times, filled(times, series.values), grid), step, corner)
    first = _rest(np.abs(np.gradient(moved, step, axis=0)).max(axis=1), round(REST / step))
    if first is None:
        raise BagError(f"{session.name}: the boom never rests for {REST:g} s, where a calibration starts. Record a hold first.")
    refuse_short(session.name, step * (len(grid) - 1 - first), "from the first rest on")
    start = int(series.stamps[0] + round(grid[first] / NANO))
    return SessionCourse(
        start, step, moved[first:], series.stamps[series.stamps >= start], corner, np.ones(moved[first:].shape)
    )


def refuse_short(name: str, duration: float, where: str) -> None:
    """Raise BagError for a stretch that is too short."""
    if duration < SHORTEST:
        raise BagError(
            f"{name}: {duration:.1f} s {where}, {SHORTEST:g} s are needed. Record a minute with moves that change loads."
        )


def _on_grid(times: Array, values: Array, grid: Array) -> Array:
    """Return values (k, ..) at `times`, interpolated linearly on `grid`, shape (m, ..)."""
    columns = [np.interp(grid, times, column) for column in values.reshape(len(values), -1).T]
    return np.asarray(np.column_stack(columns).reshape(len(grid), *values.shape[1:]))


def smoothed(values: Array, step: float, corner: float) -> Array:
    """Return values (m, ..) on a grid of `step` (s), smoothed forth and back up to `corner` (Hz)."""
    sections = butter(3, corner, fs=1.0 / step, output="sos")
    padding = min(len(values) - 1, round(1.0 / (corner * step)))
    return np.asarray(sosfiltfilt(sections, values, axis=0, padtype="even", padlen=padding))


def _longest(series: Series) -> Series:
    """Return the longest stretch between gaps."""
    cuts = np.flatnonzero(np.diff(series.stamps) * NANO > LARGEST_GAP) + 1
    bounds = np.concatenate([[0], cuts, [len(series.stamps)]])
    lengths = [series.stamps[b - 1] - series.stamps[a] for a, b in pairwise(bounds)]
    first = int(np.argmax(lengths))
    part = slice(int(bounds[first]), int(bounds[first + 1]))
    return Series(series.stamps[part], series.values[part])


def filled(times: Array, values: Array) -> Array:
    """Return values (m, c) at `times` (m,) with missing ones interpolated linearly; a column without any stays."""
    columns = values.T.copy()
    for column in columns:
        known = np.isfinite(column)
        if known.any():
            column[~known] = np.interp(times[~known], times[known], column[known])
    return np.asarray(columns.T)


def _rest(speeds: Array, count: int) -> int | None:
    """Return the first place from which `count` speeds in a row are low."""
    fast = np.concatenate([[0], np.cumsum(speeds > SPEED)])
    quiet = np.flatnonzero(fast[count:] == fast[:-count])
    return int(quiet[0]) if len(quiet) else None
