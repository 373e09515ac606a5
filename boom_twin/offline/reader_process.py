"""Reader process of a replay: reads a session and decodes its messages to samples and recorded changes."""

from __future__ import annotations

import pickle
import sys
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from itertools import repeat
from pathlib import Path

import numpy as np

from ..bag.reader import Session, read, read_blocks, scan
from ..errors import BoomTwinError
from ..messages.block_decoder import BlockDecoder, DecodedBlock, together
from ..messages.message_block import MessageBlock
from ..messages.report_encoder import decode_changes
from ..messages.topic_table import Output, Topics
from ..messages.type_store import jazzy
from ..twin.blocks import SampleBlock, samples_in
from ..types import SENSORS, Change, Sample, Stream
from .process_pipe import END, Pipe, post, say_ready

NEAR = 2_000_000_000
"""Nanoseconds, of log time and of stamps, within which a change and its stroke sample are looked for.

A looped session repeats stamps; a stray stamp is far from its stream.
"""


class Changes:
    """The changes of a session, each to be repeated before the stroke sample that it began with.

    Parameters
    ----------
    logged : iterable of (int, Change)
        With their log times (ns), in that order.
    """

    def __init__(self, logged: Iterable[tuple[int, Change]]) -> None:
        self._waiting = deque(logged)
        self._before = -1

    def due(self, log: int, stamp: int) -> Iterable[Change]:
        """Those that begin with a stroke sample of that log time and stamp (ns).

        A change whose own sample was not recorded begins with the next one.
        """
        while self._waiting and self._begins(*self._waiting[0], log, stamp):
            yield self._waiting.popleft()[1]
        self._before = stamp

    @property
    def are_left(self) -> bool:
        """Whether any has not begun yet."""
        return bool(self._waiting)

    def _begins(self, logged: int, change: Change, log: int, stamp: int) -> bool:
        if abs(log - logged) > NEAR:
            return log > logged
        return stamp == change.stamp or self._before < change.stamp < stamp < change.stamp + NEAR


def recorded_changes(session: Session, topics: Topics) -> Changes:
    """What was changed while the session was recorded, its topics named by `topics`.

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


BATCH = 400
"""Messages in one block up the pipe, at least."""
MOST = 1200
"""Messages that are decoded at once, at most."""


class SampleReader:
    """The samples of a session, many at a time; iterate once.

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

    Attributes
    ----------
    oddities : Counter
        Of the decoder, once the iteration has ended.
    """

    def __init__(self, path: Path, topics: Topics, wanted: list[str], joints: int) -> None:
        self._pipe = Pipe(__name__)
        self._pipe.send((path, topics, wanted, joints))
        self._joints = joints
        self.oddities: Counter[str] = Counter()

    def wait_ready(self) -> None:
        """Until the process can begin."""
        self._pipe.wait_ready()

    def __iter__(self) -> Iterator[SampleBlock | Change | None]:
        """Samples in the order of log times, changes before theirs.

        After a block comes a None for every message among its own that had no usable value.
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
        """The same, one sample at a time."""
        for item in self:
            if isinstance(item, SampleBlock):
                yield from samples_in(item, self._joints)
            else:
                yield item

    def stop(self) -> None:
        """End the process."""
        self._pipe.stop()


class _Outbox:
    """Puts samples together on their way up the pipe."""

    def __init__(self) -> None:
        self._waiting: list[SampleBlock] = []
        self._messages = self._without = 0

    def put(self, found: DecodedBlock) -> None:
        """Samples, and how many messages had none, in their turn."""
        self._waiting.append(found.samples)
        self._messages += len(found.stamps)
        self._without += found.without
        if self._messages >= BATCH:
            self.empty()

    def empty(self) -> None:
        """Send what is there."""
        if self._messages:
            post([together(self._waiting), self._without])
        self._waiting, self._messages, self._without = [], 0, 0


def _in_turn(block: MessageBlock, found: DecodedBlock, changes: Changes, strokes: list[int]) -> Iterator[DecodedBlock | Change]:
    """What was found in a block, its messages from `strokes` being those that changes begin with."""
    done = 0
    for row in np.flatnonzero(np.isin(block.sources, strokes)).tolist() if changes.are_left else ():
        due = tuple(changes.due(int(block.log_times[row]), int(found.stamps[row])))
        if due:
            yield found.part(done, row)
            yield from due
            done = row
    yield found.part(done, len(block))


def _send(path: Path, topics: Topics, wanted: list[str], joints: int) -> None:
    """The samples of a session, then what was odd, up the pipe."""
    heard: dict[str, list[Stream]] = topics.heard
    session = scan(path)
    changes = recorded_changes(session, topics)
    blocks = read_blocks(session, {name: topics.inputs[heard[name][0]].type for name in wanted})
    streams = [heard[source.name] for source in blocks.sources]
    strokes = [number for number, group in enumerate(streams) if Stream.STROKES in group]
    decoder, outbox = BlockDecoder(joints, topics, streams, blocks.decoded), _Outbox()
    for block in blocks:
        for first in range(0, len(block), MOST):
            part = block.chosen(slice(first, first + MOST))
            for found in _in_turn(part, decoder.decode(part), changes, strokes):
                if isinstance(found, Change):
                    outbox.empty()
                    post([found])
                else:
                    outbox.put(found)
    outbox.empty()
    post([decoder.oddities, END])


def main() -> int:
    """Send the samples of a session up the pipe; exit code 1 with the reason on stderr if it cannot be read."""
    task = pickle.load(sys.stdin.buffer)
    for kind in SENSORS.values():
        jazzy().get_msgdef(kind.message)  # compiles its decoder
    say_ready()
    try:
        _send(*task)
    except BrokenPipeError:
        return 0
    except BoomTwinError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
