"""A recorded session: what its node published, or what a twin says to it now."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from ..errors import BagError
from ..io.ahead import Ahead
from ..io.mapping import mapping_of
from ..io.outlet import Outlet
from ..io.reader import Session, read, scan
from ..io.topics import NODE, TYPES, Output, Topic, Topics
from ..io.typestore import jazzy
from ..records import Change, Sample, Stream
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
SHOWN = frozenset(Output) - {Output.CHANGES, Output.HEALTH, Output.TIP_UNCERTAINTY}

Progress = Callable[[Iterator[Any], int], Iterator[Any]]
Role = Stream | Output


def bag_feed(
    path: Path,
    scene: Scene,
    settings: Settings,
    progress: Progress = lambda messages, _: messages,
    mapping: Path | None = None,
) -> Feed:
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
    mapping : Path, optional
        How topics and sensors are read; as for `boom_twin.replay.replay`.

    Raises
    ------
    BagError
        It cannot be read, or nothing in it can be shown.
    UsageError
        The mapping cannot be used.
    """
    session = scan(path)
    topics = mapping_of(path, mapping, len(scene.joints)).topics
    counts = {name: found.count for name in _names(topics) if (found := session.find(name)) is not None and found.count}
    is_published = topics.outputs[ENOUGH].absolute in counts
    store = Store(max(counts.values(), default=1), keeps_boards=True)
    feed = Feed(_title(session, is_published), store, topics, scene, end=0.0)
    if is_published:
        _take_published(session, feed, topics, counts, progress)
    else:
        _take_predicted(session, feed, topics, counts, settings, progress)
    if not store.tables:
        raise BagError(f"{path}: nothing to show. It needs strokes named cylinder_1 .. in m, or outputs of the twin.")
    feed.end = store.newest
    return feed


def _names(topics: Topics) -> dict[str, Topic]:
    """Every topic that may be shown, by its absolute name."""
    shown = [*topics.inputs.values(), *(topics.outputs[key] for key in Output if key in SHOWN), topics.events]
    return {topic.absolute: topic for topic in shown}


def _title(session: Session, is_published: bool) -> str:
    kind = "as published" if is_published else "through the twin"
    origin = session.notes.get("origin")
    return f"{session.path.name}, {kind}" + (f" ({origin})" if origin else "")


def _take_published(session: Session, feed: Feed, topics: Topics, counts: dict[str, int], progress: Progress) -> None:
    """What the node said, beside the measured acceleration."""
    takers = {name: take for name, take in feed.catch.takers.items() if name in counts}
    known = _names(topics)
    messages = read(session, {name: known[name].type for name in takers})
    for name, _, message in progress(messages, sum(counts[name] for name in takers)):
        takers[name](message, feed.now())


def _take_predicted(
    session: Session, feed: Feed, topics: Topics, counts: dict[str, int], settings: Settings, progress: Progress
) -> None:
    """What a twin says now."""
    scene = feed.scene()
    assert scene is not None
    wanted = [name for name in topics.heard if "/" + name.lstrip("/") in counts]
    if not wanted:
        return
    ahead = Ahead(session.path, topics, wanted, len(scene.joints))
    try:
        twin = _Twin(feed, topics, scene, settings)
        ahead.wait_ready()
        for sample in progress(iter(ahead), sum(counts["/" + name.lstrip("/")] for name in wanted)):
            if sample is not None:
                twin.take(sample)
    finally:
        ahead.stop()


class _Twin:
    """A twin beside the session, watched as the node watches its own; its time is that of the stamps."""

    def __init__(self, feed: Feed, topics: Topics, scene: Scene, settings: Settings) -> None:
        self._feed, self._time = feed, 0.0
        mounts = topics.mounts(len(scene.joints))
        self._twin, self._outlet = Twin(scene, settings, mounts), Outlet(scene, settings)
        self._takers = {key: feed.catch.takers[topic.absolute] for key, topic in topics.outputs.items() if key in SHOWN}
        required = {stream: topic.required for stream, topic in topics.inputs.items()}
        sensors = sensors_of(scene, settings, required, mounts)
        names = {stream: topic.name for stream, topic in topics.inputs.items()}
        self._watch = TwinWatch(sensors, names, Thresholds(), lambda: self._time)
        self._peers = {stream: Peers(topic.absolute) for stream, topic in topics.inputs.items()}
        self._looked: float | None = None

    def take(self, sample: Sample | Change) -> None:
        """Take what comes next in the session."""
        if isinstance(sample, Change):
            self._twin.requests.repeat(sample)
            return
        self._time = max(self._time, sample.stamp * NANO)
        if self._looked is None:
            self._watch.begin()
            self._looked = self._time
        if sample.stream is Stream.IMU:
            self._feed.catch.measure(sample)
        self._watch.seen(sample.stream, sample.stamp)
        report = self._twin.update(sample)
        self._watch.took(sample, report, 0.0)
        for key, encoded in self._outlet.fill(report):
            if key in self._takers:
                self._takers[key](jazzy().deserialize_cdr(encoded, TYPES[key]), self._feed.now())
        if self._time - self._looked >= LOOK or self._watch.is_urgent():
            self._look()

    def _look(self) -> None:
        found = self._watch.look(self._twin.counts, True, self._peers, (), self._time)
        store, now = self._feed.store, self._feed.now()
        store.light(now, store.board(now).told(now, map(_as_message, found), self._time))
        self._looked = self._time


def _as_message(status: Status) -> Any:
    """As it would stand on ``/diagnostics``."""
    values = [SimpleNamespace(key=key, value=str(value)) for key, value in status.values.items()]
    return SimpleNamespace(name=f"{NODE}: {status.name}", level=status.level, message=status.message, values=values)
