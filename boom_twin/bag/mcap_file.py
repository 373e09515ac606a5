"""Read one .mcap file: its content from the summary, its messages a piece at a time in the order of their log times."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from io import BytesIO
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Message, Metadata, Schema, Statistics
from mcap.stream_reader import StreamReader
from mcap.summary import Summary
from numpy.typing import NDArray

from ..errors import BagError
from ..messages.cdr_decoder import Integers, MessageBlock, by_log_time, gather, joined
from ..system.received_files import open_received
from .mcap_records import (
    LARGEST_SUMMARY,
    MESSAGE_HEAD,
    MOST_HELD,
    MOST_TOGETHER,
    PREFIX,
    bounds,
    check_ends,
    parts,
    record_of,
    unpack,
)
from .session_file import PIECE, LogClock, SessionFile, as_bag_error

PROFILE = "ros2"
NOTES = "boom_twin"  # name of the metadata record that holds the notes on a session

_RUN = 2**20  # size of a piece of messages outside chunks, bytes
_CRC = PREFIX.size + 24  # offset of the checksum in the record of a chunk
_CHUNK_HEAD = _CRC + 4 + 4 + 8  # bytes of the record of a chunk beside the name of its compression and its packed content
_LENGTH = 8  # size of the length field right before the body of a record, bytes
_HEAD = np.dtype([("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8")])
"""`MESSAGE_HEAD` behind the length of its record."""
_MESSAGE = int(Opcode.MESSAGE)


@dataclass(frozen=True)
class McapFile(SessionFile):
    """Content of one .mcap file."""

    # chunks, and runs of messages outside chunks, in the order of the file
    pieces: list[ChunkIndex] = field(default_factory=list)

    def messages(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield messages as in `SessionFile`, in the order of the file, with one piece in memory."""
        with open_received(self.path) as file:
            for piece in self.pieces:
                block = _messages(_content(file, piece))
                for row, (channel, time) in enumerate(zip(block.sources.tolist(), block.log_times.tolist(), strict=True)):
                    yield channel, time, block.data(row)

    @cached_property
    def log_clock(self) -> LogClock:
        """Clock as in `SessionFile`, from the index of the messages; without one, from the messages."""
        with as_bag_error(self.path), open_received(self.path) as file:
            return LogClock.of((_log_times(file, piece) for piece in self.pieces), self.counts)

    def blocks(self, passed: Set[int], clock: LogClock) -> Iterator[MessageBlock]:
        """Yield blocks as in `SessionFile`, one piece after the other. Messages of equal time keep the order of the file.

        Only pieces that overlap in time are held together. If the clock was set back, the order is that of the file.
        """
        held: dict[int, MessageBlock] = {}
        pieces = sorted(enumerate(self.pieces), key=lambda each: 0 if clock.places else each[1].message_start_time)
        chosen = (each for each in pieces if not each[1].message_index_offsets or each[1].message_index_offsets.keys() - passed)
        with open_received(self.path) as file:
            for (number, piece), (_, after) in pairwise([*chosen, (0, None)]):
                assert piece is not None
                block = _messages(_content(file, piece))
                block = block.chosen(rows := np.flatnonzero(~np.isin(block.sources, list(passed))))
                if clock.places:
                    shifts = np.array(clock.shifts, np.uint64)[np.searchsorted(clock.places, PIECE * number + rows, "right")]
                    yield replace(block, log_times=np.maximum.accumulate(block.log_times + shifts))
                    continue
                held[number] = by_log_time(block)
                if sum(len(each.content) for each in held.values()) > MOST_HELD or sum(map(len, held.values())) > MOST_TOGETHER:
                    what = f"more than {MOST_HELD} bytes or {MOST_TOGETHER} messages are out of order"
                    raise BagError(f"{self.path}: {what}. Sort them by log time: `mcap sort IN.mcap -o OUT.mcap`.")
                ends = {
                    at: len(each) if after is None else int(np.searchsorted(each.log_times, after.message_start_time))
                    for at, each in sorted(held.items())
                }
                if due := [held[at].chosen(slice(0, end)) for at, end in ends.items() if end]:
                    yield by_log_time(joined(due))
                held = {at: held[at].chosen(slice(end, None)) for at, end in ends.items() if end < len(held[at])}


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
            pieces=sorted(summary.chunk_indexes, key=attrgetter("chunk_start_offset")),
            checked=all(_has_checksum(file, index) for index in summary.chunk_indexes),
            notes=_notes(reader.iter_metadata()),
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
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    notes: list[Metadata] = []
    counts: Counter[int] = Counter()
    told: Statistics | None = None
    is_summed, chunks_summed = False, set[bool]()
    pieces = list[ChunkIndex]()
    with open_received(path) as file:
        limit = min(MOST_HELD, path.stat().st_size)
        for record in StreamReader(file, validate_crcs=True, emit_chunks=True, record_size_limit=limit).records:
            inner = [record]
            if isinstance(record, Chunk):
                content = unpack(record)
                block = _messages(content)
                inner = [record_of(*each) for each in parts(content) if each[0] in (Opcode.CHANNEL, Opcode.SCHEMA)]
                chunks_summed.add(record.uncompressed_crc != 0)
                counts.update(block.sources.tolist())
                if len(block):
                    length = _CHUNK_HEAD + len(record.compression) + len(record.data)
                    pieces.append(_piece(file.tell() - length, length, block.log_times, block.sources, record))
            for each in inner:
                match each:
                    case Message():
                        counts[each.channel_id] += 1
                        _add_to_run(pieces, each, file.tell())
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
    held = McapFile(
        path=path,
        storage="mcap",
        library=library,
        compression="no index of chunks",
        channels=channels,
        schemas=schemas,
        counts=dict(counts),
        start=min((piece.message_start_time for piece in pieces), default=0),
        end=max((piece.message_end_time for piece in pieces), default=0),
        checked=is_summed or (chunks_summed == {True} and told is not None),
        notes=_notes(notes),
        pieces=pieces,
    )
    if told is not None:
        held.check_counts("statistics", told.channel_message_counts, "in the file", counts)
    return held


