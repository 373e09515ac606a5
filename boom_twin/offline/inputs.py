"""Inputs of a replay: session, scene, mapping and settings, each given or as recorded."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..bag.advice import refuse_conflicts
from ..bag.reader import Session, read, scan
from ..bag.session_file import WHOLE, TimeWindow
from ..bag.session_model import SessionScene, SessionStrokes, mapping_of, scene_of, settings_of, strokes_of
from ..config.settings import Settings
from ..errors import BagError, UsageError
from ..messages.sample_decoder import NO_MEASUREMENT
from ..messages.topic_table import NO_AREAS, InputTopic, Topics
from ..scene.load import SceneSource
from ..scene.schema import Scene
from ..twin.twin import Twin
from ..types import NANO, SENSORS, Stream, streams_of
from .progress import Progress
from .session_samples import topics_read


@dataclass(frozen=True)
class ReplayOptions:
    """Options of a replay, see the parameters of `boom_twin.offline.replay.replay`."""

    progress: Progress | None = None
    mapping: str | Path | None = None
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
    """Session, with the scene, mapping and settings that a replay uses."""

    session: Session
    kept: SessionScene  # scene with its text and source
    settings: Settings
    mapping: str  # source of the mapping
    topics: Topics
    strokes: SessionStrokes
    streams: tuple[Stream, ...]  # of the sensors that the mapping has; gyros only if the session's messages hold their readings
    health: bool  # True if the rig's health is judged
    window: TimeWindow

    @property
    def scene(self) -> Scene:
        return self.kept.scene

    @property
    def expected(self) -> int:
        """Approximate number of messages to read."""
        count = sum(map(self.session.count, topics_read(self.session, self.topics)))
        return round(count * self.window.share((self.session.end - self.session.start) * NANO))

    @property
    def length(self) -> float:
        """Length of what is read, s, by log times."""
        whole = (self.session.end - self.session.start) * NANO
        return whole * self.window.share(whole)

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
        sensing = self.topics.sensing(len(self.scene.joints)) | {"reads": self.strokes.reading}
        return Twin(self.scene, self.topics.noise_of(self.settings), health=self.health, causes=causes, **sensing)


def of_another_boom(session: Session, scene: SessionScene, angles: str) -> BagError:
    """Return the error that a session is of another boom than its scene, by channels of angles."""
    told = f"{session.path}: {angles or 'the angles'} and the IMU agree with each other, and not with what the strokes say"
    return BagError(f"{told}. The scene ({scene.source}) is of another boom. Give the boom's own by --scene.")


def replay_inputs(
    bag: Path, scene: SceneSource | SessionScene, settings: Settings | None, options: ReplayOptions
) -> ReplayInputs:
    """Return the inputs of a replay; for the parameters and errors see `boom_twin.offline.replay.replay`."""
    session, settings = scan(bag), settings or settings_of(bag).settings
    kept = scene_of(session.path, scene)
    joints = kept.scene.joints
    mapped = mapping_of(session.path, Path(options.mapping) if options.mapping else None, len(joints), options.namespace)
    topics = mapped.topics.of_scene(joints)
    if not topics.areas and session.count(topics.inputs[Stream.PRESSURES].name):
        raise UsageError(f"{session.path}: {NO_AREAS}")
    strokes = strokes_of(session.path, mapped)
    refuse_conflicts(session, topics, len(joints), kept.source)
    streams = tuple(
        stream
        for stream in streams_of(topics.places)
        if not SENSORS[stream].beside or _imu_has_rates(session, topics.inputs[Stream(SENSORS[stream].beside)])
    )
    return ReplayInputs(session, kept, settings, mapped.source, topics, strokes, streams, options.health, options.window)


def _imu_has_rates(session: Session, topic: InputTopic) -> bool:
    if not session.count(topic.name):
        return False
    first = next(iter(read(session, {topic.absolute: topic.type})), None)
    return first is not None and first[2].angular_velocity_covariance[0] != NO_MEASUREMENT
