"""Summarise one .mcap file without decoding its messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Set
from dataclasses import dataclass, field
from io import SEEK_END
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import StreamReader

from ..errors import BagError
from ..messages.message_block import MessageBlock
from ..system.received_files import open_received
from .chunk_reader import log_clock, message_blocks
from .chunk_table import ChunkPlace, ChunkTable
from .integrity import FOOTER, as_bag_error, check_ends
from .log_clock import LogClock
from .mcap_records import CHUNK_HEAD, LARGEST, MESSAGE_HEAD, PREFIX, UnpackBudget, chunk_records, heads, outer_records
from .recovery.chunk_head import head_at
from .session_file import SessionFile

PROFILE = "ros2"
NOTES = "boom_twin"
"""Name of the metadata record that holds the notes on a session."""


@dataclass(frozen=True, slots=True)
class McapFile(SessionFile):
    """What one .mcap file holds.

    Attributes
    ----------
    chunks : ChunkTable
        By the index of the file, or made by a walk through it.
    compression : str
        Of its first chunk, or that it has no index.
    """

    chunks: ChunkTable
    compression: str

    @property
    def storage(self) -> str:
        """See `SessionFile`."""
        return "mcap"

    def written_by(self) -> tuple[str, str]:
        """See `SessionFile`."""
        with open_received(self.path) as stream:
            return NonSeekingReader(stream, record_size_limit=LARGEST).get_header().library, self.compression

    def heads(self) -> Iterator[tuple[int, int, bytes]]:
        """See `SessionFile`; in the order of the file, one piece in memory."""
        return heads(self.path, self.chunks)

    def log_clock(self) -> LogClock:
        """See `SessionFile`."""
        return log_clock(self.path, self.chunks)

    def blocks(self, passed: Set[int], clock: LogClock) -> Iterator[MessageBlock]:
        """See `SessionFile`."""
        return message_blocks(self.path, self.chunks, passed, clock)


def summarise(path: Path) -> McapFile:
    """Look at one file: only at its summary if that is complete, else at all of it.

    Raises
    ------
    BagError
        If it is not there, not MCAP, cut off, damaged, or of another profile than ros2.
    """
    with as_bag_error(path), open_received(path) as file:
        check_ends(path, file)
        limit = min(LARGEST, path.stat().st_size)
        file.seek(0)
        header = next(StreamReader(file, record_size_limit=limit).records)
        if not isinstance(header, Header):
            raise McapError(f"begins with a {type(header).__name__}, not with a header")
        if header.profile not in (PROFILE, ""):
            raise BagError(f"{path}: profile = {header.profile!r}: only {PROFILE!r} is read. Record the session with ROS 2.")
        summary = _summary(file, limit)
        told = summary.statistics
        if told is None or not summary.is_complete:
            return _walk(path)
        return McapFile(
            path=path,
            channels=summary.channels,
            schemas=summary.schemas,
            counts=dict(told.channel_message_counts),
            start=told.message_start_time,
            end=told.message_end_time,
            chunks=summary.chunks,
            checked=all(_has_checksum(file, place) for place in summary.chunks),
            notes=_notes(_metadata_at(file, place, limit) for place in summary.metadata),
            compression=summary.compression or "none",
        )


@dataclass(slots=True)
class _Summary:
    """The summary of a file, as far as it has one; `metadata` is where records of metadata lie."""

    statistics: Statistics | None = None
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    chunks: ChunkTable = field(default_factory=ChunkTable)
    metadata: list[int] = field(default_factory=list)
    compression: str = ""

    def add(self, record: McapRecord) -> None:
        """Take one record in."""
        match record:
            case Statistics():
                self.statistics = record
            case Channel():
                self.channels[record.id] = record
            case Schema():
                self.schemas[record.id] = record
            case ChunkIndex():
                self.compression = self.compression if self.chunks else record.compression
                self.chunks.append(ChunkPlace.of(record))
            case MetadataIndex():
                self.metadata.append(record.offset)

    @property
    def is_complete(self) -> bool:
        """Whether it alone tells what is in the file and where."""
        told = self.statistics
        return (
            told is not None
            and 0 < told.chunk_count == len(self.chunks)
            and told.channel_message_counts.keys() <= self.channels.keys()
            and {channel.schema_id for channel in self.channels.values()} <= {0, *self.schemas}
        )


def _summary(file: BinaryIO, limit: int) -> _Summary:
    """Read the summary record by record: the index of chunks of a day is long."""
    found = _Summary()
    file.seek(-FOOTER.size, SEEK_END)
    footer = next(_records_here(file, limit))
    if not isinstance(footer, Footer):
        raise McapError(f"ends with a {type(footer).__name__}, not with a footer")
    if footer.summary_start:
        file.seek(footer.summary_start)
        for record in _records_here(file, limit):
            found.add(record)
    return found


def _records_here(file: BinaryIO, limit: int) -> Iterator[McapRecord]:
    """Records from where the file stands up to its footer, of at most `limit` bytes each."""
    return StreamReader(file, skip_magic=True, record_size_limit=limit).records


def _metadata_at(file: BinaryIO, place: int, limit: int) -> Metadata:
    file.seek(place)
    record = next(_records_here(file, limit))
    if not isinstance(record, Metadata):
        raise McapError(f"no metadata at byte {place}, where the summary has some")
    return record


def _has_checksum(file: BinaryIO, place: ChunkPlace) -> bool:
    head = head_at(file, place.chunk_start_offset)
    return head is not None and head.crc != 0


_RUN = 2**20
"""Bytes of messages outside chunks, from which on they are a piece."""


class _Pieces:
    """Makes the table of the pieces of a file from its records."""

    def __init__(self) -> None:
        self._table, self._run = ChunkTable(), list[ChunkPlace]()

    def add(self, record: McapRecord, messages: list[Message], end: int) -> None:
        """Take the next record in, which ends before the offset `end`, with the messages that it is or holds."""
        if self._run and (not isinstance(record, Message) or end - self._run[0].chunk_start_offset > _RUN):
            self.finish()
        if messages:
            times, channels = [each.log_time for each in messages], frozenset(each.channel_id for each in messages)
            if isinstance(record, Chunk):
                length = CHUNK_HEAD + len(record.compression.encode()) + len(record.data)
                unpacked = record.uncompressed_size
            else:
                unpacked = length = PREFIX.size + MESSAGE_HEAD.size + len(messages[0].data)
            self._run.append(ChunkPlace(min(times), max(times), end - length, length, unpacked, 0, channels))
        if isinstance(record, Chunk):
            self.finish()

    def finish(self) -> ChunkTable:
        """Return the table with the messages so far."""
        if self._run:
            starts, ends, offsets, lengths, sizes, _, channels = zip(*self._run, strict=True)
            length, size, found = sum(lengths), sum(sizes), frozenset[int]().union(*channels)
            self._table.append(ChunkPlace(min(starts), max(ends), offsets[0], length, size, 0, found))
            self._run = []
        return self._table


def _walk(path: Path) -> McapFile:
    """Look at all of a file, and compare its statistics, if it has them, with what is there."""
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    notes: list[Metadata] = []
    counts: Counter[int] = Counter()
    told: Statistics | None = None
    is_summed, chunks_summed = False, set[bool]()
    pieces, budget = _Pieces(), UnpackBudget()
    for end, record in outer_records(path):
        inner = chunk_records(record, budget) if isinstance(record, Chunk) else [record]
        messages = [each for each in inner if isinstance(each, Message)]
        counts.update(each.channel_id for each in messages)
        pieces.add(record, messages, end)
        for each in inner:
            match each:
                case Channel():
                    channels[each.id] = each
                case Schema():
                    schemas[each.id] = each
                case Metadata():
                    notes.append(each)
                case DataEnd():
                    is_summed = each.data_section_crc != 0
                case Statistics():
                    told = each
        if isinstance(record, Chunk):
            chunks_summed.add(record.uncompressed_crc != 0)
    table = pieces.finish()
    start = min((place.message_start_time for place in table), default=0)
    end = max((place.message_end_time for place in table), default=0)
    checked = is_summed or (chunks_summed == {True} and told is not None)
    held = McapFile(path, channels, schemas, dict(counts), start, end, checked, _notes(notes), table, "no index of chunks")
    if told is not None:
        held.check_counts("statistics", told.channel_message_counts, "in the file", counts)
    return held


def _notes(found: Iterable[Metadata]) -> dict[str, str]:
    return {key: value for record in found if record.name == NOTES for key, value in record.metadata.items()}
