"""Inspection of a session: counts, rates, gaps, clocks and names of every topic, and storage."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..messages.cdr_decoder import MessageBlock, has_header, stamp_in
from ..messages.type_store import jazzy
from ..types import NANO, Array, Integers
from .reader import Session, scan
from .session_file import CDR, MOST_TOGETHER, WHOLE, SessionBlocks, SessionFile, TimeWindow, schema_of


def spacing_faults(stamps: NDArray[np.int64]) -> Iterator[str]:
    """Yield a sentence each if a sensor's stamps (ns) step back, are equal, or come in bursts; with the remedy."""
    around, tiny = 32, 0.1  # steps, more than a packet has; share of the largest of them, less than sampling jitters
    steps = np.diff(stamps)
    if len(back := np.flatnonzero(steps < 0)):
        one, two = (stamps[back[0] : back[0] + 2] - stamps.min()) * NANO
        told = "Look for a counter that wraps, a clock that was set, two publishers, or a looped bag"
        times = "once" if len(back) == 1 else f"{len(back)} times"
        yield f"stamps step back {times}, first from {one:.3f} to {two:.3f} s. {told}."
    if shared := int((steps == 0).sum()):
        most = int(np.diff(np.flatnonzero(np.r_[1, steps, 1])).max())
        told = f"up to {most} readings share one, of which one is used. Export more digits, or look for two publishers"
        yield f"{shared} of {len(stamps)} stamps equal the one before: {told}."
    if len(ahead := steps[steps > 0]) > around:
        largest = np.lib.stride_tricks.sliding_window_view(np.pad(ahead, around // 2, "edge"), around + 1).max(axis=1)
        starts = np.flatnonzero(ahead >= tiny * largest)
        if 1 < len(starts) <= 0.6 * len(ahead):
            count, period = len(ahead) / len(starts), float(np.median(np.diff(np.cumsum(ahead)[starts]))) * NANO
            told = "they are stamped on arrival, so the boom seems to jerk. Stamp each when it is measured"
            yield f"readings come in bursts of {count:.0f}, {period:.3g} s apart: {told}."


SENSORS_IN = slice(12, 40)  # bytes of a JointState behind its stamp, up to the number of the first sensor


class Skew(NamedTuple):
    """Log time minus stamp, s: smallest, mean and largest."""

    least: float
    mean: float
    most: float


@dataclass(slots=True)
class Tally:
    """Statistics of one topic.

    Steps are between stamps; without a header, between log times. A stamp of 0 is left out.
    """

    name: str
    type: str
    count: int = 0
    first: int = 0  # first, last: log times, ns
    last: int = 0
    gap: int = 0  # gap, gap_after: largest step between two stamps; log time of the message before it; ns
    gap_after: int = 0
    not_increasing: int = 0  # number of messages whose stamp is not after that of the message before
    unset: int = 0  # number of messages with a stamp of 0 or too short for a stamp
    stamps: array[int] = field(default_factory=lambda: array("q"))  # of messages with the sensors of the first
    _sensors: bytes = b""
    _skewed: int = 0  # messages whose log time is compared with their stamp
    _skews: tuple[float, float, float] = (inf, 0.0, -inf)  # least, sum and largest of log time minus stamp, ns
    _newest: tuple[Integers, Integers] = (np.zeros(0, np.int64), np.zeros(0, np.int64))  # stamp and log time, once there is one

    def add(self, block: MessageBlock, is_stamped: bool) -> None:
        """Count messages, one or more, in the order of their log times. Messages that are stamped have a header."""
        self.first, self.last = self.first if self.count else int(block.log_times[0]), int(block.log_times[-1])
        self.count += len(block)
        stamps = logs = block.log_times.astype(np.int64)
        if is_stamped:
            data = [block.data(row) for row in range(len(block))]
            stamps = np.array([stamp_in(each) or 0 for each in data], np.int64)
            own = np.flatnonzero(stamps)
            self.unset += len(stamps) - len(own)
            sensors = [data[row][SENSORS_IN] for row in own]
            stamps, logs = stamps[own], logs[own]
            self._compare((logs - stamps).astype(float))
            self._sensors = self._sensors or next(iter(sensors), b"")
            if len(self.stamps) < MOST_TOGETHER:  # on a bus, each sensor has messages of its own
                self.stamps.frombytes(stamps[[each == self._sensors for each in sensors]].tobytes())
        stamps, logs = (np.concatenate(pair) for pair in zip(self._newest, (stamps, logs), strict=True))
        self._newest, steps = (stamps[-1:], logs[-1:]), np.diff(stamps)
        self.not_increasing += int((steps <= 0).sum())
        if steps.max(initial=0) > self.gap:
            self.gap, self.gap_after = int(steps.max()), int(logs[steps.argmax()])

    @property
    def rate(self) -> float | None:
        """Messages per second of log time; None for fewer than two, or no time between them."""
        return (self.count - 1) / ((self.last - self.first) * NANO) if self.last > self.first else None

    @property
    def skew(self) -> Skew | None:
        """Log time minus stamp of its messages; None for messages without stamps."""
        least, total, most = self._skews
        return Skew(least * NANO, total * NANO / self._skewed, most * NANO) if self._skewed else None

    def _compare(self, skews: Array) -> None:
        least, total, most = self._skews
        self._skews = skews.min(initial=least), total + skews.sum(), skews.max(initial=most)
        self._skewed += len(skews)


@dataclass(frozen=True, slots=True)
class BagInfo:
    """Statistics of a session and of its topics."""

    session: Session
    tallies: tuple[Tally, ...]  # sorted by the name of the topic
    window: TimeWindow = WHOLE  # part of the session that the tallies count

    @property
    def span(self) -> tuple[int, int]:
        """Log times (ns) of the first and last message in the window."""
        if self.window == WHOLE:
            return self.session.start, self.session.end
        seen = [tally for tally in self.tallies if tally.last]
        return min(tally.first for tally in seen), max(tally.last for tally in seen)

    @property
    def synthetic(self) -> bool | None:
        """Return True if the session is noted as synthetic; None if its origin is not noted."""
        origin = self.session.notes.get("origin")
        return None if origin is None else "synthetic" in origin.lower()

    def tally(self, name: str) -> Tally | None:
        """Return the tally of a topic; the leading slash is optional."""
        return next((each for each in self.tallies if each.name.lstrip("/") == name.lstrip("/")), None)


def inspect(path: Path, window: TimeWindow = WHOLE) -> BagInfo:
    """Read a session once and return the statistics of its messages in the window; of others than CDR only their number.

    The window counts from the first message of the session. Raise BagError if there is no session, it is damaged, or no message
    is in the window.
    """
    session = scan(path)
    tallies = {topic.name: Tally(topic.name, topic.type) for topic in session.topics}
    read = list[tuple[SessionFile, set[int]]]()
    for file in session.files:
        encoded = {key for key, channel in file.channels.items() if channel.message_encoding == CDR}
        read.append((file, encoded))
        for key in file.channels.keys() - encoded:
            tallies[file.channels[key].topic].count += file.counts.get(key, 0)
    blocks = SessionBlocks(read, {name: name for name in tallies}, window)
    are_stamped = [
        (schema := schema_of(0, each.type) if each.type in jazzy().types else each.schema) is not None and has_header(schema)
        for each in blocks.sources
    ]
    for block in blocks:
        for source in sorted(set(block.sources.tolist())):
            own = block.chosen(np.flatnonzero(block.sources == source))
            tallies[blocks.sources[source].topic].add(own, are_stamped[source])
    return BagInfo(session, tuple(tallies.values()), window)
