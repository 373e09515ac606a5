"""Measured sessions as arrays, and their rest periods: times without an open valve, with the readings of all sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from heapq import merge
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..bag.advice import refuse_conflicts
from ..bag.reader import Session, files_sha256, scan
from ..bag.session_file import WHOLE, TimeWindow
from ..config.settings import Settings
from ..deviation.predictor import BoomPredictor
from ..errors import BagError, SolverError
from ..kernels.tables import OK, SENTENCES
from ..messages.topic_table import Topics
from ..offline.session_samples import SessionSamples
from ..scene.schema import Scene
from ..twin.blocks import CODES, SampleBlock, block_of
from ..types import NANO, SECOND, SENSORS, Array, Change, Mount, Place, Sample, Stream, StrokeReading, channels_of
from .rest_filter import note_drives

LOADS = ("payload", "line_fill")


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
    """One session."""

    name: str
    digest: str  # first digits of the SHA-256 of its files
    series: dict[Stream, Series]  # the streams that it has
    changed: bool = False  # a load or a zero was changed while it was recorded

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
    """Read sessions, the same window of each; BagError for one of another boom, without its strokes, or that cannot be read."""
    sessions = [scan(path) for path in paths]
    for session in sessions:
        refuse_conflicts(session, topics, joints)
    return [_measured(each, SessionSamples(each, topics, joints, window), joints) for each in sessions]


def _measured(session: Session, samples: SessionSamples, joints: int) -> MeasuredSession:
    blocks, changed = list[SampleBlock](), False
    for item in samples:
        if isinstance(item, Change):
            changed |= any(item.zeros.values()) or max(item.settings.get(load, -1.0) for load in LOADS) >= 0.0
        elif item is not None:
            blocks.append(item)
    whole, series = SampleBlock(*map(np.concatenate, zip(*blocks, strict=True))) if blocks else block_of([], joints), {}
    for stream, names in channels_of(joints).items():
        own = np.flatnonzero(whole.streams == CODES[stream])
        stamps, first = np.unique(whole.stamps[own], return_index=True)
        if len(own):
            series[stream] = Series(stamps, whole.values[own[first], : len(names)])
    if Stream.STROKES not in series:
        met = ", ".join(f"{name}: {count}" for name, count in samples.oddities.items()) or "nothing"
        raise BagError(
            f"{session.path}: no usable value of {SENSORS[Stream.STROKES].named}_1..{joints} (met: {met}). "
            "Is it a session of this boom? If its sensors have other names, give a mapping."
        )
    lacking = [f"cylinder_{i + 1}" for i in np.flatnonzero(np.isnan(series[Stream.STROKES].values).mean(axis=0) > 0.5)]
    if lacking:
        raise BagError(
            f"{session.path}: {', '.join(lacking)}: more than half of the values are missing. The scene has {joints} "
            "cylinders: give a session of this boom."
        )
    return MeasuredSession(session.path.resolve().name, files_sha256(session)[:12], series, changed)


STREAMS = (Stream.STROKES, Stream.ANGLES, Stream.IMU, Stream.FORCES)  # compared, in the order of the channels
LEAD, TAIL = 0.3, 0.4  # s, left out after valves closed, and before one is believed open
TRAVEL = 2e-4  # m, of a drive, which ends a rest period
SHORTEST, RESTED = 1.5, 5.0  # s, of a rest period, and of all of them


@dataclass(frozen=True)
class Rigging:
    """Mounts, measured quantities and noise of the sensors of the sessions."""

    settings: Settings
    mounts: tuple[Mount | None, ...]
    reads: StrokeReading
    places: Mapping[str, Place] = field(default_factory=dict)


@dataclass(frozen=True)
class RestPeriod:
    """Readings while no drive moves."""

    start: float  # s since the first stroke sample of the session
    times: Array  # (r,), s after the period began, ascending
    channels: NDArray[np.int64]  # (r,), places in `channel_names`
    values: Array  # (r,), SI; finite
    strokes: Array  # (n,), mean readings of the stroke transducers, m


def channel_names(joints: int) -> tuple[str, ...]:
    """Return the names of the channels that are compared."""
    return tuple(name for stream in STREAMS for name in channels_of(joints)[stream])


def rest_periods(
    session: MeasuredSession, scene: Scene, rigging: Rigging, until: int | None = None, needed: float = RESTED
) -> list[RestPeriod]:
    """Return the rest periods of a session up to the stamp `until` (ns).

    BagError if they last less than `needed` (s) in all, SolverError if the boom has no equilibrium at its strokes.
    """
    boom = BoomPredictor(scene, rigging.settings, rigging.mounts, rigging.reads, rigging.places)
    strokes = session.series[Stream.STROKES]
    if until is not None:
        strokes = strokes.of(0, until)
    found = [_period(session, *span) for part in _without_gaps(strokes) for span in _rests(boom, part)]
    rested = sum(float(period.times[-1]) for period in found)
    if rested < needed:
        raise BagError(
            f"{session.name}: the boom rests for {rested:.1f} s in the part that is fitted, in periods of {SHORTEST:g} s or "
            f"more; {needed:g} s are needed. Record a minute of moves with rests of 3 s and more between them."
        )
    return found


def _without_gaps(strokes: Series) -> list[Series]:
    """Return the stretches between gaps, each from its first complete reading on."""
    cuts = np.flatnonzero(np.diff(strokes.stamps) * NANO > 0.5) + 1  # s
    found = []
    for first, last in pairwise([0, *cuts, len(strokes.stamps)]):
        complete = np.flatnonzero(np.isfinite(strokes.values[first:last]).all(axis=1))
        if len(complete):
            found.append(Series(strokes.stamps[first + complete[0] : last], strokes.values[first + complete[0] : last]))
    return found


def _rests(boom: BoomPredictor, strokes: Series) -> list[tuple[int, int]]:
    boom.start(strokes.values[0], may_move=True)
    t, anchor, live, work, posture, filters, _, row = boom.compiled
    drives, opened = np.zeros(strokes.values.shape), np.zeros(len(strokes.stamps), np.bool_)
    given = strokes.stamps, strokes.values, np.array(boom.plan.tables.gravity), row, drives, opened
    status = note_drives(t, anchor, live, work, posture, filters, *given)
    if status != OK:
        raise SolverError(SENTENCES[int(status)])
    found, first = [], 0
    for k, is_open in enumerate([*opened.tolist(), True]):
        if is_open or np.abs(drives[k] - drives[first]).max() > TRAVEL:
            start = int(strokes.stamps[min(first, k - 1)]) + round(LEAD * SECOND)
            stop = int(strokes.stamps[k - 1]) - (round(TAIL * SECOND) if k < len(opened) else 0)
            if k > first and stop - start >= SHORTEST * SECOND:
                found.append((start, stop))
            first = k + 1 if is_open else k
    return found


def _period(session: MeasuredSession, start: int, stop: int) -> RestPeriod:
    stamps, channels, values, first = [], [], [], 0
    joints = session.series[Stream.STROKES].values.shape[1]
    for stream in STREAMS:
        width = len(channels_of(joints)[stream])
        if stream in session.series:
            part = session.series[stream].of(start, stop)
            stamps.append(np.repeat(part.stamps, width))
            channels.append(np.tile(np.arange(first, first + width), len(part.stamps)))
            values.append(part.values.ravel())
        first += width
    at, channel, value = (np.concatenate(each) for each in (stamps, channels, values))
    known = np.flatnonzero(np.isfinite(value))
    order = known[np.argsort(at[known], kind="stable")]
    mean = np.nanmean(session.series[Stream.STROKES].of(start, stop).values, axis=0)
    times: Array = np.asarray((at[order] - start) * NANO)
    begin = (start - int(session.series[Stream.STROKES].stamps[0])) * NANO
    return RestPeriod(begin, times, channel[order].astype(np.int64), value[order].astype(float), mean)
