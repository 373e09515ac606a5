"""Parse the head of a damaged chunk record, so that one wrong field does not hide its content."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk

from ..integrity import PARSE_ERRORS
from ..mcap_records import MOST_HELD, PREFIX, UnpackBudget, UnpackError, unpack_start, whole_parts

_FIELDS = struct.Struct("<BQQQQII")
_SIZE = struct.Struct("<Q")
_COMPRESSIONS = ("", "zstd", "lz4")
LONGEST = _FIELDS.size + 4 + _SIZE.size
"""Bytes of the longest head."""


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """Head of a chunk record.

    Attributes
    ----------
    offset : int
        Offset of the record in the file.
    opcode, length : int
        Opcode and length of the record; the length counts from after these two fields.
    start, end : int
        First and last log time, ns.
    unpacked, crc : int
        Size (bytes) and checksum of the unpacked content; a checksum of 0 is none.
    compression : str
        Name of the compression as stated; empty for none.
    head, size : int
        Bytes before the packed content, and bytes of the packed content.
    """

    offset: int
    opcode: int
    length: int
    start: int
    end: int
    unpacked: int
    crc: int
    compression: str
    head: int
    size: int

    @property
    def is_certain(self) -> bool:
        """Return True if its two lengths agree, as they do not by chance in other bytes."""
        return PREFIX.size + self.length == self.head + self.size

    @property
    def after(self) -> int:
        """Offset of the next record, if `is_certain`."""
        return self.offset + PREFIX.size + self.length

    def __str__(self) -> str:
        return f"chunk with log times {self.start} to {self.end} ns"


def head_at(file: BinaryIO, offset: int) -> ChunkHead | None:
    """Return the head of a chunk at `offset`; None if the bytes there are not like one."""
    file.seek(offset)
    raw = file.read(LONGEST)
    if len(raw) < _FIELDS.size + _SIZE.size:
        return None
    opcode, length, start, end, unpacked, crc, letters = _FIELDS.unpack_from(raw)
    if letters > 4 or len(raw) < (head := _FIELDS.size + letters + _SIZE.size):
        return None
    name = raw[_FIELDS.size : _FIELDS.size + letters].decode("latin-1")
    (size,) = _SIZE.unpack_from(raw, _FIELDS.size + letters)
    found = ChunkHead(offset, opcode, length, start, end, unpacked, crc, name, head, size)
    return found if found.is_certain or (opcode == Opcode.CHUNK and name in _COMPRESSIONS) else None


class UnsoundError(McapError):
    """Error of a damaged chunk; `start` is the content that its stated sizes unpack to, kept for further use."""

    def __init__(self, reason: str, start: bytes = b"") -> None:
        super().__init__(reason)
        self.start = start


def sound_content(file: BinaryIO, head: ChunkHead, size: int, budget: UnpackBudget) -> tuple[bytes, int]:
    """Return the content of a chunk in a file of `size` bytes, and the offset after the chunk.

    With a checksum, any other field of the head may be wrong. Without a checksum, all fields must fit.

    Raises
    ------
    UnsoundError
    """
    if head.crc == 0:
        return _fitting_content(file, head, budget), head.after
    reason, start = "its checksum does not fit its content", b""
    if head.is_certain and head.size > MOST_HELD:
        reason = f"{head.size} bytes: at most {MOST_HELD} are read"
    for packed, compression in _readings(head, size):
        for limit in dict.fromkeys((min(head.unpacked, MOST_HELD), MOST_HELD)):
            try:
                content = _unpacked(file, head, packed, compression, limit, budget)
            except PARSE_ERRORS as error:
                reason = str(error)
                break
            if zlib.crc32(content) == head.crc:
                return content, head.offset + head.head + packed
            reason = "its checksum does not fit its content"
            if (packed, compression, limit) == (head.size, head.compression, head.unpacked):
                start = content
            if len(content) <= limit:
                break  # there is no more
    raise UnsoundError(reason, start)


def _fitting_content(file: BinaryIO, head: ChunkHead, budget: UnpackBudget) -> bytes:
    """Return the content of a chunk without a checksum. Raise UnsoundError if a length, a size or a record does not fit."""
    if not head.is_certain:
        raise UnsoundError("its lengths do not agree")
    try:
        content = _unpacked(file, head, head.size, head.compression, head.unpacked, budget)
    except PARSE_ERRORS as error:
        raise UnsoundError(str(error)) from error
    if len(content) != head.unpacked:
        raise UnsoundError(f"unpacks to another size than the {head.unpacked} bytes that it states", content)
    if len(whole_parts(content)) != len(content):
        raise UnsoundError("its records do not fill it", content)
    return content


def unverified_start(file: BinaryIO, head: ChunkHead, budget: UnpackBudget) -> bytes:
    """Return the whole records at the start of a chunk that is cut off. No checksum verifies them.

    Raises
    ------
    UnpackError
        The chunk unpacks to more than `budget` allows.
    """
    try:
        content = _unpacked(file, head, min(head.size, MOST_HELD), head.compression, min(head.unpacked, MOST_HELD), budget)
    except UnpackError:
        raise
    except PARSE_ERRORS:
        return b""
    return whole_parts(content)


def _readings(head: ChunkHead, size: int) -> Iterator[tuple[int, str]]:
    """Yield the possible pairs of packed size and compression, those stated by the head first."""
    room = min(size - head.offset - head.head, MOST_HELD)
    packed = dict.fromkeys(each for each in (head.size, PREFIX.size + head.length - head.head) if 0 < each <= room)
    known = [head.compression] if head.compression in _COMPRESSIONS else list(_COMPRESSIONS)
    yield from product(packed, known)


def _unpacked(file: BinaryIO, head: ChunkHead, packed: int, compression: str, unpacked: int, budget: UnpackBudget) -> bytes:
    if packed > MOST_HELD:
        raise McapError(f"{packed} bytes: at most {MOST_HELD} are read")
    file.seek(head.offset + head.head)
    chunk = Chunk(
        compression=compression,
        data=file.read(packed),
        message_start_time=head.start,
        message_end_time=head.end,
        uncompressed_crc=head.crc,
        uncompressed_size=unpacked,
    )
    return unpack_start(chunk, budget)
