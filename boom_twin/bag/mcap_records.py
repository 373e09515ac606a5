"""Reader of single records of an .mcap file, with memory limits and checksums."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from lz4.frame import LZ4FrameDecompressor
from mcap import records as mcap_records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, McapRecord
from mcap.writer import MCAP0_MAGIC
from zstandard import ZstdDecompressor, ZstdError

from ..errors import BagError
from ..system.files import open_received
from .session_file import MOST_HELD, MOST_TOGETHER, REMEDY

PROFILE = "ros2"
NOTES = "boom_twin"  # name of the metadata record that holds the notes on a session

LARGEST_SUMMARY = 64 * 2**20  # size limit of one record of a summary, and of all definitions together, bytes
BLOCK = 2**20  # number of bytes read at a time from a file of any size

PREFIX = struct.Struct("<BQ")  # opcode and length of a record
MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time (ns), publish time (ns) of a message
HEADS = np.dtype("u1, <u8, <u2, <u4, <u8, <u8")  # `PREFIX` and `MESSAGE_HEAD` in an array
HEADS.names = ("opcode", "length", "channel", "sequence", "log_time", "publish_time")
FOOTER = struct.Struct("<BQQQI8s")  # last record of a file and the magic after it
KINDS: dict[int, Any] = {
    int(opcode): getattr(mcap_records, opcode.name.title().replace("_", ""))
    for opcode in Opcode
    if opcode not in (Opcode.MESSAGE, Opcode.CHUNK)
}
"""Classes of all records but messages and chunks."""


def _zstd(data: bytes, limit: int) -> bytes:
    window = 2**27  # window limit of zstd, as on its command line without --long
    return ZstdDecompressor(max_window_size=window).stream_reader(data).read(limit)


def _lz4(data: bytes, limit: int) -> bytes:
    unpacked: bytes = LZ4FrameDecompressor().decompress(data, max_length=limit)
    return unpacked


_UNPACK: dict[str, Callable[[bytes, int], bytes]] = {"": lambda data, limit: data[:limit], "zstd": _zstd, "lz4": _lz4}


def unpack(chunk: Chunk) -> bytes:
    """Return the content of a chunk after verifying its size and, if it has one, its checksum.

    Raise McapError if the compression is unknown, the content exceeds `MOST_HELD`, or size or checksum do not fit.
    """
    span = f"chunk with log times {chunk.message_start_time} to {chunk.message_end_time} ns"
    try:
        content = unpack_start(chunk)
    except (McapError, ZstdError, RuntimeError) as error:
        raise McapError(f"{span}: {error}") from error
    if len(content) != chunk.uncompressed_size:
        raise McapError(f"{span}: does not unpack to the {chunk.uncompressed_size} bytes that it states")
    if chunk.uncompressed_crc not in (0, zlib.crc32(content)):
        raise McapError(f"{span}: crc validation failed: its checksum does not fit its content")
    return content


def unpack_start(chunk: Chunk) -> bytes:
    """Return the readable content of a possibly truncated chunk, at most one byte above its stated size, unverified."""
    if chunk.compression not in _UNPACK:
        raise McapError(f"compression = {chunk.compression!r}: only zstd, lz4 and none are known")
    content = _UNPACK[chunk.compression](chunk.data, min(chunk.uncompressed_size, MOST_HELD) + 1)
    if len(content) > MOST_HELD:
        raise McapError(f"{len(chunk.data)} bytes unpack to more than {MOST_HELD} bytes, the most that memory holds")
    return content


def bounds(content: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, start and end of the body of every record in the content of a chunk.

    Raise McapError if a record is not whole, or there are more than `MOST_TOGETHER`.
    """
    place, size, left = 0, len(content), MOST_TOGETHER
    while place < size:
        start, left = place + PREFIX.size, left - 1
        if start > size:
            raise McapError(f"{size - place} bytes are left at byte {place} of a chunk, too few for a record")
        if left < 0:
            raise McapError(f"more than {MOST_TOGETHER} records in a chunk, the most that memory holds")
        opcode, length = PREFIX.unpack_from(content, place)
        if opcode == 0:
            raise McapError(f"record at byte {place} of a chunk has opcode 0, which does not exist")
        place = start + length
        if place > size:
            raise McapError(f"record of {length} bytes at byte {start - PREFIX.size} of a chunk ends after the chunk")
        yield opcode, start, place


