"""Status of the whole twin and of all that it listens to."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence

import numpy as np

from ..config.settings import Thresholds
from ..types import Array, Health, Report, Sample, Stream
from .levels import Evaluation, Level, Status
from .model_status import HealthWatch, LoadWatch, ModelWatch, ResidualJudge, level_of
from .sensor_status import SensorJudge, SensorSpec
from .source_status import PublishersJudge, Reception, ReceptionJudge
from .stream_stats import Rows, StreamWatch
from .stress_status import StressWatch
from .topic_status import OutputsJudge, Peers, TopicJudge, seconds


def all_pieces(look: Generator[None, None, list[Status]]) -> list[Status]:
    """Do all pieces of a look at once and return the result, see `TwinWatch.look`."""
    while True:
        try:
            next(look)
        except StopIteration as end:
            return list(end.value)


class TwinWatch:
    """Judge of the twin and its inputs. It takes every message and judges when asked; a message alone costs no computation.

    Parameters
    ----------
    sensors : dict of Stream to sequence of SensorSpec
        In the order of a sample's values; empty before the node is configured.
    names : dict of Stream to str
        Names of the input topics.
    thresholds : Thresholds
        May be replaced while it runs.
    monotonic : callable
        The time, s, of a clock that only goes forward.
    stress : StressWatch, optional
        Of the boom, if its sections bend.
    """

    def __init__(
        self,
        sensors: Mapping[Stream, Sequence[SensorSpec]],
        names: Mapping[Stream, str],
        thresholds: Thresholds,
        monotonic: Callable[[], float] = time.monotonic,
        stress: StressWatch | None = None,
    ) -> None:
        self._monotonic, self._stress = monotonic, stress
        self.thresholds = thresholds
        self._sensors = {stream: [SensorJudge(sensor) for sensor in each] for stream, each in sensors.items()}
        self._topics = {stream: TopicJudge(names[stream], each[0].required) for stream, each in sensors.items()}
        ranges = {stream: np.array([(sensor.low, sensor.high) for sensor in each]).T for stream, each in sensors.items()}
        self._streams = {stream: StreamWatch(low, high, monotonic) for stream, (low, high) in ranges.items()}
        self._model, self._outputs = ModelWatch(), OutputsJudge()
        self._publishers, self._reception = PublishersJudge(), ReceptionJudge()
        self.begin()

    def begin(self) -> None:
        """Start listening and reset all that is counted."""
        now = self._monotonic()
        for stream in self._streams.values():
            stream.begin(now)
        self._model.begin(now)
        self._looked = now
        self._residuals: dict[tuple[str, ...], tuple[Rows, Rows]] = {}  # and their deviations, by channels
        self._newest: Report | None = None  # that has a prediction
        self._judges: dict[str, ResidualJudge] = {}
        self._silent: set[Stream] = set()
        self.health: HealthWatch | None = None
        self._load = LoadWatch()

    # -- one message --------------------------------------------------------------------------------------------------

    def seen(self, stream: Stream, stamp: int) -> None:
        """Count a message."""
        self._streams[stream].seen(stamp)

    def took(self, sample: Sample, report: Report, duration: float) -> None:
        """Take the `report` that the twin made of `sample` in `duration` seconds."""
        self._streams[sample.stream].took(sample)
        for each in report.all:
            self._model.took(each, duration if each is report else 0.0)
            if each.has_residuals:
                self._keep_residuals(each)
            if each.is_predicted:
                self._newest = each
            if self._load.is_due(each.stamp) and each.estimate is not None:
                self._load.took(each.estimate)
            self.judged(each.health, 0.0)

    def _keep_residuals(self, report: Report) -> None:
        """Keep the residuals of a report until the next look."""
        rows = report.rows
        if rows is not None and len(rows.streams) == 1:  # as nearly always
            names = rows.names(rows.streams[0])
            self._keep(names, rows.values[0, : len(names)], rows.sigmas[0, : len(names)])
            return
        for each in report.residuals:
            self._keep(each.names, each.values, each.sigmas)

    def _keep(self, names: tuple[str, ...], values: Array, sigmas: Array) -> None:
        """Append a row of values and standard deviations of these channels."""
        kept = self._residuals.get(names)
        if kept is None:
            kept = self._residuals[names] = Rows(len(names)), Rows(len(names))
        kept[0].append(values)
        kept[1].append(sigmas)

    def judged(self, health: Health | None, duration: float) -> None:
        """Take the result of a look at the rig's health, which took `duration` seconds; None if there is no news."""
        self._model.worked(duration)
        if health is not None:
            self.health = self.health or HealthWatch()
            self.health.took(health)

    def broken(self, reason: str) -> None:
        """Count a message that could not be handled at all."""
        self._model.break_down(reason)

    # -- a look -------------------------------------------------------------------------------------------------------

    @property
    def newest(self) -> int | None:
        """Stamp of the newest stroke, ns."""
        return self._streams[Stream.STROKES].newest

    def is_urgent(self) -> bool:
        """Return True if the model failed, an alarm began, or a stream fell silent or is heard again.

        A look should not wait for its turn then.
        """
        now = self._monotonic()
        before, self._silent = self._silent, {s for s, each in self._streams.items() if self._is_silent(each, now)}
        return self._model.has_failed or before != self._silent or (self.health is not None and self.health.has_news)

    def look(
        self,
        counts: Mapping[str, str | int],
        is_active: bool,
        publishers: Mapping[Stream, Peers],
        subscribers: Iterable[Peers],
        clock: float,
        reception: Mapping[str, Reception] | None = None,
        wrong_names: Mapping[Stream, tuple[Level, str]] | None = None,
        left_out: Mapping[str, int] | None = None,
        words: Mapping[str, str] | None = None,
    ) -> Generator[None, None, list[Status]]:
        """Return the states of model, topics, health, sensors and residuals; of the model alone while the twin does not listen.

        It is worked out in pieces, for a live node to take samples in between: each takes a millisecond or two of those of a
        second at 1 kHz.

        Parameters
        ----------
        counts : dict
            Told with the model.
        is_active : bool
            Whether the twin listens.
        publishers : dict of Stream to Peers
            Of every input.
        subscribers : iterable of Peers
            Of all outputs.
        clock : float
            Time that people know, s.
        reception : dict of str to Reception, optional
            By name of the topic; None where nothing is received live, and so nobody publishes.
        wrong_names : dict of Stream to tuple of Level and str, optional
            Of inputs whose messages have names that the scene does not have: that in words.
        left_out : dict of str to int, optional
            What was left out for lack of time since the node was configured, by what it is.
        words : dict of str to str, optional
            What the counts are of, by the last part of their names.

        Yields
        ------
        None
            After every piece but the last.

        Returns
        -------
        list of Status
        """

        def now() -> Evaluation:
            return Evaluation(self.thresholds, self._monotonic(), clock)

        at, wrong, sensors = now(), wrong_names or {}, list[Status]()
        is_fed = is_active and not self._is_silent(self._streams[Stream.STROKES], at.now)
        found = [self._model.status(counts, is_active, is_fed, at, words or {})]
        if not is_active:
            return found
        for stream in self._streams:
            yield
            sensors += self._look_at(stream, now())
        yield
        at = now()
        found += [self._topic(stream, publishers[stream], at, wrong.get(stream)) for stream in self._streams]
        if reception is not None:
            followed = {stream: seconds(each.newest) for stream, each in self._streams.items()}
            found.insert(0, self._publishers.status(publishers, followed, at))
            found.append(self._reception.status(reception, left_out or {}, at))
        found.append(self._outputs.status(subscribers, at))
        if self.health is not None:
            found.append(self.health.status(at))
        if (load := self._load.status(at)) is not None:
            found.append(load)
        yield
        if self._stress is not None and self._newest is not None and self._newest.prediction is not None:
            found.append(self._stress.status(self._newest.prediction, self._newest.estimate, at))
        return found + sensors + (yield from self._look_at_residuals(now))

    def _is_silent(self, stream: StreamWatch, now: float) -> bool:
        return stream.newest is None or stream.age(now) > self.thresholds.stale_after

    def _topic(self, stream: Stream, peers: Peers, at: Evaluation, wrong_names: tuple[Level, str] | None) -> Status:
        watch = self._streams[stream]
        offset = watch.lag - self._streams[Stream.STROKES].lag
        return self._topics[stream].status(watch, peers, offset, at, wrong_names)

    def _look_at(self, stream: Stream, at: Evaluation) -> list[Status]:
        """Return the statuses of the sensors of one stream."""
        watch = self._streams[stream]
        return [
            judge.status(figures, watch.age_of(figures, at.now), at)
            for judge, figures in zip(self._sensors[stream], watch.look(self.thresholds.gap_warn), strict=True)
        ]

    def _look_at_residuals(self, now: Callable[[], Evaluation]) -> Generator[None, None, list[Status]]:
        """Return the statuses of every channel that ever had a residual, one stream after the other."""
        taken, self._residuals = self._residuals, {}
        for names, those in taken.items():
            yield
            at = now()
            values, sigmas = (each.table() for each in those)
            for name, column in zip(names, (values / sigmas).T, strict=True):
                self._judges.setdefault(name, ResidualJudge(name, self._looked)).take(column, at.now)
        at = now()
        self._looked = at.now
        is_judged = self.health is not None
        explained = "" if self.health is None else self.health.explained
        if self.health is not None and not self.health.is_alarmed:
            explained = self._load.explanation
        return [judge.status(self._alarm_of(name), at, explained, is_judged) for name, judge in self._judges.items()]

    def _alarm_of(self, channel: str) -> tuple[Level, str] | None:
        """Return level and words of the active alarm of a channel."""
        alarm = None if self.health is None else self.health.of(channel)
        return None if alarm is None else (level_of(alarm), alarm.told)
