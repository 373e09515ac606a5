"""Inputs of a replay: the session with its scene, mapping and settings, given or as it was recorded; test for another boom."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import degrees, radians
from pathlib import Path
from typing import Any

import numpy as np

from ..bag.advice import refuse_conflicts
from ..bag.reader import Session, read, scan
from ..bag.session_file import WHOLE, TimeWindow
from ..bag.session_model import (
    SessionScene,
    SessionStrokes,
    mapping_of,
    scene_of,
    settings_of,
    strokes_of,
)  # fmt: skip
from ..config.settings import Settings
from ..errors import BagError, UsageError
from ..health.wiring_monitor import KIND as WIRING
from ..messages.sample_decoder import NO_MEASUREMENT
from ..messages.topic_table import NO_AREAS, InputTopic, Topics
from ..scene.load import SceneSource
from ..scene.schema import Scene
from ..twin.twin import Twin
from ..types import NANO, SENSORS, Array, Health, Report, Sample, Stream, streams_of
from .progress import Progress


@dataclass(frozen=True)
class ReplayOptions:
    """Options of a replay, see the parameters of `boom_twin.offline.replay.replay`."""

    progress: Progress | None = None
    mapping: str | Path | None = None
    changes: bool = True
    health: bool = True
    window: TimeWindow = WHOLE
    namespace: str = ""
    with_bag: bool = True
    causes: bool = False

    def __post_init__(self) -> None:
        if self.causes and not self.health:
            raise UsageError("causes: they are named by health, which is off. Leave health on.")


USUAL = ReplayOptions()


@dataclass(frozen=True)
class ReplayInputs:
    """Session and all that it is read with."""

    session: Session
    kept: SessionScene  # scene with its text and source
    settings: Settings
    mapping: str  # source of the mapping
    topics: Topics
    wanted: list[str]  # input topics to read: that which drives the model, and those of other inputs with messages
    strokes: SessionStrokes
    streams: tuple[Stream, ...]  # of the sensors that the mapping has; gyros only if the session's messages hold their readings
    health: bool  # True if the rig's health is judged
    window: TimeWindow

    @property
    def scene(self) -> Scene:
        """Scene of the session."""
        return self.kept.scene

    @property
    def expected(self) -> int:
        """Approximate number of messages to read."""
        session = self.session
        count = sum(topic.count for name in self.wanted if (topic := session.find(name)) is not None)
        return round(count * self.window.share((session.end - session.start) * NANO))

    @property
    def summary(self) -> dict[str, Any]:
        """Sources, for ``summary.json``."""
        found = {
            "scene": self.kept.source,
            "scene_sha256": self.kept.sha256,
            "mapping": self.mapping,
            "strokes": self.strokes.reading,
            "strokes_source": self.strokes.source,
        }
        window = {"window_start_s": self.window.start, "window_duration_s": self.window.duration}
        incomplete = {"session_incomplete": self.session.incomplete} if self.session.incomplete else {}
        return found | ({} if self.window == WHOLE else window) | incomplete

    def twin(self, causes: bool = False) -> Twin:
        """Return a twin for the session, which names causes of faults if that is asked for."""
        topics, reads = self.topics, self.strokes.reading
        mounts, settings = topics.mounts(len(self.scene.joints)), topics.noise_of(self.settings)
        given = self.scene, settings, mounts, self.health, reads, topics.absent
        return Twin(*given, causes=causes, places=topics.places, lagging=topics.lagging)

    def refuse(self, reason: str) -> None:
        """Raise BagError if there is a `reason` for which the session is of another boom than the scene."""
        if reason:
            raise BagError(
                f"{self.session.path}: {reason}. The scene ({self.kept.source}) is of another boom, or the sensors are wired "
                f"otherwise: give the scene by --scene, or the mapping that `boom_twin mapping --check {self.session.path}` "
                "proposes by --mapping."
            )


def replay_inputs(
    bag: Path, scene: SceneSource | SessionScene, settings: Settings | None, options: ReplayOptions
) -> ReplayInputs:
    """Return the inputs of a replay; for the parameters and errors see `boom_twin.offline.replay.replay`."""
    session, settings = scan(bag), settings or settings_of(bag).settings
    kept = scene_of(session.path, scene)
    joints = kept.scene.joints
    mapped = mapping_of(session.path, Path(options.mapping) if options.mapping else None, len(joints), options.namespace)
    topics = mapped.topics.of_scene(joints)
    if not topics.areas and (found := session.find(topics.inputs[Stream.PRESSURES].name)) is not None and found.count:
        raise UsageError(f"{session.path}: {NO_AREAS}")
    drive = topics.stroke_reading.stream
    topics_there = {name: session.find(name) for name in topics.heard}
    wanted = [
        name for name, topic in topics_there.items() if drive in topics.heard[name] or (topic is not None and topic.count)
    ]
    strokes = strokes_of(session.path, mapped)
    refuse_conflicts(session, topics, len(joints), kept.source)
    streams = tuple(
        stream
        for stream in streams_of(topics.places)
        if not SENSORS[stream].beside or _has_rates(session, topics.inputs[Stream(SENSORS[stream].beside)], wanted)
    )
    return ReplayInputs(
        session, kept, settings, mapped.source, topics, wanted, strokes, streams, options.health, options.window
    )


def _has_rates(session: Session, topic: InputTopic, wanted: list[str]) -> bool:
    """Return True if the first message of an IMU holds a rate."""
    if topic.name not in wanted:
        return False
    first = next(iter(read(session, {topic.absolute: topic.type})), None)
    return first is not None and first[2].angular_velocity_covariance[0] != NO_MEASUREMENT


LARGEST_RESIDUAL = radians(10.0)  # largest residual by sag, load, wrong stiffness, and most encoders' zeros


class OtherBoom:
    """Test for a session of another boom, by the medians of the angles' residuals.

    The test uses the first window in which the readings of most encoders change. A constant encoder may be dead and is not
    used. A single large residual may be an encoder fault. If more than half are large, the scene is wrong. The test is made
    once, because a later difference is a fault of the rig. It is not made if health reports wrong wiring.
    """

    def __init__(self) -> None:
        self.is_judged = False  # True after the test: no more samples are needed
        self._begin = 0
        self._values: list[Array] = []
        self._residuals: list[Array] = []

    def took(self, sample: Sample, report: Report) -> str:
        """Take the `report` of `sample`; return the evidence of another boom, empty without evidence."""
        for part in report.all:
            self.hear(part.health)
        values = [sample.values] if sample.stream is Stream.ANGLES else []
        found = [each.values for part in report.all for each in part.residuals if each.stream is Stream.ANGLES]
        return self.take(sample.stamp, values, found)

    def hear(self, health: Health | None) -> None:
        """Take the health of the rig: wrong wiring explains large residuals."""
        self.is_judged |= health is not None and any(alarm.kind == WIRING for alarm in health.alarms)

    def take(self, stamp: int, values: Iterable[Array], residuals: Iterable[Array]) -> str:
        """Take rows of angles and of their residuals (n,) in rad up to a `stamp` (ns); return the same as `took`."""
        judged_time = 5_000_000_000  # window (ns) of the test
        if self.is_judged:
            return ""
        self._values.extend(values)
        self._residuals.extend(residuals)
        self._begin = self._begin or stamp
        return self.judge() if stamp - self._begin > judged_time else ""

    def judge(self) -> str:
        """Return the evidence of another boom, empty without evidence; clear the window."""
        fewest_residuals = 10  # least number of a joint's residuals in the window
        values, residuals = self._values, self._residuals
        self._begin, self._values, self._residuals = 0, [], []
        if self.is_judged or len(values) < fewest_residuals or len(residuals) < fewest_residuals:
            return ""
        table, off = np.array(values), np.array(residuals)
        counts = np.isfinite(off).sum(axis=0)
        heard = [i for i in range(len(counts)) if counts[i] >= fewest_residuals]
        live = [i for i in heard if np.nanmax(table[:, i]) > np.nanmin(table[:, i])]
        if 2 * len(live) <= len(heard):
            return ""
        self.is_judged = True
        medians = {i: float(np.nanmedian(off[:, i])) for i in live}
        far = {i: value for i, value in medians.items() if abs(value) > LARGEST_RESIDUAL}
        if 2 * len(far) <= len(live):
            return ""
        told = ", ".join(f"joint_{i + 1} by {degrees(value):+.1f} deg" for i, value in far.items())
        return f"{told} off what the strokes say, and at most {degrees(LARGEST_RESIDUAL):g} deg can be a fault of the rig"
