"""Put together names that come in messages of their own, and leave out streams that two sources publish."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..types import SECOND, Array, Sample, Stream

LONGEST_CYCLE = SECOND  # ns between stamps of one cycle; a twin needs several strokes a second
CONTESTED_FOR = SECOND  # ns without a contradiction, after which a stream has one source again


class Reading(NamedTuple):
    """Sample of one message; `is_whole` if all names are in it; frame of an Imu (empty for a JointState)."""

    sample: Sample
    is_whole: bool
    frame: str


class _Line:
    """Newest samples of one stream."""

    def __init__(self) -> None:
        self.group: Sample | None = None  # names of one cycle that came up to now
        self.started = self.first = np.zeros(0, bool)  # channels of the message that began it, and the newest complete one
        self.newest: list[Sample] = []  # the first and the last one with the newest stamp
        self.before: list[Sample] = []  # those with the stamp before
        self.frame: str | None = None
        self.contested: int | None = None  # stamp of the newest contradiction, ns


class SampleAssembler:
    """Assembler of samples of all streams from single messages, for the live node and the replay.

    A sample has the stamp of the first message of its cycle. A cycle ends when it has all names. It also ends before a name
    that it has already, or before the name that began the previous cycle.

    ``names apart``, ``missing names`` and ``two sources`` are counted in `oddities`. Samples that are left out because of two
    sources are counted in `refused`. The twin itself finds a second source of the stream that drives the model (`drive`).
    """

    def __init__(self, wanted: Mapping[Stream, NDArray[np.bool_]], oddities: Counter[str], drive: Stream) -> None:
        self._wanted, self._oddities, self._drive, self.refused = wanted, oddities, drive, 0
        self._lines = {stream: _Line() for stream in Stream}

    def take(self, reading: Reading) -> Iterator[Sample]:
        """Yield the samples that are complete with this message, in their order."""
        sample, line = reading.sample, self._lines[reading.sample.stream]
        found = [*self._ended(line), sample] if reading.is_whole else [*self._gathered(line, sample)]
        for each in found:
            if each.stream is self._drive or not self._is_contested(line, each, reading.frame):
                yield each

    def rest(self) -> Iterator[Sample]:
        """Yield the incomplete cycle of every stream after the last message."""
        for line in self._lines.values():
            yield from self._ended(line)

    def is_regular(self, stream: Stream, stamps: NDArray[np.int64], frame: str) -> bool:
        """Return True if messages with all names at these stamps (ns) are samples as they stand, and nothing else."""
        line = self._lines[stream]
        if line.group is not None or stream is self._drive:
            return line.group is None
        known = np.concatenate([[each.stamp for each in line.newest[-1:]], stamps])
        return line.contested is None and frame == (line.frame or frame) and bool((known[1:] != known[:-1]).all())

    def note(self, stream: Stream, stamps: NDArray[np.int64], values: Array, frame: str) -> None:
        """Keep the newest two of such samples, values (k, channels)."""
        line, newest = self._lines[stream], [Sample(stream, int(stamps[row]), values[row]) for row in (-2, -1)]
        line.before, line.newest, line.frame = newest[:1], newest[1:], frame

    def _gathered(self, line: _Line, sample: Sample) -> Iterator[Sample]:
        """Yield the cycle that ends before a message with some of the names, and the one that is complete with it."""
        has = np.isfinite(sample.values)
        if line.group is not None and not self._is_of_cycle(line, line.group, sample, has):
            yield from self._ended(line)
        if line.group is None:
            line.group, line.started = sample, has
        else:
            self._oddities["names apart"] += 1
            line.group = Sample(sample.stream, line.group.stamp, np.where(has, sample.values, line.group.values))
        if np.isfinite(line.group.values[self._wanted[sample.stream]]).all():
            group, line.group, line.first = line.group, None, line.started
            yield group

    @staticmethod
    def _is_of_cycle(line: _Line, group: Sample, sample: Sample, has: NDArray[np.bool_]) -> bool:
        """Return True if a message with the channels `has` continues a cycle."""
        if (has & np.isfinite(group.values)).any() or abs(sample.stamp - group.stamp) > LONGEST_CYCLE:
            return False
        return sample.stamp == group.stamp or not (len(line.first) and (has & line.first).any())

    def _ended(self, line: _Line) -> Iterator[Sample]:
        if line.group is not None:
            group, line.group = line.group, None
            self._oddities["missing names"] += 1
            yield group

    def _is_contested(self, line: _Line, sample: Sample, frame: str) -> bool:
        """Return True if two sources publish a stream. Neither is used, because the right one is unknown."""
        if line.newest and line.newest[-1].stamp == sample.stamp:
            line.newest = [line.newest[0], sample]
        else:
            line.before, line.newest = line.newest, [sample]
        if frame != (line.frame or frame) or _are_of_two(line.before, line.newest):
            line.contested = sample.stamp
        line.frame = frame
        if line.contested is None or abs(sample.stamp - line.contested) > CONTESTED_FOR:
            return False
        self._oddities["two sources"] += 1
        self.refused += 1
        return True


def _are_of_two(before: list[Sample], newest: list[Sample]) -> bool:
    """Return True if pairs of samples at two stamps are of two sources, and not of one whose stamps are coarse."""
    apart = 10.0  # difference of two sources at one stamp, over the change of each of them since the stamp before
    if len(before) < 2 or len(newest) < 2:
        return False
    (a, b), (c, d) = ((pair[0].values, pair[-1].values) for pair in (before, newest))
    across, *along = (np.fmax.reduce(np.abs(x - y), initial=0.0) for x, y in ((c, d), (c, a), (d, b)))
    return bool(across > apart * max(along))
