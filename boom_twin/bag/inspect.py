"""Inspect a session: counts, rates, gaps, clocks and names of every topic, and how it was stored."""

from __future__ import annotations

import struct
from collections import Counter
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path

from ..messages.cdr_decoder import has_header, names_in, stamp_in
from ..messages.topic_table import TYPES
from ..messages.type_store import jazzy
from ..types import NANO, Stream
from .integrity import as_bag_error
from .reader import Session, scan
from .session_file import CDR, SessionFile, schema_of
from .time_window import WHOLE, TimeWindow

VARIANTS = 100
"""Different lists of names that are told apart in one topic."""


@dataclass(slots=True)
class Tally:
    """What was seen of one topic.

    Stamps are taken where the messages begin with a header and it is not 0, log times elsewhere.

    Attributes
    ----------
    name, type : str
    stamped, named : bool
        Whether its messages begin with a header, and whether they are joint states.
    count : int
    first, last : int
        Log times, ns.
    gap, gap_after : int
        Largest step between two stamps, ns, and log time of the message before it.
    not_increasing : int
        Messages with a stamp not after that of the message before.
    unset : int
        Messages with a stamp of 0, or too short for one.
    skews : list of int
        Log time minus stamp, ns: smallest, largest and sum over `skewed` messages.
    names : Counter
        Messages by their joint names.
    unreadable : int
        Joint states whose names cannot be read.
    """

    name: str
    type: str
    stamped: bool
    named: bool
    count: int = 0
    first: int = 0
    last: int = 0
    gap: int = 0
    gap_after: int = 0
    not_increasing: int = 0
    unset: int = 0
    skewed: int = 0
    skews: list[int] = field(default_factory=lambda: [0, 0, 0])
    names: Counter[tuple[str, ...]] = field(default_factory=Counter)
    unreadable: int = 0
    _before: int | None = None
    _known: tuple[bytes, tuple[str, ...]] | None = None

    def add(self, log_time: int, data: bytes) -> None:
        """Take one message in."""
        before_this, self.last = self.last, log_time
        if self.count == 0:
            self.first = log_time
        self.count += 1
        stamp: int | None = log_time
        if self.stamped:
            stamp = stamp_in(data)
            if not stamp:
                self.unset += 1
                stamp = None
            else:
                self._compare(log_time - stamp)
        if stamp is not None:
            self._step(stamp, before_this)
        if self.named:
            self._read_names(data)

    @property
    def rate(self) -> float | None:
        """Messages per second of log time; None for fewer than two, or no time between them."""
        return (self.count - 1) / ((self.last - self.first) * NANO) if self.last > self.first else None

    def _step(self, stamp: int, log_before: int) -> None:
        if self._before is not None:
            if stamp <= self._before:
                self.not_increasing += 1
            elif stamp - self._before > self.gap:
                self.gap, self.gap_after = stamp - self._before, log_before
        self._before = stamp

    def _compare(self, skew: int) -> None:
        least, most, total = self.skews if self.skewed else (skew, skew, 0)
        self.skews = [min(least, skew), max(most, skew), total + skew]
        self.skewed += 1

    def _read_names(self, data: bytes) -> None:
        """Joint names; where they are the same bytes as before, they are not read again."""
        if self._known is None or not data.startswith(self._known[0], 12):
            try:
                names, end = names_in(data)
            except (ValueError, KeyError, struct.error):
                self.unreadable += 1
                return
            self._known = data[12:end], names
        names = self._known[1]
        if names in self.names or len(self.names) < VARIANTS:
            self.names[names] += 1


_NAMED = TYPES[Stream.STROKES]


@dataclass(frozen=True, slots=True)
class BagInfo:
    """What a session holds.

    Attributes
    ----------
    session : Session
    tallies : tuple of Tally
        By name of the topic.
    library : str
        The program that wrote the first file, in its own words.
    compression : str
        Of the chunks: ``zstd``, ``lz4``, ``none``, ..; or that the file has none.
    size : int
        Bytes of all files.
    window : TimeWindow
        The part of the session that the tallies are of.
    """

    session: Session
    tallies: tuple[Tally, ...]
    library: str
    compression: str
    size: int
    window: TimeWindow = WHOLE

    @property
    def span(self) -> tuple[int, int]:
        """Log times (ns) of the first and the last message in the window; twice its beginning where there is none."""
        if self.window == WHOLE:
            return self.session.start, self.session.end
        seen = [tally for tally in self.tallies if tally.count]
        begin = self.window.bounds(self.session.start)[0]
        return min((tally.first for tally in seen), default=begin), max((tally.last for tally in seen), default=begin)

    @property
    def synthetic(self) -> bool | None:
        """Whether the session says that no rig made it; None if it says nothing about its origin."""
        origin = self.session.notes.get("origin")
        return None if origin is None else "synthetic" in origin.lower()

    def tally(self, name: str) -> Tally | None:
        """The topic of that name, with or without its leading slash."""
        return next((each for each in self.tallies if each.name.lstrip("/") == name.lstrip("/")), None)


def inspect(path: Path, window: TimeWindow = WHOLE) -> BagInfo:
    """Read a session once; what is outside the window, which counts from its first message, is not told of.

    Raises
    ------
    BagError
        There is no session, or it is damaged.
    """
    session = scan(path)
    tallies = {topic.name: Tally(topic.name, topic.type, False, _NAMED in topic.type) for topic in session.topics}
    files = sorted(session.files, key=attrgetter("start"))
    for file in files:
        _count(file, tallies, window.bounds(session.start))
    with as_bag_error(files[0].path):
        library, compression = files[0].written_by()
    size = sum(file.path.stat().st_size for file in files)
    return BagInfo(session, tuple(tallies.values()), library, compression, size, window)


def _count(file: SessionFile, tallies: dict[str, Tally], bounds: tuple[int, int]) -> None:
    """Take in the messages of one file with log times from the first to before the second bound; all are counted."""
    own = {key: tallies[channel.topic] for key, channel in file.channels.items()}
    passed_over = set()
    for key, channel in file.channels.items():
        kind, tally = file.type_of(channel), own[key]
        if channel.message_encoding != CDR or (tally.named and kind != _NAMED):
            passed_over.add(key)
        else:
            schema = schema_of(key, kind) if kind in jazzy().types else file.schemas.get(channel.schema_id)
            tally.stamped = schema is not None and has_header(schema)
    seen: Counter[int] = Counter()
    with as_bag_error(file.path):
        for key, log_time, data in file.heads():
            seen[key] += 1
            if bounds[0] <= log_time < bounds[1] and key not in passed_over:
                own[key].add(log_time, data)
    for key in passed_over:
        own[key].count += seen[key]
    file.check_counts("statistics", file.counts, "read", seen)
