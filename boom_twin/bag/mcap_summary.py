"""Summarise one .mcap file without decoding its messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
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
from .chunk_reader import message_blocks
from .chunk_table import ChunkPlace, ChunkTable
from .integrity import FOOTER, as_bag_error, check_ends
from .mcap_records import LARGEST, chunk_at, heads, records
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
        Empty when the file has no complete index and must be read as a whole.
    """

    chunks: ChunkTable

    @property
    def storage(self) -> str:
        """See `SessionFile`."""
        return "mcap"

    def written_by(self) -> tuple[str, str]:
        """See `SessionFile`."""
        with open_received(self.path) as stream:
            library = NonSeekingReader(stream, record_size_limit=LARGEST).get_header().library
            if not self.chunks:
                return library, "no index of chunks"
            return library, chunk_at(stream, self.chunks[0]).compression or "none"

    def heads(self) -> Iterator[tuple[int, int, bytes]]:
        """See `SessionFile`; in the order of the file, one chunk in memory."""
        return heads(self.path, self.chunks)

    def blocks(self) -> Iterator[MessageBlock]:
        """See `SessionFile`."""
        return message_blocks(self.path, self.chunks)


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
        )


@dataclass(slots=True)
class _Summary:
    """The summary of a file, as far as it has one; `metadata` is where records of metadata lie."""

    statistics: Statistics | None = None
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    chunks: ChunkTable = field(default_factory=ChunkTable)
    metadata: list[int] = field(default_factory=list)

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
                self.chunks.append(record)
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


def _walk(path: Path) -> McapFile:
    """Look at all of a file, and compare its statistics, if it has them, with what is there."""
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    notes: list[Metadata] = []
    counts: Counter[int] = Counter()
    start, end = 2**64, 0
    told: Statistics | None = None
    is_summed, chunks_summed = False, set[bool]()
    for record in records(path):
        match record:
            case Message():
                counts[record.channel_id] += 1
                start, end = min(start, record.log_time), max(end, record.log_time)
            case Channel():
                channels[record.id] = record
            case Schema():
                schemas[record.id] = record
            case Metadata():
                notes.append(record)
            case Chunk():
                chunks_summed.add(record.uncompressed_crc != 0)
            case DataEnd():
                is_summed = record.data_section_crc != 0
            case Statistics():
                told = record
    start = start if counts else 0
    checked = is_summed or (chunks_summed == {True} and told is not None)
    held = McapFile(path, channels, schemas, dict(counts), start, end, checked, _notes(notes), ChunkTable())
    if told is not None:
        held.check_counts("statistics", told.channel_message_counts, "in the file", counts)
    return held


def _notes(found: Iterable[Metadata]) -> dict[str, str]:
    return {key: value for record in found if record.name == NOTES for key, value in record.metadata.items()}
