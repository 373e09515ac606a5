"""Read the messages of an .mcap file a chunk at a time, every checksum verified, in the order of their log times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from operator import attrgetter
from pathlib import Path

import numpy as np
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, Message

from ..messages.message_block import MessageBlock, by_log_time, gather, joined
from ..system.received_files import open_received
from .chunk_table import ChunkPlace, ChunkTable
from .mcap_records import (
    MESSAGE_HEAD,
    UnpackBudget,
    bounds,
    chunk_at,
    fault_named_by_times,
    inner_record,
    outer_records,
    unpack,
)

TOGETHER = 2**30
"""Bytes of messages that are held together, where the file does not keep them in order, at most."""
MOST_TOGETHER = 2**22
"""Messages, likewise: an empty one takes ten times its bytes."""

ENOUGH = 256
"""Messages in a block, at least, where the next ones come after them."""

_LENGTH = 8
"""Bytes of a record's length, right before its body."""
_HEAD = np.dtype([("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8")])
"""`MESSAGE_HEAD` behind the length of its record."""


_MESSAGE = int(Opcode.MESSAGE)
_LOOSE, _LARGE = 256, 2**16
"""Messages outside chunks that are put into a block, and bytes of one that ends it."""


def message_blocks(path: Path, chunks: ChunkTable) -> Iterator[MessageBlock]:
    """All messages by log time, at equal times in the order of the file; their sources are their channels.

    Only chunks that overlap in time are held together, and some small ones; without an index of chunks, the whole file is.
    """
    waiting: list[MessageBlock] = []
    try:
        for block in _groups(path, chunks):
            waiting.append(block)
            if sum(map(len, waiting)) >= ENOUGH:
                yield joined(waiting)
                waiting = []
    except Exception:
        if waiting:
            yield joined(waiting)  # what comes before the fault
        raise
    if waiting:
        yield joined(waiting)


def _groups(path: Path, chunks: ChunkTable) -> Iterator[MessageBlock]:
    """The messages of chunks that overlap in time, or of the whole file, by log time."""
    if not chunks:
        yield _held(_outside_and_inside(path))
        return
    budget = UnpackBudget()
    with open_received(path) as file:
        for group in _overlapping(chunks):
            if (size := sum(index.uncompressed_size for index in group)) > TOGETHER:
                raise McapError(f"{size} bytes of chunks overlap in time: at most {TOGETHER} are sorted")
            yield _held(_inside(chunk_at(file, index), budget) for index in group)


def _overlapping(chunks: ChunkTable) -> Iterator[list[ChunkPlace]]:
    """Groups of chunks, each later than the one before; within a group in the order of the file.

    A chunk that begins when the group ends is of the group if it stands before one of its chunks: of equal times the order of
    the file counts.
    """
    group: list[ChunkPlace] = []
    end = last = 0
    for index in chunks.by_time():
        start, place = index.message_start_time, index.chunk_start_offset
        if group and (start > end or (start == end and place > last)):
            yield sorted(group, key=attrgetter("chunk_start_offset"))
            group, last = [], 0
        group.append(index)
        end, last = max(end, index.message_end_time), max(last, place)
    yield sorted(group, key=attrgetter("chunk_start_offset"))


def _held(found: Iterable[MessageBlock]) -> MessageBlock:
    """Blocks in the order of the file as one by log time, as long as their messages may be held together."""
    size = count = 0
    blocks = []
    for block in found:
        size, count = size + int((block.ends - block.starts).sum()), count + len(block)
        if size > TOGETHER or count > MOST_TOGETHER:
            raise McapError(f"more than {TOGETHER} bytes or {MOST_TOGETHER} messages are out of order, or without an index")
        blocks.append(block)
    return by_log_time(joined(blocks))


def _outside_and_inside(path: Path) -> Iterator[MessageBlock]:
    """The messages of a file, whether in chunks or not, in its order."""
    budget = UnpackBudget()
    loose: list[Message] = []
    for record in outer_records(path):
        if isinstance(record, Message):
            loose.append(record)
            if len(loose) < _LOOSE and len(record.data) < _LARGE:
                continue
        if loose:
            yield _outside(loose)
            loose = []
        if isinstance(record, Chunk):
            yield _inside(record, budget)


def _outside(messages: list[Message]) -> MessageBlock:
    ends = np.cumsum([len(message.data) for message in messages])
    channels = np.array([message.channel_id for message in messages])
    times = np.array([message.log_time for message in messages], np.uint64)
    content = b"".join(message.data for message in messages)
    return MessageBlock(content, channels, times, np.concatenate([[0], ends[:-1]]), ends)


def _inside(chunk: Chunk, budget: UnpackBudget) -> MessageBlock:
    """The messages inside a chunk, its checksum verified."""
    with fault_named_by_times(chunk):
        content = unpack(chunk, budget)
        starts = np.array(_bodies(content), np.int64)
    heads = gather(content, starts - _LENGTH, _HEAD.itemsize).view(_HEAD)[:, 0]
    channels, ends = heads["channel"].astype(np.int64), starts + heads["length"].astype(np.int64)
    return MessageBlock(content, channels, heads["log_time"].copy(), starts + MESSAGE_HEAD.size, ends)


def _bodies(content: bytes) -> list[int]:
    """Where the records of messages begin, behind their lengths, in the content of a chunk whose records are all whole."""
    found = []
    for opcode, start, end in bounds(content):
        if opcode == _MESSAGE and end - start >= MESSAGE_HEAD.size:
            found.append(start)
        else:
            inner_record(opcode, content[start:end])  # refuses one that is not whole
    return found
