"""Read one .mcap file: its content from the summary, its messages a piece at a time in the order of their log times."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Set
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Chunk, ChunkIndex, Statistics
from mcap.summary import Summary
from numpy.typing import NDArray

from ..errors import BagError
from ..messages.cdr_decoder import MessageBlock, by_log_time, gather
from ..system.files import open_received
from ..types import Integers
from .mcap_records import (
    HEADS,
    LARGEST_SUMMARY,
    MESSAGE_HEAD,
    NOTES,
    PREFIX,
    PROFILE,
    bounds,
    check_ends,
    record_of,
    unpack,
)
from .scanner import DamagedBytes, FileDefinitions, scan_records
from .session_file import (
    MOST_HELD,
    PARSE_ERRORS,
    PIECE,
    LogClock,
    Part,
    SessionFile,
    as_bag_error,
    by_topic,
    compare_counts,
)

_CRC = PREFIX.size + 24  # offset of the checksum in the record of a chunk
_MESSAGE = int(Opcode.MESSAGE)


class Piece(NamedTuple):
    """Part of a file that is read at once: a chunk, or messages outside chunks that follow each other."""

    offset: int
    length: int  # length, size: bytes in the file, and unpacked
    size: int
    first: int  # first, last: log times, ns
    last: int
    channels: Set[int]  # channels of its messages; empty if they are not known


@dataclass(frozen=True)
class McapFile(SessionFile):
    """Content of one .mcap file."""

    pieces: list[Piece] = field(default_factory=list)  # in the order of the file

    @cached_property
    def log_clock(self) -> LogClock:
        """Clock as in `SessionFile`, from the messages up to the first damage, which their reader reports."""

        def pieces() -> Iterator[tuple[Integers, NDArray[np.uint64]]]:
            with suppress(*PARSE_ERRORS), open_received(self.path) as file:
                for piece in self.pieces:
                    block = _messages(_content(file, piece))
                    yield block.sources, block.log_times

        with as_bag_error(self.path):
            return LogClock.of(pieces(), self.counts)

    def parts(self, passed: Set[int], clock: LogClock) -> Iterator[Part]:
        """Yield parts as in `SessionFile`, one for each piece. If the clock was set back, the order is that of the file."""
        pieces = sorted(enumerate(self.pieces), key=lambda each: 0 if clock.places else each[1].first)
        newest = np.uint64(0)
        with open_received(self.path) as file:
            for number, piece in pieces:
                if piece.channels and not piece.channels - passed:
                    continue
                block = _messages(_content(file, piece))
                rows = np.flatnonzero(~np.isin(block.sources, list(passed)))
                block, bound = block.chosen(rows), piece.first
                if clock.places and len(rows):
                    places = np.searchsorted(clock.places, PIECE * number + rows, "right")
                    times = block.log_times + np.array(clock.shifts, np.uint64)[places]
                    times = np.maximum.accumulate(np.maximum(times, newest))
                    block, bound, newest = replace(block, log_times=times), int(times[0]), times[-1]
                if len(rows):
                    yield Part(bound, number, by_log_time(block))


def summarise(path: Path) -> McapFile:
    """Return the content of one file, from its summary if that is complete, else from all of its records."""
    with as_bag_error(path), open_received(path) as file:
        check_ends(path, file)
        file.seek(0)
        reader = SeekingReader(file, record_size_limit=min(LARGEST_SUMMARY, path.stat().st_size))
        header, summary = reader.get_header(), reader.get_summary()
        if header.profile not in (PROFILE, ""):
            raise BagError(f"{path}: profile = {header.profile!r}: only {PROFILE!r} is read. Record the session with ROS 2.")
        if summary is None or (told := summary.statistics) is None or not _is_complete(summary, told):
            return _walk(path, header.library)
        return McapFile(
            path=path,
            storage="mcap",
            library=header.library,
            compression=summary.chunk_indexes[0].compression or "none",
            channels=summary.channels,
            schemas=summary.schemas,
            counts=dict(told.channel_message_counts),
            start=told.message_start_time,
            end=told.message_end_time,
            pieces=sorted(
                Piece(
                    index.chunk_start_offset,
                    index.chunk_length,
                    index.uncompressed_size,
                    index.message_start_time,
                    index.message_end_time,
                    index.message_index_offsets.keys(),
                )
                for index in summary.chunk_indexes
            ),
            checked=all(_has_checksum(file, index) for index in summary.chunk_indexes),
            notes={key: value for each in reader.iter_metadata() if each.name == NOTES for key, value in each.metadata.items()},
        )


def _is_complete(summary: Summary, told: Statistics) -> bool:
    """Return True if a summary with statistics gives all chunks, channels and schemas of the file."""
    return (
        0 < told.chunk_count == len(summary.chunk_indexes)
        and told.channel_message_counts.keys() <= summary.channels.keys()
        and {channel.schema_id for channel in summary.channels.values()} <= {0, *summary.schemas}
    )


def _has_checksum(file: BinaryIO, chunk: ChunkIndex) -> bool:
    file.seek(chunk.chunk_start_offset + _CRC)
    return any(file.read(4))


def _walk(path: Path, library: str) -> McapFile:
    """Return the content of a file from all of its records. Compare its statistics, if any, with the messages found."""
    known, counts, pieces, are_vouched = FileDefinitions(path), Counter[int](), list[Piece](), True
    for records in scan_records(path):
        if isinstance(records, DamagedBytes):
            raise McapError(f"byte {records.offset}: {records.reason}")
        known.take(records)
        if len(block := _messages(records.content)):
            counts.update(channels := block.sources.tolist())
            span = int(block.log_times.min()), int(block.log_times.max())
            pieces.append(Piece(records.offset, records.length, len(records.content), *span, {*channels}))
            are_vouched &= records.vouched
    if known.is_summed is False:
        raise McapError("crc validation failed: the checksum of the data does not fit")
    if (told := known.told) is not None:
        compare_counts(path, "statistics", told, "in the file", by_topic(counts, known.channels))
    return McapFile(
        path=path,
        storage="mcap",
        library=library,
        compression="no index of chunks",
        channels=known.channels,
        schemas=known.schemas,
        counts=dict(counts),
        start=min((piece.first for piece in pieces), default=0),
        end=max((piece.last for piece in pieces), default=0),
        checked=bool(known.is_summed) or (bool(pieces) and are_vouched and told is not None),
        notes=known.notes,
        pieces=pieces,
    )


def _content(file: BinaryIO, piece: Piece) -> bytes:
    """Return the bytes of the records in a piece of a file: a chunk with verified checksum, or messages outside chunks.

    Raise BagError if the piece is larger than `MOST_HELD`.
    """
    if (size := max(piece.length, piece.size)) > MOST_HELD:
        remedy = "Write smaller chunks: `mcap compress --chunk-size 1048576 IN.mcap -o OUT.mcap`."
        raise BagError(f"{file.name}: a chunk of {size} bytes; at most {MOST_HELD} are held in memory. {remedy}")
    file.seek(piece.offset)
    raw = file.read(piece.length)
    if len(raw) != piece.length or not raw.startswith(PREFIX.pack(Opcode.CHUNK, len(raw) - PREFIX.size)):
        if len(raw) == piece.length == piece.size and raw[0] == Opcode.MESSAGE:
            return raw
        raise McapError(f"no chunk of {piece.length} bytes at byte {piece.offset}")
    return unpack(Chunk.read(ReadDataStream(BytesIO(raw[PREFIX.size :]))))


def _messages(content: bytes) -> MessageBlock:
    """Return the messages among the records of a piece, in its order. All records must be whole."""
    found = []
    for opcode, start, end in bounds(content):
        if opcode == _MESSAGE:
            if end - start < MESSAGE_HEAD.size:
                raise McapError(f"message of {end - start} bytes at byte {start} of a chunk, too few for its head")
            found.append(start)
        elif opcode in (Opcode.CHANNEL, Opcode.SCHEMA):
            record_of(opcode, content[start:end])  # refuses one that is not whole
    starts = np.array(found, np.int64)
    heads = gather(content, starts - PREFIX.size, HEADS.itemsize).view(HEADS)[:, 0]
    channels, ends = heads["channel"].astype(np.int64), starts + heads["length"].astype(np.int64)
    return MessageBlock(content, channels, heads["log_time"].copy(), starts + MESSAGE_HEAD.size, ends)
