"""Summarise one .mcap file without decoding its messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Set
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mcap.reader import NonSeekingReader, SeekingReader
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    McapRecord,
    Message,
    Metadata,
    Schema,
    Statistics,
)
from mcap.summary import Summary

from ..errors import BagError
from ..messages.message_block import MessageBlock
from ..system.received_files import open_received
from .chunk_reader import log_clock, message_blocks
from .integrity import as_bag_error, check_ends
from .log_clock import LogClock
from .mcap_records import (
    CHUNK_HEAD,
    LARGEST,
    MESSAGE_HEAD,
    PREFIX,
    ChunkPlace,
    UnpackBudget,
    chunk_records,
    heads,
    outer_records,
)
from .recovery.chunk_head import head_at
from .session_file import SessionFile

PROFILE = "ros2"
NOTES = "boom_twin"
"""Name of the metadata record that holds the notes on a session."""


@dataclass(frozen=True, slots=True)
class McapFile(SessionFile):
    """Content of one .mcap file.

    Attributes
    ----------
    chunks : list of ChunkPlace
        Chunks from the index of the file, or from a walk through it.
    compression : str
        Compression of its first chunk, or a note that it has no index.
    """

    chunks: list[ChunkPlace]
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
        """Yield messages as in `SessionFile`, in the order of the file, with one piece in memory."""
        return heads(self.path, self.chunks)

    def log_clock(self) -> LogClock:
        """See `SessionFile`."""
        return log_clock(self.path, self.chunks)

    def blocks(self, passed: Set[int], clock: LogClock) -> Iterator[MessageBlock]:
        """See `SessionFile`."""
        return message_blocks(self.path, self.chunks, passed, clock)


def summarise(path: Path) -> McapFile:
    """Return the content of one file, from its summary if that is complete, else from all of its records.

    Raises
    ------
    BagError
        The file is missing, not MCAP, cut off, damaged, or of another profile than ros2.
    """
    with as_bag_error(path), open_received(path) as file:
        check_ends(path, file)
        file.seek(0)
        reader = SeekingReader(file, record_size_limit=min(LARGEST, path.stat().st_size))
        header, summary = reader.get_header(), reader.get_summary()
        if header.profile not in (PROFILE, ""):
            raise BagError(f"{path}: profile = {header.profile!r}: only {PROFILE!r} is read. Record the session with ROS 2.")
        if summary is None or (told := summary.statistics) is None or not _is_complete(summary, told):
            return _walk(path)
        return McapFile(
            path=path,
            channels=summary.channels,
            schemas=summary.schemas,
            counts=dict(told.channel_message_counts),
            start=told.message_start_time,
            end=told.message_end_time,
            chunks=[_place(index) for index in summary.chunk_indexes],
            checked=all(_has_checksum(file, index) for index in summary.chunk_indexes),
            notes=_notes(reader.iter_metadata()),
            compression=summary.chunk_indexes[0].compression or "none",
        )


def _is_complete(summary: Summary, told: Statistics) -> bool:
    """Return True if a summary with statistics gives all chunks, channels and schemas of the file."""
    return (
        0 < told.chunk_count == len(summary.chunk_indexes)
        and told.channel_message_counts.keys() <= summary.channels.keys()
        and {channel.schema_id for channel in summary.channels.values()} <= {0, *summary.schemas}
    )


def _place(index: ChunkIndex) -> ChunkPlace:
    numbers = (getattr(index, name) for name in ChunkPlace._fields[:-1])
    return ChunkPlace._make([*numbers, frozenset(index.message_index_offsets)])


def _has_checksum(file: BinaryIO, place: ChunkIndex) -> bool:
    head = head_at(file, place.chunk_start_offset)
    return head is not None and head.crc != 0


_RUN = 2**20
"""Size of a piece of messages outside chunks, bytes."""


class _Pieces:
    """Builder of the table of the pieces of a file from its records."""

    def __init__(self) -> None:
        self._table, self._run = list[ChunkPlace](), list[ChunkPlace]()

    def add(self, record: McapRecord, messages: list[Message], end: int) -> None:
        """Add the next record, which ends before the offset `end`, with the messages in it."""
        if self._run and (not isinstance(record, Message) or end - self._run[0].chunk_start_offset > _RUN):
            self.finish()
        if not messages:
            return
        length = unpacked = PREFIX.size + MESSAGE_HEAD.size + len(messages[0].data)
        if isinstance(record, Chunk):
            length, unpacked = CHUNK_HEAD + len(record.compression) + len(record.data), record.uncompressed_size
        times, channels = [each.log_time for each in messages], frozenset(each.channel_id for each in messages)
        self._run.append(ChunkPlace(min(times), max(times), end - length, length, unpacked, 0, channels))
        if isinstance(record, Chunk):
            self.finish()

    def finish(self) -> list[ChunkPlace]:
        """Complete the open piece and return the table."""
        if self._run:
            starts, ends, offsets, lengths, sizes, _, channels = zip(*self._run, strict=True)
            found = frozenset[int]().union(*channels)
            self._table.append(ChunkPlace(min(starts), max(ends), offsets[0], sum(lengths), sum(sizes), 0, found))
            self._run = []
        return self._table


def _walk(path: Path) -> McapFile:
    """Return the content of a file from all of its records. Compare its statistics, if any, with the messages found."""
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
