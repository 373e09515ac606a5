"""Read a session, and map its messages to samples, in a process ahead of the replay."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from ..errors import BoomTwinError
from ..records import Change, Sample, Stream
from .changes import recorded_changes
from .intake import Intake, stamp_of
from .pipe import Pipe, post, say_ready
from .reader import read, scan
from .topics import TYPES

BATCH = 400  # samples in one pickle
Packed = tuple[str, int, bytes] | Change | None


class Ahead:
    """The samples of a session; iterate once.

    Parameters
    ----------
    path : Path
        Of the session.
    wanted : mapping of str to Stream
        Topics and their roles.
    count : int
        Number of joints.

    Attributes
    ----------
    oddities : Counter
        Of the intake, once the iteration has ended.
    """

    def __init__(self, path: Path, wanted: Mapping[str, Stream], count: int) -> None:
        roles = [f"{name}={stream.value}" for name, stream in wanted.items()]
        self._pipe = Pipe(__name__, str(path), str(count), *roles)
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


def main(arguments: list[str]) -> int:
    """Send the samples of a session up the pipe; exit code 1 with the reason on stderr if it cannot be read."""
    wanted = {name: Stream(role) for name, role in (text.rsplit("=", 1) for text in arguments[2:])}
    intake = Intake(int(arguments[1]))
    say_ready()
    batch: list[Packed] = []
    try:
        session = scan(Path(arguments[0]))
        changes = recorded_changes(session)
        for name, log, message in read(session, {name: TYPES[role] for name, role in wanted.items()}):
            role = wanted[name]
            if role is Stream.STROKES:
                batch += changes.due(log, stamp_of(message))
            sample = intake.put(role, stamp_of(message), message)
            batch.append(None if sample is None else (role.value, sample.stamp, sample.values.tobytes()))
            if len(batch) == BATCH:
                post([batch])
                batch = []
    except BrokenPipeError:
        return 0
    except BoomTwinError as error:
        print(error, file=sys.stderr)
        return 1
    post([batch, intake.oddities])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
