"""Scan an .mcap file that is damaged, or has no index, from front to back for sound records."""

from __future__ import annotations

import re
import struct
from collections import Counter
from collections.abc import Container, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Header, Metadata, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from ..errors import BagError
from ..system.files import open_received
from .mcap_records import (
    BLOCK,
    KINDS,
    LARGEST_SUMMARY,
    MESSAGE_HEAD,
    NOTES,
    PREFIX,
    PROFILE,
    bounds,
    checksum_of,
    parts,
    record_of,
    summary_start,
    unpack,
    unpack_start,
    whole_parts,
)
from .session_file import MOST_HELD, PARSE_ERRORS, by_topic

_START = re.compile(rb"(?=[\x05\x06\x0f].{5}\x00\x00\x00)", re.DOTALL)
"""Pattern of a possible start of a message, a chunk or the end of the data: opcode, and a length below 2^40."""
_CHUNK_HEAD = struct.Struct("<BQQQQII")
_SIZE = struct.Struct("<Q")
_MESSAGE = bytes([Opcode.MESSAGE])
PRIVATE = 0x80  # first opcode of records that applications define for themselves


@dataclass(frozen=True, slots=True)
class SoundRecords:
    """Records of a chunk, or outside chunks messages that follow each other, or one record of another kind."""

    offset: int
    length: int  # bytes in the file
    content: bytes
    vouched: bool = False  # True if the checksum of their chunk fits


@dataclass(frozen=True, slots=True)
class DamagedBytes:
    """Bytes that cannot be used, and the reason."""

    offset: int
    length: int
    reason: str


def scan_records(path: Path, channels: Container[int] = ()) -> Iterator[SoundRecords | DamagedBytes]:
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
            elif records := _whole_records(file, offset, size):
                after = offset + len(records)
                yield SoundRecords(offset, len(records), records)
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
        yield SoundRecords(offset, length, content, chunk.uncompressed_crc != 0)
        return
    except PARSE_ERRORS as error:
        reason = str(error)
    if chunk is not None and (chunk.uncompressed_crc == 0 or offset + length > size):
        try:
            start = whole_parts(unpack_start(chunk))
        except PARSE_ERRORS as error:
            reason = f"{reason}; {error}"
    if start:
        yield SoundRecords(offset, min(length, size - offset), start)
    yield DamagedBytes(offset, min(length, size - offset), reason)


def _whole_records(file: BinaryIO, offset: int, size: int) -> bytes:
    """Return the record at `offset` if it is whole; of a message also the messages behind it, up to `BLOCK` bytes."""
    found = bytearray(_whole_record(file, offset, size))
    while found[:1] == _MESSAGE and len(found) < BLOCK:
        record = _whole_record(file, offset + len(found), size)
        if record[:1] != _MESSAGE:
            break
        found += record
    return bytes(found)


def _whole_record(file: BinaryIO, offset: int, size: int) -> bytes:
    """Return the bytes of the record at `offset` if it is whole and of a kind outside chunks; else no bytes.

    Nothing in a message, or in a record of an application, tells that it is whole: another record must follow.
    """
    file.seek(offset)
    raw = file.read(PREFIX.size)
    if len(raw) < PREFIX.size:
        return b""
    opcode, length = PREFIX.unpack(raw)
    end = offset + PREFIX.size + length
    if end > size or length > MOST_HELD or (opcode == Opcode.MESSAGE and length < MESSAGE_HEAD.size):
        return b""
    if opcode not in KINDS and not ((opcode == Opcode.MESSAGE or opcode >= PRIVATE) and _may_begin(file, end, size)):
        return b""
    file.seek(offset)
    record = file.read(PREFIX.size + length)
    try:
        if opcode in KINDS:
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
    return (opcode >= PRIVATE or opcode in (Opcode.MESSAGE, Opcode.CHUNK, *KINDS)) and length <= MOST_HELD


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


class FileDefinitions:
    """Definitions, notes and counts of one file, from the sound records of a walk through it.

    A definition is used if the checksum of its chunk or of the summary fits or is missing. One with a valid checksum replaces
    one without.
    """

    def __init__(self, path: Path) -> None:
        self.channels: dict[int, Channel] = {}  # channels, schemas: by number
        self.schemas: dict[int, Schema] = {}
        self.notes: dict[str, str] = {}
        self.is_summed: bool | None = None  # True if the checksum of the data section is valid; None without one
        self._path, self._summary = path, summary_start(path)
        self._sure, self._left, self._is_data = set[tuple[int, int]](), LARGEST_SUMMARY, True
        self._statistics: Statistics | None = None

    @property
    def told(self) -> Counter[str] | None:
        """Number of messages by topic from a sound summary."""
        if self._statistics is None or not self._statistics.channel_message_counts.keys() <= self.channels.keys():
            return None
        return by_topic(self._statistics.channel_message_counts, self.channels)

    def take(self, piece: SoundRecords) -> None:
        """Take the next sound records. Raise BagError for profile ros1 or px4, and definitions above `LARGEST_SUMMARY`."""
        is_in_summary = self._summary is not None and piece.offset >= self._summary
        for opcode, body in parts(piece.content):
            if opcode in (Opcode.CHANNEL, Opcode.SCHEMA) and (piece.vouched or is_in_summary or self._is_data):
                self._define(opcode, body, piece.vouched or is_in_summary)
            elif opcode in (Opcode.HEADER, Opcode.METADATA, Opcode.DATA_END) or (opcode == Opcode.STATISTICS and is_in_summary):
                match record_of(opcode, body):
                    case Header(profile=("ros1" | "px4") as profile):
                        told = f"profile = {profile!r}: only {PROFILE!r} is saved. Use a tool of that system."
                        raise BagError(f"{self._path}: {told}")
                    case Metadata(name=name, metadata=notes) if name == NOTES:
                        self.notes |= notes
                    case DataEnd(data_section_crc=checksum):
                        self._is_data = False
                        self._summary = self._summary or summary_start(self._path, piece.offset + piece.length)
                        with open_received(self._path) as file:
                            self.is_summed = checksum == checksum_of(file, 0, piece.offset) if checksum else None
                    case Statistics() as counts:
                        self._statistics = counts

    def _define(self, opcode: int, body: bytes, is_sure: bool) -> None:
        self._left -= len(body)
        if self._left < 0:
            told = f"more than {LARGEST_SUMMARY} bytes of definitions. It is not the work of a recorder."
            raise BagError(f"{self._path}: {told}")
        definition = record_of(opcode, body)
        assert isinstance(definition, Channel | Schema)
        table: dict[int, Any] = self.channels if opcode == Opcode.CHANNEL else self.schemas
        if definition.id not in table or (is_sure and (opcode, definition.id) not in self._sure):
            table[definition.id] = definition
        if is_sure:
            self._sure.add((opcode, definition.id))


def definitions_of(path: Path) -> FileDefinitions:
    """Return the definitions, notes and counts of a file from one walk through it."""
    found = FileDefinitions(path)
    for piece in scan_records(path):
        if isinstance(piece, SoundRecords):
            found.take(piece)
    return found
