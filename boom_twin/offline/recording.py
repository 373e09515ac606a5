"""Recording of a replay: predictions, a stretch of the session at a time, and totals of all stretches."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.sample_series import ColumnStatistics
from ..deviation.load_spectrum import TipLoadFinder
from ..health.alarms import Alarms
from ..twin.blocks import CODES, EstimateBlock, PredictionBlock, ReportBlock, SampleBlock, joined, report_block
from ..types import HELD, NANO, USUAL_STREAMS, Alarm, Array, Health, Report, Stream, StrokeReading, channels_of
from .ground_truth import TipErrors

STRETCH = 2**14  # predictions in a stretch, at least: 82 s at 200 Hz, some 30 MB


class ResidualRows(NamedTuple):
    """Residuals of one stream."""

    names: tuple[str, ...]  # of its channels
    stamps: NDArray[np.int64]  # ns; shape (k,)
    # values, sigmas: measured minus predicted in the unit of the sensor, NaN where not measured; standard deviation expected of
    # it; shape (k, channels)
    values: Array
    sigmas: Array

    @property
    def normalised(self) -> Array:
        """Residuals over their expected standard deviations, shape (k, channels)."""
        return self.values / self.sigmas


@dataclass(frozen=True)
class Stretch:
    """Part of a session: everything that was predicted in it."""

    joints: int  # of the boom
    block: ReportBlock
    health: list[Health]
    first: int  # stamp of the first prediction of the session, ns
    samples: list[SampleBlock]  # read meanwhile
    reads: StrokeReading  # of the strokes of the predictions
    streams: Collection[Stream]  # of the session's sensors

    @property
    def predictions(self) -> PredictionBlock:
        """All predictions of the stretch."""
        return self.block.predictions

    @property
    def estimates(self) -> EstimateBlock:
        """Estimates beside the predictions."""
        return self.block.estimates

    def of(self, stream: Stream) -> ResidualRows:
        """Return the residuals of one stream."""
        rows, names = self.block.residuals, channels_of(self.joints)[stream]
        own = rows.streams == CODES[stream]
        return ResidualRows(names, rows.stamps[own], rows.values[own, : len(names)], rows.sigmas[own, : len(names)])


class SessionTotals:
    """Totals of all predictions and residuals of a session; the values themselves are not kept.

    Attributes
    ----------
    acceleration : float
        The largest of the tip, m/s^2.
    residuals, normalised : ColumnStatistics
        Of the joints: rad, and over the expected deviations.
    tip_sigmas : ndarray, shape (2,)
        Largest standard deviation of the predicted tip's x and y, m; NaN if nothing is known of it.
    """

    def __init__(self, joints: int) -> None:
        self.samples, self.acceleration = 0, 0.0
        self.residuals, self.normalised = ColumnStatistics(joints), ColumnStatistics(joints)
        self.tip_sigmas: Array = np.full(2, np.nan)
        self.tip_sigma: float | None = None  # the largest of both together, m
        self.load = TipLoadFinder()  # of the load at the tip that the model does not know

    def add(self, stretch: Stretch) -> None:
        """Add a stretch."""
        angles, predictions = stretch.of(Stream.ANGLES), stretch.predictions
        self.residuals.add(angles.values)
        self.normalised.add(angles.normalised)
        for health in stretch.health:
            self._add_tip_sigmas(health.tip_sigmas)
        if not len(predictions.stamps):
            return
        self.samples += len(predictions.stamps)
        self.load.add(predictions.stamps, stretch.estimates.load, stretch.estimates.load_variance)
        self.acceleration = float(np.fmax(self.acceleration, np.hypot(*predictions.tip_acceleration.T).max()))

    def _add_tip_sigmas(self, sigmas: Array) -> None:
        self.tip_sigmas = np.fmax(self.tip_sigmas, sigmas)
        if np.isfinite(sigmas).all():
            self.tip_sigma = max(self.tip_sigma or 0.0, float(np.hypot(*sigmas)))


class Recording:
    """Recording of a replay's results, in the order of the session.

    Parameters
    ----------
    take : callable, optional
        Is given every `Stretch` of the session, which is then let go; without it, the whole session is one, and kept.
    errors : TipErrors, optional
        Told of all predictions for which the truth is known.

    Attributes
    ----------
    gaps, clock_sets : list of (int, int)
        Stamps (ns) between which strokes paused; stamps before and after a clock was set.
    """

    def __init__(
        self,
        joints: int,
        take: Callable[[Stretch], None] | None = None,
        errors: TipErrors | None = None,
        reads: StrokeReading = StrokeReading.LENGTH,
        streams: Collection[Stream] = USUAL_STREAMS,
    ) -> None:
        self._joints, self._take, self._errors, self.reads, self._streams = joints, take, errors, reads, streams
        self._parts: list[ReportBlock] = []
        self._single: list[Report] = []
        self._health: list[Health] = []
        self._samples: list[SampleBlock] = []
        self._alarms = Alarms()
        self._newest: int | None = None
        self._first = 0
        self._count = self._before = 0  # predictions so far, and those in earlier stretches
        self._rows_by_first_clock: int | None = None
        self._whole: Stretch | None = None
        self.gaps: list[tuple[int, int]] = []
        self.clock_sets: list[tuple[int, int]] = []
        self.refused = 0  # samples that were not used
        self.is_judged = False  # whether the rig's health was
        self.noise: Mapping[str, float] = {}  # see `Health.noise`; the newest
        self.totals = SessionTotals(joints)  # of all stretches that are complete

    def add(self, found: ReportBlock | Report) -> None:
        """Add reports of samples."""
        if isinstance(found, Report):
            self._add_one(found)
        else:
            self._close_single()
            self._parts.append(found)
            stamps = found.predictions.stamps
            if len(stamps):
                self._note_predictions(int(stamps[0]), int(stamps[-1]), len(stamps))
            for health in found.health.values():
                self._add_health(health)
        if self._take is not None and self._count - self._before >= STRETCH:
            self._complete()

    def add_samples(self, samples: SampleBlock) -> None:
        """Keep samples for the stretch."""
        self._samples.append(samples)

    def close(self) -> None:
        """Complete the last stretch; to be called once, after the last `add`."""
        self._complete()

    @property
    def is_empty(self) -> bool:
        """Return True if nothing was predicted yet."""
        return self._newest is None

    @property
    def first(self) -> int:
        """Stamp of the first prediction, ns."""
        return self._first

    def _note_predictions(self, first: int, last: int, count: int) -> None:
        if self._newest is None:
            self._first = first
        self._newest = last
        self._count += count

    def _add_health(self, health: Health) -> None:
        self.is_judged = True
        self.noise = health.noise
        self._health.append(health)
        self._alarms.take(health)

    def _add_one(self, report: Report) -> None:
        self.refused -= len(report.earlier)
        for each in report.earlier:
            self._add_one(each)
        if not report.accepted or not HELD.isdisjoint(report.events):
            self.refused += 1
        if report.prediction is not None:
            self._note_time(report)
            self._note_predictions(report.stamp, report.stamp, 1)
        if report.health is not None:
            self._add_health(report.health)
        self._single.append(report)

    def _note_time(self, report: Report) -> None:
        """Store where stamps stepped: the stamp before, and the one after."""
        for found, events in ((self.gaps, ("gap", "restart")), (self.clock_sets, ("clock set", "jump back"))):
            if self._newest is not None and not set(events).isdisjoint(report.events):
                found.append((self._newest, report.stamp))
        if self.clock_sets and self._rows_by_first_clock is None:
            self._rows_by_first_clock = self._count

    def _close_single(self) -> None:
        if self._single:
            self._parts.append(report_block(self._single, self._joints))
            self._single = []

    def _complete(self) -> None:
        """Make a stretch of what came since the last one, add it to the totals, and give it away or keep it."""
        stretch = self._stretch()
        self._parts, self._health, self._samples = [], [], []
        if stretch is None:
            return
        self.totals.add(stretch)
        if self._errors is not None:
            self._errors.add(stretch.predictions, self._by_first_clock(self._before), stretch.estimates)
        self._before = self._count
        if self._take is None:
            self._whole = stretch
        elif len(stretch.predictions.stamps):
            self._take(stretch)

    def _stretch(self) -> Stretch | None:
        self._close_single()
        parts = [part for part in self._parts if len(part.predictions.stamps) or len(part.residuals.stamps)]
        own = self._health, self._first, self._samples, self.reads, self._streams
        return Stretch(self._joints, joined(parts), *own) if parts else None

    @property
    def whole(self) -> Stretch:
        """Session so far as one stretch; only for a recording that keeps it."""
        found = self._whole or self._stretch()
        if self._take is not None or found is None:
            raise ValueError("the stretches of this recording were given away")
        return found

    @property
    def duration(self) -> float:
        """Time from the first prediction to the last, s, in the model's own time.

        Steps of a clock that was set are not part of it.
        """
        span = (self._newest or 0) - self._first
        return (span - sum(after - before for before, after in self.clock_sets)) * NANO

    def _by_first_clock(self, before: int) -> slice:
        """Return the rows before a clock was set, in a stretch with so many predictions before it.

        Their stamps tell the time since the first one.
        """
        return slice(None if self._rows_by_first_clock is None else max(0, self._rows_by_first_clock - before))

    def alarms(self) -> list[Alarm]:
        """Return all alarms, each once with its latest values, in the order of their beginning."""
        return sorted(self._alarms.all, key=lambda alarm: alarm.since)
