"""A recorded session: what its node published, or what a twin says to it now."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from ..errors import BagError
from ..io.factory import RosbagsTypes
from ..io.intake import Intake, stamp_of
from ..io.outlet import Outlet
from ..io.reader import Session, read, scan
from ..io.topics import NODE, Output, Topic, load_topics
from ..records import Stream
from ..scene.parts import Scene
from ..settings import Settings
from ..thresholds import Thresholds
from ..twin import Twin
from ..watch.peers import Peers
from ..watch.sensors import sensors_of
from ..watch.status import Status
from ..watch.twin import TwinWatch
from .feed import Feed
from .store import Store

NANO = 1e-9
LOOK = 1.0
"""Seconds between looks at the state of the twin, as of the node."""
ENOUGH = Output.TIP_ACCELERATION
"""A session with this output is shown as its node published it."""

Progress = Callable[[Iterator[Any], int], Iterator[Any]]
Role = Stream | Output


def bag_feed(path: Path, scene: Scene, settings: Settings, progress: Progress = lambda messages, _: messages) -> Feed:
    """Read the whole session.

    Parameters
    ----------
    path : Path
        A recording, or the result bag of a replay.
    scene : Scene
        Of the rig.
    settings : Settings
        For the twin, where the session has no outputs.
    progress : callable
        Wraps the iterator over messages, of which it is told the number.

    Raises
    ------
    BagError
        It cannot be read, or nothing in it can be shown.
    """
    session = scan(path)
    topics, counts = _present(session)
    is_published = ENOUGH in topics
    if not is_published:
        topics = {role: topic for role, topic in topics.items() if isinstance(role, Stream)}
    roles = {topic.absolute: role for role, topic in topics.items()}
    rows = max((counts[role] for role in topics), default=0)
    feed = Feed(_title(session, is_published), Store(max(rows, 1), keeps_boards=True), scene, end=0.0)
    messages = read(session, {topic.absolute: topic.type for topic in topics.values()})
    take = feed.catch.take if is_published else _Twin(feed, scene, settings).take
    for name, time, message in progress(messages, sum(counts[role] for role in topics)):
        take(roles[name], message, feed.now() if is_published else time * NANO)
    if not feed.store.tables:
        raise BagError(f"{path}: nothing to show. It needs strokes named cylinder_1 .. in m, or outputs of the twin.")
    feed.end = feed.store.newest
    return feed


def _present(session: Session) -> tuple[dict[Role, Topic], dict[Role, int]]:
    """The topics that the session has, and how many messages of each."""
    known = load_topics()
    topics: dict[Role, Topic] = dict(known.inputs.items() | known.outputs.items())
    counts = {role: found.count for role, topic in topics.items() if (found := session.find(topic.absolute)) is not None}
    return {role: topic for role, topic in topics.items() if counts.get(role)}, counts


def _title(session: Session, is_published: bool) -> str:
    kind = "as published" if is_published else "through the twin"
    origin = session.notes.get("origin")
    return f"{session.path.name}, {kind}" + (f" ({origin})" if origin else "")


class _Twin:
    """A twin beside the session, watched as the node watches its own."""

    def __init__(self, feed: Feed, scene: Scene, settings: Settings) -> None:
        self._feed, self._time = feed, 0.0
        self._twin, self._intake = Twin(scene, settings), Intake(len(scene.joints))
        self._outlet = Outlet(RosbagsTypes(), scene, settings)
        inputs = load_topics().inputs
        sensors = sensors_of(scene, settings, {stream: topic.required for stream, topic in inputs.items()})
        names = {stream: topic.name for stream, topic in inputs.items()}
        self._watch = TwinWatch(sensors, names, Thresholds(), lambda: self._time)
        self._peers = {stream: Peers(topic.absolute) for stream, topic in inputs.items()}
        self._looked: float | None = None

    def take(self, role: Role, msg: Any, time: float) -> None:
        """Take one message of the session, received at `time` (s)."""
        assert isinstance(role, Stream)
        self._time, stamp = time, stamp_of(msg)
        if self._looked is None:
            self._watch.begin()
            self._looked = time
        self._feed.catch.take(role, msg, time)
        self._watch.seen(role, stamp)
        sample = self._intake.put(role, stamp, msg)
        if sample is not None:
            report = self._twin.update(sample)
            self._watch.took(sample, report, 0.0)
            for key, filled in self._outlet.fill(report):
                self._feed.catch.take(key, filled, time)
        if time - self._looked >= LOOK or self._watch.is_urgent():
            self._look()

    def _look(self) -> None:
        counts: Mapping[str, int] = {**self._twin.counts, **self._intake.oddities}
        found = self._watch.look(counts, True, self._peers, (), self._time)
        store, now = self._feed.store, self._feed.now()
        store.light(now, store.board(now).told(now, map(_as_message, found), self._time))
        self._looked = self._time


def _as_message(status: Status) -> Any:
    """As it would stand on ``/diagnostics``."""
    values = [SimpleNamespace(key=key, value=str(value)) for key, value in status.values.items()]
    return SimpleNamespace(name=f"{NODE}: {status.name}", level=status.level, message=status.message, values=values)
