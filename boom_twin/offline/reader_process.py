"""Read a session, and map its messages to samples, in a process ahead of the replay."""

from __future__ import annotations

import pickle
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..errors import BoomTwinError
from ..records import Change, Sample, Stream
from .changes import recorded_changes
from .intake import Intake, stamp_of
from .pipe import END, Pipe, post, say_ready
from .reader import read, scan
from .topics import Topics

BATCH = 400  # samples in one pickle
Packed = tuple[str, int, bytes] | Change | None


class Ahead:
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
        Of the intake, once the iteration has ended.
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
    intake = Intake(joints, topics)
    say_ready()
    batch: list[Packed] = []
    try:
        session = scan(path)
        changes = recorded_changes(session, topics)
        for name, log, message in read(session, {name: topics.inputs[heard[name][0]].type for name in wanted}):
            stamp = stamp_of(message)
            if Stream.STROKES in heard[name]:
                batch += changes.due(log, stamp)
            found = [sample for stream in heard[name] if (sample := intake.put(stream, stamp, message)) is not None]
            batch += [(sample.stream.value, stamp, sample.values.tobytes()) for sample in found] or [None]
            if len(batch) >= BATCH:
                post([batch])
                batch = []
    except BrokenPipeError:
        return 0
    except BoomTwinError as error:
        print(error, file=sys.stderr)
        return 1
    post([batch, intake.oddities, END])
    return 0


if __name__ == "__main__":
    sys.exit(main())
