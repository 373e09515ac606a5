"""Status of the twin and its inputs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from ..config.settings import Thresholds
from ..types import SENSORS, Array, Health, Report, Sample, Stream
from .levels import ComponentJudge, Evaluation, Level, Status, Value
from .model_status import HealthWatch, LoadWatch, ModelWatch, ResidualWindow, SwingWatch
from .sensor_status import SensorSpec, StreamWatch, sensor_status
from .topic_status import Peers, Reception, ReceptionWatch, outputs_status, publishers_status, seconds, topic_status


class TwinWatch:
    """Judge of the twin and its inputs. It stores messages as they arrive; only `look` judges them.

    `sensors` are in the order of a sample's values; the first stream drives the model. They are empty before the node is
    configured. `names` are those of the input topics; streams in the messages of another one have none.
    """

    def __init__(
        self,
        sensors: Mapping[Stream, Sequence[SensorSpec]],
        names: Mapping[Stream, str],
        thresholds: Thresholds,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        self._monotonic, self.thresholds = monotonic, thresholds
        self._sensors, self._names, self._reception = sensors, names, ReceptionWatch()
        self._drive = next(iter(sensors), Stream.STROKES)
        self._streams = {stream: StreamWatch(len(each), monotonic) for stream, each in sensors.items()}
        self.begin()

    def begin(self) -> None:
        """Start listening and reset all counts and levels."""
        for stream in self._streams.values():
            stream.begin()
        self._looked = self._monotonic()
        self._judges: dict[str, ComponentJudge] = {}
        drive = "strokes" if self._drive is Stream.STROKES else "angles"
        self._model, self._load, self._swing = ModelWatch(self._looked, drive), LoadWatch(), SwingWatch()
        self._rows: dict[tuple[str, ...], list[Array]] = {}  # normalised residuals since the last look, by channels
        self._residuals: dict[str, ResidualWindow] = {}
        self._newest: Report | None = None  # newest with a prediction
        self._silent: set[Stream] = set()
        self.health: HealthWatch | None = None  # None until health was judged

    # -- one message --------------------------------------------------------------------------------------------------

    def seen(self, stream: Stream, stamp: int) -> None:
        self._streams[stream].seen(stamp)

    def took(self, sample: Sample, report: Report, duration: float) -> None:
        """Take the `report` that the twin made of `sample` in `duration` seconds."""
        self._streams[sample.stream].took(sample)
        self._model.took(report, duration)
        for residuals in report.residuals:
            self._rows.setdefault(residuals.names, []).append(residuals.normalised)
        if report.prediction is not None:
            self._newest = report
        self._swing.took(report)
        self._load.took(report)
        self.judged(report.health, 0.0)

    def judged(self, health: Health | None, duration: float) -> None:
        """Take the rig's `health`, computed in `duration` seconds; None without news."""
        self._model.worked(duration)
        if health is not None:
            self.health = self.health or HealthWatch()
            self.health.took(health)

    def acknowledge(self) -> str:
        """Acknowledge the alarms of the rig's health; return the ended ones, now released, in words."""
        return "no alarm has ended: health was not judged" if self.health is None else self.health.acknowledge()

    def broken(self, reason: str) -> None:
        self._model.break_down(reason)

    # -- a look -------------------------------------------------------------------------------------------------------

    @property
    def newest(self) -> int | None:
        """Stamp of the newest sample that drives the model, ns."""
        return self._streams[self._drive].newest

    def is_urgent(self) -> bool:
        """Return True if the model failed, an alarm began, or a stream stopped or resumed.

        The next look should then be made at once.
        """
        now = self._monotonic()
        before, self._silent = self._silent, {s for s, each in self._streams.items() if self._is_silent(each, now)}
        judge = self._judges.get("model")
        has_failed = self._model.has_news and (judge is None or judge.level != Level.ERROR)
        return has_failed or before != self._silent or (self.health is not None and self.health.has_news)

    def look(
        self,
        counts: Mapping[str, Value],
        idle: str,
        publishers: Mapping[Stream, Peers],
        subscribers: Iterable[Peers],
        clock: float,
        reception: Mapping[str, Reception] | None = None,
        wrong_names: Mapping[Stream, tuple[Level, str]] | None = None,
        words: Mapping[str, str] | None = None,
    ) -> list[Status]:
        """Return the statuses of model, topics, health, sensors and residuals; while `idle` (a reason), of the model only.

        `counts` are reported with the model, and `words` describe them by the last part of their names. `publishers` are the
        peers of every input, `subscribers` those of all outputs. `reception` is by name of the topic, None if nothing is
        received live. `wrong_names` are faults of inputs whose messages have names unknown to the scene.
        """
        at = Evaluation(self.thresholds, self._monotonic(), clock)

        def judge(name: str, key: str = "") -> ComponentJudge:
            return self._judges.setdefault(key or name, ComponentJudge(name)).begin(at)

        is_fed = not idle and not self._is_silent(self._streams[self._drive], at.now)
        found = [self._model.status(judge("model"), counts, idle, is_fed, words or {})]
        if idle:
            return found
        sensors, longest = list[Status](), self.thresholds.gap_warn
        for stream, watch in self._streams.items():
            for sensor, stats in zip(self._sensors[stream], watch.look(longest), strict=True):
                alarm = None if self.health is None else self.health.of_sensor(sensor.name)
                sensors.append(sensor_status(judge(f"sensor {sensor.name}"), sensor, stats, watch.age_of(stats, at.now), alarm))
        strokes = self._streams[self._drive].lag
        for stream, watch in self._streams.items():
            if stream not in self._names:
                continue
            topic, wrong = judge(self._names[stream], f"topic {stream.value}"), (wrong_names or {}).get(stream)
            is_required = self._sensors[stream][0].required
            found.append(topic_status(topic, watch, is_required, publishers[stream], watch.lag - strokes, wrong))
        if reception is not None:
            streams = {stream: self._streams[Stream(SENSORS[stream].gives or stream)] for stream in publishers}
            followed = {stream: seconds(each.newest) for stream, each in streams.items()}
            found.insert(0, publishers_status(judge("publishers"), publishers, followed))
            found.append(self._reception.status(judge("reception"), reception))
        found.append(outputs_status(judge("outputs"), subscribers))
        if self.health is not None:
            found.append(self.health.status(judge("health")))
        if (load := self._load.status(judge("tip load"))) is not None:
            found.append(load)
        if self._newest is not None:
            found.append(self._swing.status(judge("swing")))
        for names, rows in self._rows.items():
            for name, column in zip(names, np.array(rows, float).reshape(-1, len(names)).T, strict=True):
                window = self._residuals.setdefault(name, ResidualWindow(self._looked))
                window.take(column, at.now)
            rows.clear()
        self._looked = at.now
        return found + sensors + [self._residual(judge(f"residual {name}"), name) for name in self._residuals]

    def _is_silent(self, stream: StreamWatch, now: float) -> bool:
        return stream.newest is None or stream.age(now) > self.thresholds.stale_after

    def _residual(self, judge: ComponentJudge, channel: str) -> Status:
        window, health = self._residuals[channel], self.health
        if health is None:
            return window.status(judge, None)
        explained = health.explained if health.is_alarmed else self._load.explanation
        return window.status(judge, health.of(channel), explained, is_judged=True)
