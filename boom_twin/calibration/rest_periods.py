"""Rest periods of a session: when no valve is open, and what all sensors read meanwhile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..config.settings import Settings
from ..deviation.predictor import BoomPredictor
from ..errors import BagError, SolverError
from ..kernels.tables import OK, SENTENCES
from ..scene.schema import Scene
from ..types import NANO, SECOND, Array, Mount, Place, Stream, StrokeReading, channels_of
from .rest_filter import note_drives
from .sessions import MeasuredSession, Series

STREAMS = (Stream.STROKES, Stream.ANGLES, Stream.IMU, Stream.FORCES)  # compared, in the order of the channels
LEAD, TAIL = 0.3, 0.4  # s, left out after valves closed, and before one is believed open
TRAVEL = 2e-4  # m, of a drive, which ends a rest period
SHORTEST, NEEDED = 1.5, 5.0  # s, of a rest period, and of all of them
LARGEST_GAP = 0.5  # s between strokes, which ends a rest period


@dataclass(frozen=True)
class Rigging:
    """How the sensors of the sessions are mounted, what they read, and their noise."""

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
    session: MeasuredSession,
    scene: Scene,
    rigging: Rigging,
    until: int | None = None,
) -> list[RestPeriod]:
    """Return the rest periods of a session up to the stamp `until` (ns).

    BagError if it rests too little, SolverError if the boom has no equilibrium at its strokes.
    """
    boom = BoomPredictor(scene, rigging.settings, rigging.mounts, rigging.reads, rigging.places)
    strokes = session.series[Stream.STROKES]
    if until is not None:
        strokes = strokes.of(0, until)
    found = [_period(session, *span) for part in _without_gaps(strokes) for span in _rests(boom, part)]
    rested = sum(float(period.times[-1]) for period in found)
    if rested < NEEDED:
        raise BagError(
            f"{session.name}: the boom rests for {rested:.1f} s in the part that is fitted, in periods of {SHORTEST:g} s or "
            f"more; {NEEDED:g} s are needed. Record a minute of moves with rests of 3 s and more between them."
        )
    return found


def _without_gaps(strokes: Series) -> list[Series]:
    """Return the stretches between gaps, each from its first complete reading on."""
    cuts = np.flatnonzero(np.diff(strokes.stamps) * NANO > LARGEST_GAP) + 1
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
