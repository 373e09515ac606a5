"""Reader process of a replay: reads a session and decodes its messages to samples and recorded changes."""

from __future__ import annotations

import pickle
import sys
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from ..bag.reader import Session, read, scan
from ..errors import BoomTwinError
from ..messages.report_encoder import decode_changes
from ..messages.sample_decoder import SampleDecoder, stamp_of
from ..messages.topic_table import Output, Topics
from ..types import Change, Sample, Stream
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


BATCH = 400  # samples in one pickle
Packed = tuple[str, int, bytes] | Change | None


class SampleReader:
    """The samples of a session; iterate once.

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
        self.oddities: Counter[str] = Counter()

    def wait_ready(self) -> None:
        """Until the process can begin."""
        self._pipe.wait_ready()

    def __iter__(self) -> Iterator[Sample | Change | None]:
        """Samples in the order of log times, changes before theirs; None for a message without any usable value."""
        streams = {stream.value: stream for stream in Stream}
        for batch in self._pipe.receive():
            if isinstance(batch, Counter):
                self.oddities = batch
                continue
            for packed in batch:
                if packed is None or isinstance(packed, Change):
                    yield packed
                else:
                    yield Sample(streams[packed[0]], packed[1], np.frombuffer(packed[2]))
        self._pipe.finish()

    def stop(self) -> None:
        """End the process."""
        self._pipe.stop()


def main() -> int:
    """Send the samples of a session up the pipe; exit code 1 with the reason on stderr if it cannot be read."""
    path, topics, wanted, joints = pickle.load(sys.stdin.buffer)
    heard: dict[str, list[Stream]] = topics.heard
    decoder = SampleDecoder(joints, topics)
    say_ready()
    batch: list[Packed] = []
    try:
        session = scan(path)
        changes = recorded_changes(session, topics)
        for name, log, message in read(session, {name: topics.inputs[heard[name][0]].type for name in wanted}):
            stamp = stamp_of(message)
            if Stream.STROKES in heard[name]:
                batch += changes.due(log, stamp)
            found = decoder.samples(heard[name], stamp, message)
            batch += [(sample.stream.value, stamp, sample.values.tobytes()) for sample in found] or [None]
            if len(batch) >= BATCH:
                post([batch])
                batch = []
    except BrokenPipeError:
        return 0
    except BoomTwinError as error:
        print(error, file=sys.stderr)
        return 1
    post([batch, decoder.oddities, END])
    return 0


if __name__ == "__main__":
    sys.exit(main())
