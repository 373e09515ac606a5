"""Scan a damaged .mcap file from front to back for sound records."""

from __future__ import annotations

import re
import struct
from collections.abc import Container, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk
from mcap.writer import MCAP0_MAGIC

from ..system.received_files import open_received
from .mcap_records import BLOCK, KINDS, MESSAGE_HEAD, MOST_HELD, PREFIX, bounds, record_of, unpack, unpack_start, whole_parts
from .session_file import PARSE_ERRORS

_START = re.compile(rb"(?=[\x05\x06\x0f].{5}\x00\x00\x00)", re.DOTALL)
"""Pattern of a possible start of a message, a chunk or the end of the data: opcode, and a length below 2^40."""
_CHUNK_HEAD = struct.Struct("<BQQQQII")
_SIZE = struct.Struct("<Q")


@dataclass(frozen=True, slots=True)
class SoundRecords:
    """Whole records that follow each other."""

    offset: int
    vouched: bool  # True if the checksum of their chunk fits
    content: bytes


@dataclass(frozen=True, slots=True)
class DamagedBytes:
    """Bytes that cannot be used, and the reason."""

    offset: int
    length: int
    reason: str


def scan_damaged(path: Path, channels: Container[int] = ()) -> Iterator[SoundRecords | DamagedBytes]:
    """Yield all bytes of a file in order as sound records and damaged bytes, with one chunk in memory at a time.

    The whole records at the start of a chunk that is cut off, or that has no checksum, are sound. After damage, messages
    outside chunks are searched for in the known `channels` only.
    """
    size = path.stat().st_size
    with open_received(path) as file:
        offset = len(MCAP0_MAGIC)
        if file.read(offset) != MCAP0_MAGIC:
            yield DamagedBytes(0, min(offset, size), "it does not begin as an MCAP file")
        while offset < size - len(MCAP0_MAGIC) or (offset < size and not _ends(file, offset)):
            if (length := _chunk_length(file, offset)) is not None:
                after = min(offset + length, size)
                yield from _chunk_pieces(file, offset, length, size)
            elif record := _whole_record(file, offset, size):
                after = offset + len(record)
                yield SoundRecords(offset, False, record)
            else:
                after = _behind(file, offset + 1, size, channels)
                yield DamagedBytes(offset, after - offset, "no record that is whole begins here")
            offset = after


def _chunk_length(file: BinaryIO, offset: int) -> int | None:
    """Return the bytes of the chunk record at `offset`; None if none is there, or if its two lengths do not agree."""
    file.seek(offset)
    raw = file.read(_CHUNK_HEAD.size + 4 + _SIZE.size)
    if len(raw) < _CHUNK_HEAD.size + _SIZE.size:
        return None
    opcode, length, *_, letters = _CHUNK_HEAD.unpack_from(raw)
    if opcode != Opcode.CHUNK or letters > 4 or len(raw) < (head := _CHUNK_HEAD.size + letters + _SIZE.size):
        return None
    (packed,) = _SIZE.unpack_from(raw, head - _SIZE.size)
    return PREFIX.size + length if PREFIX.size + length == head + packed else None


def _chunk_pieces(file: BinaryIO, offset: int, length: int, size: int) -> Iterator[SoundRecords | DamagedBytes]:
    """Yield the content of a chunk, or the whole records at its start, if they are wanted, and the damaged bytes."""
    chunk, start = None, b""
    file.seek(offset + PREFIX.size)
    try:
        chunk = Chunk.read(ReadDataStream(BytesIO(file.read(min(length, MOST_HELD)))))
        span = f"chunk with log times {chunk.message_start_time} to {chunk.message_end_time} ns"
        if length > MOST_HELD:
            raise McapError(f"{span}: {length} bytes: at most {MOST_HELD} are read")
        if offset + length > size:
            raise McapError(f"{span}: cut off, {size - offset} of {length} bytes are there")
        content = unpack(chunk)
        if chunk.uncompressed_crc == 0:
            for _ in bounds(content):  # refuses records that are not whole
                pass
        yield SoundRecords(offset, chunk.uncompressed_crc != 0, content)
        return
    except PARSE_ERRORS as error:
        reason = str(error)
    if chunk is not None and (chunk.uncompressed_crc == 0 or offset + length > size):
        try:
            start = whole_parts(unpack_start(chunk))
        except PARSE_ERRORS as error:
            reason = f"{reason}; {error}"
    if start:
        yield SoundRecords(offset, False, start)
    yield DamagedBytes(offset, min(length, size - offset), reason)


def _whole_record(file: BinaryIO, offset: int, size: int) -> bytes:
    """Return the bytes of the record at `offset` if it is whole and of a kind outside chunks; else no bytes."""
    file.seek(offset)
    raw = file.read(PREFIX.size)
    if len(raw) < PREFIX.size:
        return b""
    opcode, length = PREFIX.unpack(raw)
    end = offset + PREFIX.size + length
    if end > size or length > MOST_HELD or (opcode != Opcode.MESSAGE and opcode not in KINDS):
        return b""
    if opcode == Opcode.MESSAGE and (length < MESSAGE_HEAD.size or not _may_begin(file, end, size)):
        return b""
    file.seek(offset)
    record = file.read(PREFIX.size + length)
    try:
        if opcode != Opcode.MESSAGE:
            record_of(opcode, record[PREFIX.size :])
    except PARSE_ERRORS:
        return b""
    return record


def _may_begin(file: BinaryIO, offset: int, size: int) -> bool:
    """Return True if a record, a part of one, or the end of the file may be at `offset`."""
    file.seek(offset)
    raw = file.read(PREFIX.size)
    if len(raw) < PREFIX.size:
        return raw[:1] in (b"", MCAP0_MAGIC[:1]) or raw[0] in {Opcode.MESSAGE, *KINDS}
    opcode, length = PREFIX.unpack(raw)
    return opcode in (Opcode.MESSAGE, Opcode.CHUNK, *KINDS) and length <= MOST_HELD


def _ends(file: BinaryIO, offset: int) -> bool:
    """Return True if the magic bytes of the end of the file are at `offset`."""
    file.seek(offset)
    return file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC


def _behind(file: BinaryIO, offset: int, size: int, channels: Container[int]) -> int:
    """Return the next offset at which the file can be read again; the size of the file if there is none."""
    while offset < size:
        file.seek(offset)
        block = file.read(BLOCK + PREFIX.size - 1)
        for match in _START.finditer(block):
            if _is_start(file, offset + match.start(), size, channels):
                return offset + match.start()
        offset += BLOCK
    return size


def _is_start(file: BinaryIO, offset: int, size: int, channels: Container[int]) -> bool:
    """Return True if a chunk, the end of the data, or a known channel's message followed by a record is at `offset`."""
    file.seek(offset + PREFIX.size)
    channel = file.read(2)
    file.seek(offset)
    if file.read(1)[0] == Opcode.MESSAGE and int.from_bytes(channel, "little") not in channels:
        return False
    return _chunk_length(file, offset) is not None or bool(_whole_record(file, offset, size))
