"""What a sound session holds: counts, rates, gaps, clocks and names of every topic, and how it was stored."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

from mcap.reader import NonSeekingReader

from ..received import open_received
from ..records import Stream
from .blocks import chunk_at, heads
from .cdr import has_header
from .content import LARGEST
from .damage import blame, compare_counts
from .reader import Session, scan
from .survey import McapFile
from .tally import Tally
from .topics import TYPES

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
        Of the chunks: ``zstd``, ``lz4``, ``none``, or ``no chunks``.
    size : int
        Bytes of all .mcap files.
    """

    session: Session
    tallies: tuple[Tally, ...]
    library: str
    compression: str
    size: int

    @property
    def synthetic(self) -> bool | None:
        """Whether the session says that no rig made it; None if it says nothing about its origin."""
        origin = self.session.notes.get("origin")
        return None if origin is None else "synthetic" in origin.lower()

    def tally(self, name: str) -> Tally | None:
        """The topic of that name, with or without its leading slash."""
        return next((each for each in self.tallies if each.name.lstrip("/") == name.lstrip("/")), None)


def inspect(path: Path) -> BagInfo:
    """Read a session once, one chunk in memory at a time.

    Raises
    ------
    BagError
        There is no session, or it is damaged.
    """
    session = scan(path)
    tallies = {topic.name: Tally(topic.name, topic.type, False, topic.type == _NAMED) for topic in session.topics}
    files = sorted(session.files, key=attrgetter("start"))
    for file in files:
        _count(file, tallies)
    with blame(files[0].path):
        library, compression = _writer(files[0])
    size = sum(file.path.stat().st_size for file in files)
    return BagInfo(session, tuple(tallies.values()), library, compression, size)


def _count(file: McapFile, tallies: dict[str, Tally]) -> None:
    """Take in all messages of one file."""
    own = {key: tallies[channel.topic] for key, channel in file.channels.items()}
    for key, channel in file.channels.items():
        schema = file.schemas.get(channel.schema_id)
        own[key].stamped = schema is not None and has_header(schema)
    seen: Counter[int] = Counter()
    with blame(file.path):
        for key, log_time, data in heads(file.path, file.chunks):
            seen[key] += 1
            own[key].add(log_time, data)
    compare_counts(file.path, "statistics", file.by_topic(file.counts), "read", file.by_topic(seen))


def _writer(file: McapFile) -> tuple[str, str]:
    """The program that wrote a file, and the compression of its first chunk."""
    with open_received(file.path) as stream:
        library = NonSeekingReader(stream, record_size_limit=LARGEST).get_header().library
        if not file.chunks:
            return library, "no index of chunks"
        return library, chunk_at(stream, file.chunks[0]).compression or "none"
