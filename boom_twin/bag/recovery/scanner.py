"""Scan a damaged .mcap file from front to back for sound records."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from ...system.received_files import open_received
from ..integrity import BLOCK, PARSE_ERRORS
from ..mcap_records import KINDS, MESSAGE_HEAD, MOST_HELD, PREFIX, UnpackBudget, UnpackError, record_of, whole_parts
from .chunk_head import ChunkHead, UnsoundError, head_at, sound_content, unverified_start

_START = re.compile(rb"(?=[\x05\x06\x0f].{5}\x00\x00\x00)", re.DOTALL)
"""Pattern of a possible start of a message, a chunk or the end of the data: opcode, and a length below 2^40."""


@dataclass(frozen=True, slots=True)
class SoundRecords:
    """Whole records that follow each other.

    Attributes
    ----------
    offset : int
    vouched : bool
        True if the checksum of their chunk fits.
    content : bytes
    chunk : ChunkHead or None
        Head of the chunk, if the records are its whole content.
    """

    offset: int
    vouched: bool
    content: bytes
    chunk: ChunkHead | None = None


@dataclass(frozen=True, slots=True)
class DamagedBytes:
    """Bytes that cannot be used, and the reason."""

    offset: int
    length: int
    reason: str


def scan_damaged(
    path: Path, unverified: bool = False, channels: Container[int] | None = None
) -> Iterator[SoundRecords | DamagedBytes]:
    """Yield all bytes of a file in order as sound records and damaged bytes, with one chunk in memory at a time.

    Parameters
    ----------
    path : Path
    unverified : bool
        Also yield the whole records at the start of a chunk whose checksum does not fit or cannot be verified.
    channels : container of int, optional
        Known channels. After damage, messages outside chunks are searched for in these channels only.
    """
    size, budget = path.stat().st_size, UnpackBudget()
    with open_received(path) as file:
        offset = len(MCAP0_MAGIC)
        if file.read(offset) != MCAP0_MAGIC:
            yield DamagedBytes(0, min(offset, size), "it does not begin as an MCAP file")
        while offset < size - len(MCAP0_MAGIC) or (offset < size and not _ends(file, offset)):
            pieces, after = _next(file, offset, size, unverified, budget)
            if after is None:
                after = _behind(file, offset + 1, size, channels or ())
                if not any(isinstance(piece, DamagedBytes) for piece in pieces):
                    pieces = [*pieces, DamagedBytes(offset, after - offset, "no record that is whole begins here")]
            yield from pieces
            offset = after


def _next(
    file: BinaryIO, offset: int, size: int, unverified: bool, budget: UnpackBudget
) -> tuple[list[SoundRecords | DamagedBytes], int | None]:
    """Return the pieces that begin at `offset`, and the offset of the next record (None if unknown)."""
    head = head_at(file, offset)
    if head is None:
        record = _whole_record(file, offset, size)
        return ([SoundRecords(offset, False, record)], offset + len(record)) if record else ([], None)
    takes_start = head.crc == 0 or unverified  # no checksum denies it, or it is wanted all the same
    if head.is_certain and head.after > size:
        reason = f"cut off, {size - offset} of {head.after - offset} bytes are there"
        start = b""
        if takes_start:
            try:
                start = unverified_start(file, head, budget)
            except UnpackError as error:
                reason = str(error)
        return _broken(head, size - offset, reason, start), size
    try:
        content, after = sound_content(file, head, size, budget)
        return [SoundRecords(offset, head.crc != 0, content, head)], after
    except UnsoundError as error:
        if not head.is_certain:
            return [], None
        start = whole_parts(error.start) if takes_start else b""
        return _broken(head, head.after - offset, str(error), start), head.after


def _broken(head: ChunkHead, length: int, reason: str, start: bytes) -> list[SoundRecords | DamagedBytes]:
    """Return a damaged chunk as damaged bytes, preceded by the whole records at its start, if any."""
    fault = DamagedBytes(head.offset, length, f"{head}: {reason}")
    return [SoundRecords(head.offset, False, start), fault] if start else [fault]


def _whole_record(file: BinaryIO, offset: int, size: int) -> bytes:
    """Return the bytes of the record at `offset` if it is whole and of a kind outside chunks; else no bytes."""
    file.seek(offset)
    raw = file.read(PREFIX.size)
    if len(raw) < PREFIX.size:
        return b""
    opcode, length = PREFIX.unpack(raw)
    if length > min(MOST_HELD, size - offset - PREFIX.size):
        return b""
    body = file.read(length)
    if opcode == Opcode.MESSAGE:
        is_whole = length >= MESSAGE_HEAD.size and _may_begin(file, offset + PREFIX.size + length, size)
    else:
        is_whole = opcode in KINDS and _fills(opcode, body)
    return raw + body if is_whole else b""


def _fills(opcode: int, body: bytes) -> bool:
    """Return True if a record can be read and fills its body."""
    try:
        record_of(opcode, body)
    except PARSE_ERRORS:
        return False
    return True


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
    file.seek(offset)
    raw = file.read(PREFIX.size + MESSAGE_HEAD.size)
    opcode, length = PREFIX.unpack_from(raw)
    if opcode == Opcode.CHUNK:
        head = head_at(file, offset)
        return head is not None and head.is_certain
    if opcode == Opcode.DATA_END:
        return bool(length == 4)
    if length < MESSAGE_HEAD.size or len(raw) < PREFIX.size + MESSAGE_HEAD.size or offset + length > size:
        return False
    channel = MESSAGE_HEAD.unpack_from(raw, PREFIX.size)[0]
    return channel in channels and _may_begin(file, offset + PREFIX.size + length, size)
