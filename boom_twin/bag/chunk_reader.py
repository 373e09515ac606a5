"""Read the messages of an .mcap file a piece at a time, every checksum verified, in the order of their log times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from ..errors import BagError
from ..messages.message_block import Integers, MessageBlock, by_log_time, gather, joined
from ..system.received_files import open_received
from .log_clock import LogClock, Piece
from .mcap_records import (
    MESSAGE_HEAD,
    MOST_HELD,
    PREFIX,
    ChunkPlace,
    UnpackBudget,
    bounds,
    by_place,
    content_at,
    inner_record,
)

MOST_TOGETHER = 2**22
"""Limit for the number of messages held from pieces that overlap in time: an empty one takes ten times its bytes."""
ENOUGH = 256
"""Lower limit for the number of messages in a block, except the last."""

_LENGTH = 8
"""Size of the length field right before the body of a record, bytes."""
_HEAD = np.dtype([("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8")])
"""`MESSAGE_HEAD` behind the length of its record."""
_ENTRY = np.dtype([("log_time", "<u8"), ("offset", "<u8")])
"""One message in the index of a chunk, by the offset of its record."""
_INDEX_HEAD = 6
"""Bytes of the channel and the length of its entries, at the start of an index."""
_PIECE = 2**31
"""Offset between the places of messages of two pieces: more than the bytes of a piece."""
_MESSAGE = int(Opcode.MESSAGE)


def message_blocks(path: Path, chunks: Sequence[ChunkPlace], passed: Set[int], clock: LogClock) -> Iterator[MessageBlock]:
    """Yield blocks of all messages, except of the `passed` channels, by log time. Sources of a block are channels.

    Messages of equal time keep the order of the file. Only pieces that overlap in time are held together. If the recorder's
    clock was set back, the order is that of the file.
    """
    waiting: list[MessageBlock] = []
    try:
        for block in _in_order(path, chunks, passed, clock):
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


def _in_order(path: Path, chunks: Sequence[ChunkPlace], passed: Set[int], clock: LogClock) -> Iterator[MessageBlock]:
    """Yield the messages of one piece after the other. Messages of overlapping pieces wait until all earlier ones are read."""
    budget, held = UnpackBudget(), dict[int, MessageBlock]()
    places = list(enumerate(by_place(chunks)))
    if not clock.is_set_back:
        places.sort(key=lambda each: each[1].message_start_time)
    chosen = (each for each in places if not each[1].channels or each[1].channels - passed)
    with open_received(path) as file:
        for (number, place), (_, after) in pairwise([*chosen, (0, None)]):
            assert place is not None
            block = _messages(content_at(file, place, budget))
            block = block.chosen(np.flatnonzero(~np.isin(block.sources, list(passed))))
            if clock.is_set_back:
                yield clock.corrected(block, _PIECE * number + _places(block))
                continue
            held[place.chunk_start_offset] = by_log_time(block)
            if sum(len(each.content) for each in held.values()) > MOST_HELD or sum(map(len, held.values())) > MOST_TOGETHER:
                what = f"more than {MOST_HELD} bytes or {MOST_TOGETHER} messages are out of order"
                raise BagError(f"{path}: {what}. Sort them by log time: `mcap sort IN.mcap -o OUT.mcap`.")
            ends = {
                at: len(each) if after is None else int(np.searchsorted(each.log_times, after.message_start_time))
                for at, each in sorted(held.items())
            }
            yield by_log_time(joined([held[at].chosen(slice(0, end)) for at, end in ends.items() if end]))
            held = {at: held[at].chosen(slice(end, None)) for at, end in ends.items() if end < len(held[at])}


def _messages(content: bytes) -> MessageBlock:
    """Return the messages among the records of a piece, in its order."""
    starts = np.array(_bodies(content), np.int64)
    heads = gather(content, starts - _LENGTH, _HEAD.itemsize).view(_HEAD)[:, 0]
    channels, ends = heads["channel"].astype(np.int64), starts + heads["length"].astype(np.int64)
    return MessageBlock(content, channels, heads["log_time"].copy(), starts + MESSAGE_HEAD.size, ends)


def log_clock(path: Path, chunks: Sequence[ChunkPlace]) -> LogClock:
    """Return the clock of a file's recorder from the indexes of its chunks.

    If it was set back there, the clock is read from the chunks instead, because an index has no checksum.
    """
    by_index = LogClock.of(lambda: _log_times(path, chunks, True))
    return LogClock.of(lambda: _log_times(path, chunks, False)) if by_index.is_set_back else by_index


def _log_times(path: Path, chunks: Sequence[ChunkPlace], by_index: bool) -> Iterator[Piece]:
    """Yield places, channels and log times of all messages in the order of the file."""
    budget = UnpackBudget()
    with open_received(path) as file:
        for number, place in enumerate(by_place(chunks)):
            found = _indexed(file, place) if by_index and place.message_index_length else None
            places, channels, times = found or _read(file, place, budget)
            order = np.argsort(places, kind="stable")
            yield _PIECE * number + places[order], channels[order], times[order]


def _indexed(file: BinaryIO, place: ChunkPlace) -> Piece | None:
    """Return places, channels and log times of a chunk from the index after it; None if the index is invalid."""
    file.seek(place.chunk_start_offset + place.chunk_length)
    content = file.read(place.message_index_length)
    found, channels = list[np.ndarray](), list[np.ndarray]()
    try:
        for _, start, end in bounds(content):
            found.append(np.frombuffer(content[start + _INDEX_HEAD : end], _ENTRY))
            channels.append(np.full(len(found[-1]), int.from_bytes(content[start : start + 2], "little")))
    except (McapError, ValueError):
        return None
    entries = np.concatenate(found)
    return entries["offset"].astype(np.int64), np.concatenate(channels), entries["log_time"]


def _read(file: BinaryIO, place: ChunkPlace, budget: UnpackBudget) -> Piece:
    block = _messages(content_at(file, place, budget))
    return _places(block), block.sources, block.log_times


def _places(block: MessageBlock) -> Integers:
    return block.starts - MESSAGE_HEAD.size - PREFIX.size


def _bodies(content: bytes) -> list[int]:
    """Return the offsets of the bodies of all message records in the content of a chunk. All records must be whole."""
    found = []
    for opcode, start, end in bounds(content):
        if opcode == _MESSAGE and end - start >= MESSAGE_HEAD.size:
            found.append(start)
        else:
            inner_record(opcode, content[start:end])  # refuses one that is not whole
    return found