def _piece(
    start: int, length: int, log_times: Iterable[int], channels: Iterable[int], chunk: Chunk | None = None
) -> ChunkIndex:
    """Return the index of a chunk, or of a message outside chunks."""
    times = [int(time) for time in log_times]
    return ChunkIndex(
        chunk_length=length,
        chunk_start_offset=start,
        compressed_size=len(chunk.data) if chunk else 0,
        compression=chunk.compression if chunk else "",
        message_end_time=max(times),
        message_index_length=0,
        message_index_offsets=dict.fromkeys(map(int, channels), 0),
        message_start_time=min(times),
        uncompressed_size=chunk.uncompressed_size if chunk else length,
    )


def _add_to_run(pieces: list[ChunkIndex], message: Message, end: int) -> None:
    """Add a message outside chunks, which ends before the offset `end`, to the run right before it, or begin a new run."""
    length = PREFIX.size + MESSAGE_HEAD.size + len(message.data)
    run = pieces[-1] if pieces and not pieces[-1].compressed_size else None
    if run is None or run.chunk_start_offset + run.chunk_length != end - length or run.chunk_length + length > _RUN:
        pieces.append(_piece(end - length, length, [message.log_time], [message.channel_id]))
        return
    run.chunk_length = run.uncompressed_size = run.chunk_length + length
    run.message_start_time = min(run.message_start_time, message.log_time)
    run.message_end_time = max(run.message_end_time, message.log_time)
    run.message_index_offsets[message.channel_id] = 0


def _notes(found: Iterable[Metadata]) -> dict[str, str]:
    return {key: value for record in found if record.name == NOTES for key, value in record.metadata.items()}


def _content(file: BinaryIO, piece: ChunkIndex) -> bytes:
    """Return the bytes of the records in a piece of a file: a chunk with verified checksum, or messages outside chunks.

    Raise BagError if the piece is larger than `MOST_HELD`.
    """
    if (size := max(piece.chunk_length, piece.uncompressed_size)) > MOST_HELD:
        remedy = "Write smaller chunks: `mcap compress --chunk-size 1048576 IN.mcap -o OUT.mcap`."
        raise BagError(f"{file.name}: a chunk of {size} bytes; at most {MOST_HELD} are held in memory. {remedy}")
    file.seek(piece.chunk_start_offset)
    raw = file.read(piece.chunk_length)
    if len(raw) != piece.chunk_length or not raw.startswith(PREFIX.pack(Opcode.CHUNK, len(raw) - PREFIX.size)):
        if len(raw) == piece.chunk_length == piece.uncompressed_size and raw[0] == Opcode.MESSAGE:
            return raw
        raise McapError(f"no chunk of {piece.chunk_length} bytes at byte {piece.chunk_start_offset}")
    return unpack(Chunk.read(ReadDataStream(BytesIO(raw[PREFIX.size :]))))


def _log_times(file: BinaryIO, piece: ChunkIndex) -> tuple[Integers, NDArray[np.uint64]]:
    """Return channels and log times of the messages in a piece, in its order."""
    if not piece.message_index_length:
        block = _messages(_content(file, piece))
        return block.sources, block.log_times
    file.seek(piece.chunk_start_offset + piece.chunk_length)
    index = [body for opcode, body in parts(file.read(piece.message_index_length)) if opcode == Opcode.MESSAGE_INDEX]
    own = {int.from_bytes(body[:2], "little"): np.frombuffer(body[6:], "<u8").reshape(-1, 2) for body in index}
    channels, (times, offsets) = np.repeat(list(own), [*map(len, own.values())]), np.concatenate([*own.values()]).T
    order = np.argsort(offsets, kind="stable")
    return channels[order], times[order]


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
    heads = gather(content, starts - _LENGTH, _HEAD.itemsize).view(_HEAD)[:, 0]
    channels, ends = heads["channel"].astype(np.int64), starts + heads["length"].astype(np.int64)
    return MessageBlock(content, channels, heads["log_time"].copy(), starts + MESSAGE_HEAD.size, ends)
