"""Recording of a replay: everything that was predicted, as arrays."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..health.alarms import Alarms
from ..twin.blocks import CODES, PredictionBlock, ReportBlock, joined, report_block
from ..types import HELD, NANO, Alarm, Array, Health, Report, Stream, channels_of


class ResidualRows(NamedTuple):
    """Residuals of one stream.

    Attributes
    ----------
    names : tuple of str
        Of its channels.
    stamps : ndarray of int64, shape (k,)
        Nanoseconds.
    values, sigmas : ndarray, shape (k, channels)
        Measured minus predicted in the unit of the sensor, NaN where not measured; standard deviation expected of it.
    """

    names: tuple[str, ...]
    stamps: NDArray[np.int64]
    values: Array
    sigmas: Array

    @property
    def normalised(self) -> Array:
        """Residuals over their expected standard deviations, shape (k, channels)."""
        return self.values / self.sigmas


class Recording:
    """Everything a replay predicted, in the order of the session.

    Parameters
    ----------
    joints : int
        Of the boom.

    Attributes
    ----------
    gaps, clock_sets : list of (int, int)
        Stamps (ns) between which strokes paused; stamps before and after a clock was set.
    health : list of Health
    refused : int
        Samples that were not used.
    """

    def __init__(self, joints: int) -> None:
        self._joints = joints
        self._parts: list[ReportBlock] = []
        self._single: list[Report] = []
        self._newest: int | None = None
        self.gaps: list[tuple[int, int]] = []
        self.clock_sets: list[tuple[int, int]] = []
        self.health: list[Health] = []
        self.refused = 0

    def add(self, found: ReportBlock | Report) -> None:
        """Keep what samples caused."""
        if isinstance(found, Report):
            self._add_one(found)
            return
        self._close_single()
        self._parts.append(found)
        if len(found.predictions.stamps):
            self._newest = int(found.predictions.stamps[-1])
        self.health += found.health.values()

    @property
    def is_empty(self) -> bool:
        """Whether nothing was predicted yet."""
        return self._newest is None

    def _add_one(self, report: Report) -> None:
        self.refused -= len(report.earlier)
        for each in report.earlier:
            self._add_one(each)
        if not report.accepted or not HELD.isdisjoint(report.events):
            self.refused += 1
        if report.prediction is not None:
            self._note_time(report)
            self._newest = report.stamp
        if report.health is not None:
            self.health.append(report.health)
        self._single.append(report)

    def _note_time(self, report: Report) -> None:
        """Keep where stamps stepped: the one before, and the one after it."""
        for found, events in ((self.gaps, ("gap", "restart")), (self.clock_sets, ("clock set", "jump back"))):
            if self._newest is not None and not set(events).isdisjoint(report.events):
                found.append((self._newest, report.stamp))

    def _close_single(self) -> None:
        if self._single:
            self._parts.append(report_block(self._single, self._joints))
            self._single = []

    @cached_property
    def _all(self) -> ReportBlock:
        self._close_single()
        return joined([part for part in self._parts if len(part.predictions.stamps) or len(part.residuals.stamps)])

    @property
    def predictions(self) -> PredictionBlock:
        """All predictions, once the replay has ended."""
        return self._all.predictions

    def of(self, stream: Stream) -> ResidualRows:
        """Residuals of one stream, once the replay has ended."""
        rows, names = self._all.residuals, channels_of(self._joints)[stream]
        own = rows.streams == CODES[stream]
        return ResidualRows(names, rows.stamps[own], rows.values[own, : len(names)], rows.sigmas[own, : len(names)])

    @property
    def duration(self) -> float:
        """From the first prediction to the last, s, by the model's own time: without what clocks were set by."""
        span = int(self.predictions.stamps[-1] - self.predictions.stamps[0])
        return (span - sum(after - before for before, after in self.clock_sets)) * NANO

    @property
    def by_first_clock(self) -> slice:
        """Rows of the predictions before a clock was set: their stamps tell the time since the first one."""
        if not self.clock_sets:
            return slice(None)
        before, after = self.clock_sets[0]
        stamps = self.predictions.stamps
        return slice(int(np.flatnonzero((stamps[:-1] == before) & (stamps[1:] == after))[0]) + 1)

    def alarms(self) -> list[Alarm]:
        """All alarms, each once, as it was told last; in the order of their beginning."""
        found = Alarms()
        for health in self.health:
            found.take(health)
        return sorted(found.all, key=lambda alarm: alarm.since)

    def lost_contacts(self) -> NDArray[np.int64]:
        """How often each pin with clearance touched at one prediction and not at the next, shape (k,)."""
        parted = np.diff(self.predictions.clearances[:, :, 3], axis=0) < 0.0
        return np.asarray(parted.sum(axis=0))