def parts(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Return an iterator of opcode and body of every record in the content of a chunk. Errors are those of `bounds`."""
    return ((opcode, content[start:end]) for opcode, start, end in bounds(content))


def whole_parts(content: bytes) -> bytes:
    """Return `content` up to the end of its last whole record."""
    end = 0
    try:
        for _, _, place in bounds(content):
            end = place
    except McapError:
        pass
    return content[:end]


def record_of(opcode: int, body: bytes) -> McapRecord:
    """Return a record of one of `KINDS` from its body. Raise McapError if their lengths differ."""
    stream = ReadDataStream(BytesIO(body))
    record: McapRecord = KINDS[opcode].read(stream)
    if stream.count != len(body):
        raise McapError(f"{type(record).__name__} record of {len(body)} bytes holds {stream.count}")
    return record


def check_ends(path: Path, file: BinaryIO) -> None:
    """Raise BagError unless magic at both ends, footer and checksum of the summary are valid."""
    size = path.stat().st_size
    if (start := file.read(len(MCAP0_MAGIC))) != MCAP0_MAGIC:
        if MCAP0_MAGIC.startswith(start):
            raise BagError(f"{path}: incomplete: {size} bytes, of which nothing can be saved. Its recorder was killed at once.")
        remedy = "Give a rosbag2 directory, or a file that ends with .mcap, .db3, .bag or .csv."
        raise BagError(f"{path}: not an MCAP file (it begins otherwise). {remedy}")
    if (ends := _footer(file, size)) is None:
        raise BagError(f"{path}: incomplete: the end is missing (no footer at the end of its {size} bytes). {REMEDY}")
    summary, is_sound = ends
    if not is_sound:
        fault = f"the checksum of the summary, from byte {summary}, does not fit"
        if summary > size - FOOTER.size:
            fault = f"the summary is said to begin at byte {summary}, which is not in front of the footer of its {size} bytes"
        raise BagError(f"{path}: {fault}. {REMEDY}")


def summary_start(path: Path, moved: int | None = None) -> int | None:
    """Return the offset of a file's summary; None if it is incomplete or corrupt. It has `moved` if bytes are lost."""
    with open_received(path) as file:
        ends = _footer(file, path.stat().st_size, moved)
    return ends[0] if ends and ends[1] else None


def _footer(file: BinaryIO, size: int, moved: int | None = None) -> tuple[int, bool] | None:
    """Return the summary's offset, and True if offset and checksum (if any) are valid. None without a whole footer."""
    file.seek(max(0, size - FOOTER.size))
    tail = file.read()
    if len(tail) < FOOTER.size or not tail.endswith(MCAP0_MAGIC) or tail[0] != Opcode.FOOTER:
        return None
    _, _, start, _, checksum, _ = FOOTER.unpack(tail)
    start = moved or start or size - FOOTER.size
    if start > size - FOOTER.size:
        return start, False
    is_unknown = checksum == 0 and moved is None
    return start, is_unknown or checksum == checksum_of(file, start, size - len(MCAP0_MAGIC) - 4)


def checksum_of(file: BinaryIO, start: int, end: int) -> int:
    """Return the CRC-32 of the bytes from `start` up to `end`, read in blocks."""
    total = 0
    file.seek(start)
    while (left := end - file.tell()) > 0 and (block := file.read(min(left, BLOCK))):
        total = zlib.crc32(block, total)
    return total
