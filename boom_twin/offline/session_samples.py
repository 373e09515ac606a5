"""Samples of a session in blocks, and the recorded changes, in the order of log times."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from itertools import repeat
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..bag.reader import Session, read, read_blocks
from ..bag.session_file import WHOLE, SessionBlocks, TimeWindow
from ..bag.writer import RESULT_CHUNK_SIZE, MessageWriter
from ..config.settings import Settings
from ..messages.cdr_decoder import CdrDecoder, MessageBlock, stamp_in
from ..messages.report_encoder import ReportEncoder, decode_changes
from ..messages.sample_decoder import SampleDecoder
from ..messages.topic_table import Output, Topic, Topics
from ..scene.schema import Scene
from ..twin.blocks import CODES, ReportBlock, SampleBlock, block_of, samples_in
from ..types import SENSORS, Array, Change, Integers, Sample, Stream


class Changes:
    """Changes of a session. A replay repeats each before the stroke sample at which it took effect.

    `logged` are changes with their log times (ns), in the order of log times.
    """

    def __init__(self, logged: Iterable[tuple[int, Change]]) -> None:
        self._waiting = deque(logged)
        self._before = -1

    def due(self, log: int, stamp: int) -> Iterable[Change]:
        """Yield the changes that take effect at the stroke sample of that log time and stamp (ns).

        A change whose own sample was not recorded takes effect at the next one.
        """
        while self._waiting and self._begins(*self._waiting[0], log, stamp):
            yield self._waiting.popleft()[1]
        self._before = stamp

    @property
    def are_left(self) -> bool:
        """Return True if any change has not taken effect yet."""
        return bool(self._waiting)

    def _begins(self, logged: int, change: Change, log: int, stamp: int) -> bool:
        change_span = 2_000_000_000  # ns, of log time and of stamps; a looped session repeats stamps
        if abs(log - logged) > change_span:
            return log > logged
        if self._before < 0:
            return change.stamp <= stamp  # an earlier one is latched: it was made before the recording began
        return stamp == change.stamp or self._before < change.stamp < stamp < change.stamp + change_span


def recorded_changes(session: Session, topics: Topics) -> Changes:
    """Return the changes that were made while the session was recorded; `topics` names its topics.

    Raise BagError if the session cannot be read, or holds what is no change.
    """
    topic = topics.outputs[Output.CHANGES]
    if not session.count(topic.absolute):
        return Changes([])
    return Changes((log, decode_changes(msg)) for _, log, msg in read(session, {topic.absolute: topic.type}))


def topics_read(session: Session, topics: Topics) -> dict[str, str]:
    """Return types by name of the inputs that are read: that which drives the model, and others that have messages."""
    drive, heard = topics.stroke_reading.stream, topics.streams_by_topic
    names = [name for name, streams in heard.items() if drive in streams or session.count(name)]
    return {name: topics.inputs[heard[name][0]].type for name in names}


class SessionSamples:
    """Iterator of the samples of a session in blocks, for one pass. Only the `window` of the session is read."""

    def __init__(self, session: Session, topics: Topics, joints: int, window: TimeWindow = WHOLE) -> None:
        self._session, self._topics, self._window = session, topics, window
        self._joints, self._decoder = joints, SampleDecoder(joints, topics)
        self._waiting: list[SampleBlock] = []
        self._refused = 0  # messages that were told

    @property
    def oddities(self) -> Counter[str]:
        return self._decoder.oddities

    def __iter__(self) -> Iterator[SampleBlock | Change | None]:
        """Yield samples in the order of log times, each change before its sample.

        After a block comes one None for each of its messages that could not be used. Raise BagError if the session cannot be
        read.
        """
        batch = 400  # messages in one block, at least
        heard, session = self._topics.streams_by_topic, self._session
        changes = recorded_changes(session, self._topics)
        blocks, count = read_blocks(session, topics_read(session, self._topics), self._window), 0
        streams, drive = [heard[source.name] for source in blocks.sources], self._topics.stroke_reading.stream
        wires = [decoder_of(group) for group in streams]
        for block in blocks:
            first = 0
            while first < len(block):
                part = block.chosen(slice(first, first + (1 if changes.are_left else batch)))
                if changes.are_left and drive in streams[part.sources[0]]:
                    for change in changes.due(int(part.log_times[0]), stamp_in(part.data(0)) or 0):
                        yield from self._batch()
                        yield change
                self._take(blocks, part, wires, streams)
                first, count = first + len(part), count + len(part)
                if count >= batch:
                    count = 0
                    yield from self._batch()
        self._keep([(0, each) for each in self._decoder.assembler.rest()], [])
        yield from self._batch()

    def _take(self, blocks: SessionBlocks, part: MessageBlock, wires: list[CdrDecoder], streams: list[list[Stream]]) -> None:
        """Decode messages: those of a source at once if all are regular, others one by one in their order."""
        irregular, regular = list[Integers](), list[tuple[Integers, Stream, Integers, Array]]()
        for source in sorted(set(part.sources.tolist())):
            rows, found = np.flatnonzero(part.sources == source), None
            if len(rows) > 1 and (read := wires[source].read_many(part.chosen(rows))) is not None:
                found = self._decoder.many(streams[source], *read)
            if found is None:
                irregular.append(rows)
            else:
                regular += [(rows, *each) for each in found]
        single = list[tuple[int, Sample]]()
        for row in np.sort(np.concatenate(irregular)).tolist() if irregular else ():
            source = int(part.sources[row])
            stamp, message = blocks.read(wires[source], part, row)
            single += [(row, each) for each in self._decoder.samples(streams[source], stamp, message)]
        self._keep(single, regular)

    def _keep(self, single: list[tuple[int, Sample]], regular: list[tuple[Integers, Stream, Integers, Array]]) -> None:
        """Keep samples for the next block, in the order of their messages."""
        rows = [np.array([row for row, _ in single], int)]
        parts = [block_of([sample for _, sample in single], self._joints)]
        for at, stream, stamps, own in regular:
            values = np.full((len(at), parts[0].values.shape[1]), np.nan)
            values[:, : own.shape[1]] = own
            rows.append(at)
            parts.append(SampleBlock(np.full(len(at), CODES[stream]), stamps, values))
        order = np.argsort(np.concatenate(rows), kind="stable")
        self._waiting.append(SampleBlock(*(np.concatenate(column)[order] for column in zip(*parts, strict=True))))

    def _batch(self) -> Iterator[SampleBlock | None]:
        """Yield the samples that wait, and None for each message that was refused since the last batch."""
        waiting = [block for block in self._waiting if len(block.stamps)]
        self._waiting.clear()
        if waiting:
            yield SampleBlock(*map(np.concatenate, zip(*waiting, strict=True)))
        refused, self._refused = self._decoder.refused - self._refused, self._decoder.refused
        yield from repeat(None, refused)

    def samples(self) -> Iterator[Sample | Change | None]:
        """Yield samples, changes and None as an iteration does, but one sample at a time."""
        for item in self:
            if isinstance(item, SampleBlock):
                yield from samples_in(item, self._joints)
            else:
                yield item


def decoder_of(streams: list[Stream]) -> CdrDecoder:
    return CdrDecoder(SENSORS[streams[0]].message, field=SENSORS[streams[0]].field)


ITEMS_AHEAD = 8  # blocks of samples, or of reports, that wait between two threads
Item = TypeVar("Item")


def read_ahead(items: Iterable[Item]) -> Generator[Item]:
    """Yield the items of an iterable; a thread reads up to `ITEMS_AHEAD` of them in advance."""
    iterator, end = iter(items), object()
    thread = ThreadPoolExecutor(1, "read")
    try:
        waiting = deque(thread.submit(next, iterator, end) for _ in range(ITEMS_AHEAD))
        while (item := waiting.popleft().result()) is not end:
            waiting.append(thread.submit(next, iterator, end))
            yield item  # type: ignore[misc]
    finally:
        thread.shutdown(cancel_futures=True)


@contextmanager
def result_bag(
    directory: Path, notes: Mapping[str, str], topics: Topics, scene: Scene, settings: Settings
) -> Iterator[Callable[[ReportBlock], None]]:
    """Yield a function that queues reports for a thread, which writes them to a bag.

    The bag is complete if the block ends without an exception. Raise BagError if the bag cannot be written. The function
    raises it, too.
    """
    encoder = ReportEncoder(scene, settings, topics.frame)
    outputs: dict[str, Topic] = {key: topic for key, topic in topics.outputs.items() if key is not Output.DIAGNOSTICS}
    with MessageWriter(directory, outputs, notes, chunk_size=RESULT_CHUNK_SIZE) as bag:
        thread, waiting = ThreadPoolExecutor(1, "write"), deque[Future[None]]()

        def put(rows: ReportBlock) -> None:
            if len(waiting) == ITEMS_AHEAD:
                waiting.popleft().result()
            waiting.append(thread.submit(lambda: bag.write_block(encoder.fill_block(rows))))

        try:
            yield put
            for each in waiting:
                each.result()
        finally:
            thread.shutdown(cancel_futures=True)
