"""Feed from a recorded session: the outputs that its node published, or those of a twin that runs now."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path
from threading import Thread
from time import perf_counter
from types import SimpleNamespace
from typing import Any

from ...bag.reader import Session, read
from ...bag.session_file import WHOLE, TimeWindow
from ...bag.session_model import SessionScene
from ...config.settings import Settings, Thresholds
from ...diagnostics.levels import Status
from ...diagnostics.sensor_status import sensors_of
from ...diagnostics.topic_status import Peers
from ...diagnostics.twin_status import TwinWatch
from ...errors import BagError, BoomTwinError
from ...messages.report_encoder import ReportEncoder
from ...messages.topic_table import NODE, Output, Topic, Topics
from ...offline.inputs import ReplayInputs, ReplayOptions, replay_inputs
from ...offline.session_samples import SessionSamples
from ...scene.schema import Scene
from ...twin.twin import Twin, drive
from ...types import NANO, Report, Sample
from .feed import Feed
from .store import Store

PUBLISHED_OUTPUT = Output.TIP_ACCELERATION  # A session with this output is shown as its node published it
COMPILING = "compiling the model (up to a minute the first time)"
READING_TIME = 0.04  # seconds of reading at a time, after which the pages have their turn


class BagFeed(Feed):
    """Feed of a recorded session, read further at every `poll`."""

    _steps: Generator[None] | None = None

    def begin(self, steps: Generator[None]) -> None:
        self._steps = steps

    @property
    def is_reading(self) -> bool:
        return self._steps is not None

    def poll(self) -> None:
        """Read for `READING_TIME` seconds; a fault of the session ends the reading and is kept in `trouble`."""
        if self._steps is None:
            return
        turn = perf_counter() + READING_TIME
        try:
            for _ in self._steps:
                if perf_counter() > turn:
                    return
        except BoomTwinError as error:
            self.trouble = f"read up to {self.store.newest:.2f} s only: {error}"
        self._steps, self.end = None, self.store.newest

    def close(self) -> None:
        if self._steps is not None:
            self._steps.close()


def bag_feed(
    path: Path,
    scene: Scene | SessionScene | None,
    settings: Settings,
    mapping: Path | None = None,
    window: TimeWindow = WHOLE,
    namespace: str = "",
) -> BagFeed:
    """Open a recording, or the result bag of a replay; for the parameters see `boom_twin.offline.replay.replay`.

    A session without outputs is run through a twin with these `settings`, at rest where the `window` begins. BagError if it
    cannot be read, is of another boom, or has nothing that can be shown.
    """
    options = ReplayOptions(mapping=mapping, window=window, namespace=namespace)
    given = replay_inputs(path, scene, settings, options)
    session, topics = given.session, given.topics.reading(given.strokes.reading)
    counts = {name: found.count for name in _names(topics) if (found := session.find(name)) is not None and found.count}
    is_published = topics.outputs[PUBLISHED_OUTPUT].absolute in counts
    store = Store(max(counts.values(), default=1), keeps_statuses=True)
    reads = given.strokes.reading
    if not is_published and topics.inputs[reads.stream].absolute not in counts:
        raise BagError(f"{path}: nothing to show. It needs {reads.named}, or outputs of the twin.")
    feed = BagFeed(_title(session, is_published), store, topics, given.scene, given.length)
    if is_published:
        feed.begin(_take_published(session, feed, topics, counts, window))
    else:
        feed.begin(_take_predicted(feed, topics, given, TwinView(feed, topics, given.twin())))
    return feed


def _names(topics: Topics) -> dict[str, Topic]:
    shown = [*topics.inputs.values(), *topics.outputs.values(), topics.events]
    return {topic.absolute: topic for topic in shown}


def _title(session: Session, is_published: bool) -> str:
    kind = "as published" if is_published else "through the twin"
    origin = session.notes.get("origin")
    state = ", INCOMPLETE" if session.incomplete else ""
    return f"{session.path.name}, {kind}{state}" + (f" ({origin})" if origin else "")


def _take_published(
    session: Session, feed: Feed, topics: Topics, counts: dict[str, int], window: TimeWindow
) -> Generator[None]:
    known, topic_rows = _names(topics), feed.topic_rows
    for name, _, message in read(session, {name: known[name].type for name in counts if name in topic_rows.names}, window):
        topic_rows.take(name, message, feed.now())
        yield


def _take_predicted(feed: BagFeed, topics: Topics, given: ReplayInputs, twin: TwinView) -> Generator[None]:
    """Run a twin on the recorded inputs and store its predictions, one sample a step."""
    feed.phase = COMPILING
    compiling = Thread(target=twin.twin.warm_up, name="compile", daemon=True)
    compiling.start()
    while compiling.is_alive():
        compiling.join(READING_TIME)
        yield
    feed.phase = ""
    samples = SessionSamples(given.session, topics, twin.twin.plan.joints, given.window).samples()
    for step in drive(twin.twin, twin.twin.update, samples):
        if step is not None:
            twin.took(*step)
        yield
    if not feed.store.tables:
        raise BagError(f"{given.session.path}: no stroke could be used; they need names cylinder_1 .. in m, or a mapping.")


class TwinView:
    """View of a twin without a node: encodes its outputs and diagnoses it, as a node does. Its clock is the stamps."""

    def __init__(self, feed: Feed, topics: Topics, twin: Twin) -> None:
        self._feed, self._time, self.twin = feed, 0.0, twin
        self._encoder = ReportEncoder(twin.scene, twin.settings)
        self._names = {key: topic.absolute for key, topic in topics.outputs.items() if topic.absolute in feed.topic_rows.names}
        required = {stream: topic.required for stream, topic in topics.inputs.items()}
        sensors = sensors_of(twin.plan.joints, required, topics.absent)
        names = {stream: topic.name for stream, topic in topics.inputs.items()}
        self._watch = TwinWatch(sensors, names, Thresholds(), lambda: self._time)
        self._peers = {stream: Peers(topic.absolute) for stream, topic in topics.inputs.items()}
        self._looked: float | None = None

    def took(self, sample: Sample, report: Report) -> None:
        """Show the results of one sample."""
        diagnosis_period = 1.0  # seconds between two diagnoses of the twin, as of the node
        self._time = max(self._time, sample.stamp * NANO)
        if self._looked is None:
            self._watch.begin()
            self._looked = self._time
        self._feed.topic_rows.measure(sample)
        self._watch.seen(sample.stream, sample.stamp)
        self._watch.took(sample, report, 0.0)
        for key, encoded in self._encoder.fill(report):
            if key in self._names:
                self._feed.topic_rows.take_encoded(self._names[key], encoded, self._feed.now())
        if self._time - self._looked >= diagnosis_period or self._watch.is_urgent():
            self._look()

    def _look(self) -> None:
        found = self._watch.look(self.twin.counts, "", self._peers, (), self._time)
        store, now = self._feed.store, self._feed.now()
        store.set_statuses(now, store.statuses(now).updated(now, map(_as_message, found), self._time))
        self._looked = self._time


def _as_message(status: Status) -> Any:
    values = [SimpleNamespace(key=key, value=str(value)) for key, value in status.values.items()]
    return SimpleNamespace(name=f"{NODE}: {status.name}", level=status.level, message=status.message, values=values)
