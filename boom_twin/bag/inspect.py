"""Inspection of a session: counts, rates, gaps, clocks and names of every topic, and storage."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..messages.cdr_decoder import has_header, stamp_in
from ..messages.type_store import jazzy
from ..types import NANO
from .reader import Session, scan
from .session_file import CDR, MOST_TOGETHER, WHOLE, SessionFile, TimeWindow, as_bag_error, schema_of


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
    stamped: bool  # messages have a header
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
    _skews: tuple[int, int, int] = (2**64, 0, -(2**64))  # least, sum and largest of log time minus stamp, ns
    _before: int | None = None

    def add(self, log_time: int, data: bytes) -> None:
        before_this, self.last = self.last, log_time
        if self.count == 0:
            self.first = log_time
        self.count += 1
        stamp: int | None = log_time
        if self.stamped:
            stamp = stamp_in(data)
            if stamp:
                self._compare(log_time - stamp)
                sensors = data[SENSORS_IN]
                self._sensors = self._sensors or sensors
                # on a bus, each sensor has messages of its own
                if sensors == self._sensors and len(self.stamps) < MOST_TOGETHER:
                    self.stamps.append(stamp)
            else:
                self.unset += 1
        if stamp:
            self._step(stamp, before_this)

    @property
    def rate(self) -> float | None:
        """Messages per second of log time; None for fewer than two, or no time between them."""
        return (self.count - 1) / ((self.last - self.first) * NANO) if self.last > self.first else None

    @property
    def skew(self) -> Skew | None:
        """Log time minus stamp of its messages; None for messages without stamps."""
        least, total, most = self._skews
        return Skew(least * NANO, total * NANO / self._skewed, most * NANO) if self._skewed else None

    def _step(self, stamp: int, log_before: int) -> None:
        if self._before is not None:
            if stamp <= self._before:
                self.not_increasing += 1
            elif stamp - self._before > self.gap:
                self.gap, self.gap_after = stamp - self._before, log_before
        self._before = stamp

    def _compare(self, skew: int) -> None:
        least, total, most = self._skews
        self._skews = min(least, skew), total + skew, max(most, skew)
        self._skewed += 1


@dataclass(frozen=True, slots=True)
class BagInfo:
    """Statistics of a session and of its topics."""

    session: Session
    tallies: tuple[Tally, ...]  # sorted by the name of the topic
    library: str  # program that wrote the first file, by its own name
    compression: str  # compression of the chunks: ``zstd``, ``lz4``, ``none``, ..; or a note that the file has no chunks
    size: int  # size of all files, bytes
    window: TimeWindow = WHOLE  # part of the session that the tallies count

    @property
    def span(self) -> tuple[int, int]:
        """Log times (ns) of the first and last message in the window; its beginning for both if empty."""
        if self.window == WHOLE:
            return self.session.start, self.session.end
        seen = [tally for tally in self.tallies if tally.count]
        begin = self.window.bounds(self.session.start)[0]
        return min((tally.first for tally in seen), default=begin), max((tally.last for tally in seen), default=begin)

    @property
    def synthetic(self) -> bool | None:
        """Return True if the session is noted as synthetic; None if its origin is not noted."""
        origin = self.session.notes.get("origin")
        return None if origin is None else "synthetic" in origin.lower()

    def tally(self, name: str) -> Tally | None:
        """Return the tally of a topic; the leading slash is optional."""
        return next((each for each in self.tallies if each.name.lstrip("/") == name.lstrip("/")), None)


def inspect(path: Path, window: TimeWindow = WHOLE) -> BagInfo:
    """Read a session once and return the statistics of its messages in the window.

    The window counts from the first message of the session. Raise BagError if there is no session, or it is damaged.
    """
    session = scan(path)
    tallies = {topic.name: Tally(topic.name, topic.type, False) for topic in session.topics}
    files = sorted(session.files, key=attrgetter("start"))
    for file in files:
        _count(file, tallies, window.bounds(session.start))
    size = sum(file.path.stat().st_size for file in files)
    return BagInfo(session, tuple(tallies.values()), files[0].library, files[0].compression, size, window)


def _count(file: SessionFile, tallies: dict[str, Tally], bounds: tuple[int, int]) -> None:
    """Count the messages of a file within the `bounds` of log time; check the counts of the whole file."""
    own = {key: tallies[channel.topic] for key, channel in file.channels.items()}
    passed_over = set()
    for key, channel in file.channels.items():
        kind = file.type_of(channel)
        if channel.message_encoding != CDR:
            passed_over.add(key)
        else:
            schema = schema_of(key, kind) if kind in jazzy().types else file.schemas.get(channel.schema_id)
            own[key].stamped = schema is not None and has_header(schema)
    seen: Counter[int] = Counter()
    with as_bag_error(file.path):
        for key, log_time, data in file.messages():
            seen[key] += 1
            if bounds[0] <= log_time < bounds[1] and key not in passed_over:
                own[key].add(log_time, data)
    for key in passed_over:
        own[key].count += seen[key]
    file.check_counts(file.counts, seen)
