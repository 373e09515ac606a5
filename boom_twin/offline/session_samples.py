"""Samples of a session in blocks, and the changes that were made while it was recorded, in the order of log times."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Iterator
from itertools import repeat

from ..bag.reader import Session, read, read_blocks
from ..bag.session_file import PARSE_ERRORS
from ..bag.time_window import WHOLE, TimeWindow
from ..messages.cdr_decoder import CdrDecoder
from ..messages.report_encoder import decode_changes
from ..messages.sample_decoder import SampleDecoder
from ..messages.topic_table import TYPES, Output, Topics
from ..messages.type_store import decode
from ..twin.blocks import SampleBlock, block_of, samples_in
from ..types import SENSORS, Change, Sample

CHANGE_SPAN = 2_000_000_000
"""Nanoseconds, of log time and of stamps, within which a change and its stroke sample are looked for.

A looped session repeats stamps; a stray stamp is far from its stream.
"""


class Changes:
    """Changes of a session, each to be repeated before the stroke sample at which it took effect.

    Parameters
    ----------
    logged : iterable of (int, Change)
        With their log times (ns), in that order.
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
        if abs(log - logged) > CHANGE_SPAN:
            return log > logged
        return stamp == change.stamp or self._before < change.stamp < stamp < change.stamp + CHANGE_SPAN


def recorded_changes(session: Session, topics: Topics) -> Changes:
    """Return the changes that were made while the session was recorded; `topics` names its topics.

    Raises
    ------
    BagError
        The session cannot be read, or holds what is no change.
    """
    topic = topics.outputs[Output.CHANGES]
    info = session.find(topic.absolute)
    if info is None or info.count == 0:
        return Changes([])
    return Changes((log, decode_changes(msg)) for _, log, msg in read(session, {topic.absolute: topic.type}))


BATCH = 400  # messages in one block, at least


class SessionSamples:
    """Samples of a session, many at a time; iterate once.

    Parameters
    ----------
    window : TimeWindow, optional
        The part of the session that is read.
    """

    def __init__(self, session: Session, topics: Topics, wanted: list[str], joints: int, window: TimeWindow = WHOLE) -> None:
        self._session, self._topics, self._wanted, self._window = session, topics, wanted, window
        self._joints, self._decoder = joints, SampleDecoder(joints, topics)
        self._waiting: list[Sample] = []
        self._refused = 0  # messages that were told

    @property
    def oddities(self) -> Counter[str]:
        """Oddities of the messages that were read."""
        return self._decoder.oddities

    def __iter__(self) -> Iterator[SampleBlock | Change | None]:
        """Yield samples in the order of log times, each change before its sample.

        After a block comes one None for each of its messages that could not be used.

        Raises
        ------
        BagError
            The session cannot be read.
        """
        heard, decoder, session = self._topics.heard, self._decoder, self._session
        changes = recorded_changes(session, self._topics)
        types = {name: self._topics.inputs[heard[name][0]].type for name in self._wanted}
        blocks, count = read_blocks(session, types, self._window), 0
        streams, drive = [heard[source.name] for source in blocks.sources], self._topics.stroke_reading.stream
        wires = [CdrDecoder(TYPES[group[0]], decode, SENSORS[group[0]].field) for group in streams]
        for block in blocks:
            for row, source in enumerate(block.sources.tolist()):
                try:
                    stamp, message = wires[source].read(block.data(row))
                except PARSE_ERRORS:
                    blocks.decoded(block, row)  # raises it with its place
                    raise
                if changes.are_left and drive in streams[source]:
                    for change in changes.due(int(block.log_times[row]), stamp):
                        yield from self._batch()
                        yield change
                self._waiting += decoder.samples(streams[source], stamp, message)
                count += 1
                if count >= BATCH:
                    count = 0
                    yield from self._batch()
        self._waiting += decoder.assembler.rest()
        yield from self._batch()

    def _batch(self) -> Iterator[SampleBlock | None]:
        """Yield the samples that wait, and None for each message that was refused since the last batch."""
        if self._waiting:
            yield block_of(self._waiting, self._joints)
            self._waiting.clear()
        refused, self._refused = self._decoder.refused - self._refused, self._decoder.refused
        yield from repeat(None, refused)

    def samples(self) -> Iterator[Sample | Change | None]:
        """Yield samples, changes and None as an iteration does, but one sample at a time."""
        for item in self:
            if isinstance(item, SampleBlock):
                yield from samples_in(item, self._joints)
            else:
                yield item
