"""The records of one .mcap file, every checksum verified, in the order of the file or of their log times."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Sequence
from io import BytesIO
from operator import attrgetter
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex, McapRecord, Message
from mcap.stream_reader import StreamReader

from ..received import open_received
from .content import LARGEST, MESSAGE_HEAD, UnpackBudget, definition_of, message_of, parts, unpack
from .damage import STUMBLES

TOGETHER = 2**30
"""Bytes of messages that are held together, where the file does not keep them in order, at most."""
MOST_TOGETHER = 2**22
"""Messages, likewise: an empty one takes ten times its bytes."""


def records(path: Path) -> Iterator[McapRecord]:
    """All records in the order of the file; those inside a chunk follow it."""
    budget = UnpackBudget()
    with open_received(path) as file:
        limit = min(LARGEST, path.stat().st_size)
        for record in StreamReader(file, validate_crcs=True, emit_chunks=True, record_size_limit=limit).records:
            yield record
            if isinstance(record, Chunk):
                yield from _content(record, budget)


def messages(path: Path, chunks: Sequence[ChunkIndex]) -> Iterator[Message]:
    """All messages by log time; at equal times in the order of the file.

    Only chunks that overlap in time are held together; without an index of chunks, the whole file is.
    """
    by_time = attrgetter("log_time")
    if not chunks:
        yield from sorted(_held(records(path)), key=by_time)
        return
    budget = UnpackBudget()
    with open_received(path) as file:
        for group in _overlapping(chunks):
            if (size := sum(index.uncompressed_size for index in group)) > TOGETHER:
                raise McapError(f"{size} bytes of chunks overlap in time: at most {TOGETHER} are sorted")
            content = (record for index in group for record in _content(chunk_at(file, index), budget))
            yield from sorted(_held(content), key=by_time)


def _held(found: Iterable[McapRecord]) -> Iterator[Message]:
    """The messages in the order of the file, as long as they may be held together."""
    size = count = 0
    for record in found:
        if isinstance(record, Message):
            size, count = size + len(record.data), count + 1
            if size > TOGETHER or count > MOST_TOGETHER:
                raise McapError(f"more than {TOGETHER} bytes or {MOST_TOGETHER} messages are out of order, or without an index")
            yield record


def heads(path: Path, chunks: Sequence[ChunkIndex]) -> Iterator[tuple[int, int, bytes]]:
    """Channel, log time (ns) and encoded data of all messages in the order of the file, one chunk in memory."""
    if not chunks:
        for record in records(path):
            if isinstance(record, Message):
                yield record.channel_id, record.log_time, record.data
        return
    budget = UnpackBudget()
    with open_received(path) as file:
        for index in sorted(chunks, key=attrgetter("chunk_start_offset")):
            for opcode, body in parts(unpack(chunk_at(file, index), budget)):
                if opcode == Opcode.MESSAGE:
                    channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(body)
                    yield channel, log_time, body[MESSAGE_HEAD.size :]


def chunk_at(file: BinaryIO, index: ChunkIndex) -> Chunk:
    """The chunk that `index` points at."""
    if index.chunk_length > LARGEST:
        raise McapError(f"chunk of {index.chunk_length} bytes: at most {LARGEST} are read")
    file.seek(index.chunk_start_offset)
    raw = file.read(index.chunk_length)
    if len(raw) != index.chunk_length or raw[:9] != struct.pack("<BQ", Opcode.CHUNK, len(raw) - 9):
        raise McapError(f"no chunk of {index.chunk_length} bytes at byte {index.chunk_start_offset}")
    chunk: Chunk = Chunk.read(ReadDataStream(BytesIO(raw[9:])))
    return chunk


def _overlapping(chunks: Sequence[ChunkIndex]) -> Iterator[list[ChunkIndex]]:
    """Groups of chunks, each later than the one before; within a group in the order of the file."""
    group: list[ChunkIndex] = []
    end = 0
    for index in sorted(chunks, key=attrgetter("message_start_time", "chunk_start_offset")):
        if group and index.message_start_time >= end:
            yield sorted(group, key=attrgetter("chunk_start_offset"))
            group = []
        group.append(index)
        end = max(end, index.message_end_time)
    yield sorted(group, key=attrgetter("chunk_start_offset"))


def _content(chunk: Chunk, budget: UnpackBudget) -> list[McapRecord]:
    """The messages and definitions inside a chunk, its checksum verified."""
    try:
        return [record for opcode, body in parts(unpack(chunk, budget)) if (record := _record(opcode, body)) is not None]
    except STUMBLES as error:
        span = f"{chunk.message_start_time} to {chunk.message_end_time} ns"
        raise McapError(f"chunk with log times {span}: {error}") from error


def _record(opcode: int, body: bytes) -> McapRecord | None:
    return message_of(body) if opcode == Opcode.MESSAGE else definition_of(opcode, body)
