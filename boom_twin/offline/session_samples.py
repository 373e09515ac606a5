"""Reader process of a replay: reads a session and decodes its messages to samples and recorded changes."""

from __future__ import annotations

import pickle
import sys
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from itertools import repeat
from pathlib import Path

from ..bag.reader import Session, read, read_blocks, scan
from ..bag.session_file import PARSE_ERRORS
from ..bag.time_window import WHOLE, TimeWindow
from ..errors import BoomTwinError
from ..messages.cdr_decoder import CdrDecoder
from ..messages.report_encoder import decode_changes
from ..messages.sample_decoder import SampleDecoder
from ..messages.topic_table import TYPES, Output, Topics
from ..messages.type_store import decode, jazzy
from ..twin.blocks import SampleBlock, block_of, samples_in
from ..types import SENSORS, Change, Sample, Stream
from .process_pipe import END, Pipe, post, say_ready

NEAR = 2_000_000_000
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
        if abs(log - logged) > NEAR:
            return log > logged
        return stamp == change.stamp or self._before < change.stamp < stamp < change.stamp + NEAR


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


Item = SampleBlock | Change | int | Counter[str]
"""Item that goes up the pipe, see `items_of`."""
BATCH = 400
"""Messages in one block up the pipe, at least."""


class SampleReader:
    """Samples of a session, many at a time; iterate once.

    Parameters
    ----------
    path : Path
        Of the session.
    topics : Topics
        How its topics and sensors are named, and read.
    wanted : list of str
        The input topics to be read.
    joints : int
        Of the scene.
    window : TimeWindow, optional
        The part of the session that is read.
    process : Pipe, optional
        From `started`, where it was begun before all of this was known.

    Attributes
    ----------
    oddities : Counter
        Of the decoder, once the iteration has ended.
    """

    def __init__(
        self,
        path: Path,
        topics: Topics,
        wanted: list[str],
        joints: int,
        window: TimeWindow = WHOLE,
        process: Pipe | None = None,
    ) -> None:
        self._pipe = process or self.started()
        self._pipe.send((path, topics, wanted, joints, window))
        self._joints = joints
        self.oddities: Counter[str] = Counter()

    @staticmethod
    def started() -> Pipe:
        """Return the pipe of the process, which begins its imports."""
        return Pipe(__name__)

    def wait_ready(self) -> None:
        """Wait until the process can begin."""
        self._pipe.wait_ready()

    def __iter__(self) -> Iterator[SampleBlock | Change | None]:
        """Yield samples in the order of log times, each change before its sample.

        After a block comes one None for each of its messages that could not be used.
        """
        for item in self._pipe.receive():
            if isinstance(item, Counter):
                self.oddities = item
            elif isinstance(item, int):
                yield from repeat(None, item)
            else:
                yield item
        self._pipe.finish()

    def samples(self) -> Iterator[Sample | Change | None]:
        """Yield samples, changes and None as in an iteration of the reader, but one sample at a time."""
        for item in self:
            if isinstance(item, SampleBlock):
                yield from samples_in(item, self._joints)
            else:
                yield item

    def stop(self) -> None:
        """End the process."""
        self._pipe.stop()


def items_of(path: Path, topics: Topics, wanted: list[str], joints: int, window: TimeWindow = WHOLE) -> Iterator[Item]:
    """Yield the items that go up the pipe, for `SampleReader` to unpack.

    A whole number stands for as many None. The last item is the count of oddities.

    Raises
    ------
    BagError
        The session cannot be read.
    """
    heard: dict[str, list[Stream]] = topics.heard
    session, decoder = scan(path), SampleDecoder(joints, topics)
    changes = recorded_changes(session, topics)
    blocks = read_blocks(session, {name: topics.inputs[heard[name][0]].type for name in wanted}, window)
    streams = [heard[source.name] for source in blocks.sources]
    wires = [CdrDecoder(TYPES[group[0]], decode, SENSORS[group[0]].field) for group in streams]
    waiting, count, told = list[Sample](), 0, 0

    def batch() -> Iterator[Item]:
        """Yield the samples that wait, and how many messages were refused since the last batch."""
        nonlocal count, told
        if waiting:
            yield block_of(waiting, joints)
            waiting.clear()
        if refused := decoder.refused - told:
            yield refused
        count, told = 0, decoder.refused

    for block in blocks:
        for row, source in enumerate(block.sources.tolist()):
            try:
                stamp, message = wires[source].read(block.data(row))
            except PARSE_ERRORS:
                blocks.decoded(block, row)  # raises it with its place
                raise
            if changes.are_left and Stream.STROKES in streams[source]:
                for change in changes.due(int(block.log_times[row]), stamp):
                    yield from batch()
                    yield change
            waiting += decoder.samples(streams[source], stamp, message)
            count += 1
            if count >= BATCH:
                yield from batch()
    waiting += decoder.assembler.rest()
    yield from batch()
    yield decoder.oddities


def _ready_items(task: tuple[Path, Topics, list[str], int, TimeWindow]) -> Iterator[Item]:
    """Return the items that go up the pipe; compile the decoders first."""
    for kind in SENSORS.values():
        jazzy().get_msgdef(kind.message)  # compiles its decoder
    return items_of(*task)


def main() -> int:
    """Send the samples of a session up the pipe; exit code 1 with the reason on stderr if it cannot be read."""
    try:
        items = _ready_items(pickle.load(sys.stdin.buffer))
        say_ready()
        for item in items:
            post([item])
        post([END])
    except BrokenPipeError:
        return 0
    except BoomTwinError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
