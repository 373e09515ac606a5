"""Read the records of an .mcap file within memory limits, every checksum verified, in the order of the file."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from lz4.frame import LZ4FrameDecompressor
from mcap import records as mcap_records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message
from mcap.stream_reader import StreamReader
from zstandard import ZstdDecompressor

from ..system.received_files import open_received
from .chunk_table import ChunkPlace, ChunkTable
from .integrity import PARSE_ERRORS

LARGEST = 64 * 2**20
"""Bytes of one record, and of one chunk unpacked, that are read at most."""
BYTES_PER_BYTE = 1000
"""Bytes that a packed byte of a chunk may unpack to; recorded numbers give 2 to 20, an empty picture more."""
RECORDS_PER_BYTE = 0.5
"""Records that a packed byte may hold; a message has two times and a number, which pack to 5 bytes and more."""

PREFIX = struct.Struct("<BQ")
"""Opcode and length of a record."""
KINDS: dict[int, Any] = {
    Opcode.HEADER: mcap_records.Header,
    Opcode.FOOTER: mcap_records.Footer,
    Opcode.SCHEMA: mcap_records.Schema,
    Opcode.CHANNEL: mcap_records.Channel,
    Opcode.MESSAGE_INDEX: mcap_records.MessageIndex,
    Opcode.CHUNK_INDEX: mcap_records.ChunkIndex,
    Opcode.ATTACHMENT: mcap_records.Attachment,
    Opcode.ATTACHMENT_INDEX: mcap_records.AttachmentIndex,
    Opcode.STATISTICS: mcap_records.Statistics,
    Opcode.METADATA: mcap_records.Metadata,
    Opcode.METADATA_INDEX: mcap_records.MetadataIndex,
    Opcode.SUMMARY_OFFSET: mcap_records.SummaryOffset,
    Opcode.DATA_END: mcap_records.DataEnd,
}
"""Classes of all records but messages and chunks."""
MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time (ns), publish time (ns) of a message."""

_TOO_MUCH = "the most that is read. Bombs pack like that, or many blank pictures"
_WINDOW = 2**27  # of zstd, as its command line allows without --long


def _zstd(data: bytes, limit: int) -> bytes:
    return ZstdDecompressor(max_window_size=_WINDOW).stream_reader(data).read(limit)


def _lz4(data: bytes, limit: int) -> bytes:
    unpacked: bytes = LZ4FrameDecompressor().decompress(data, max_length=limit)
    return unpacked


_UNPACK: dict[str, Callable[[bytes, int], bytes]] = {"": lambda data, limit: data[:limit], "zstd": _zstd, "lz4": _lz4}


class UnpackError(McapError):
    """A chunk unpacks to more than its `UnpackBudget` allows."""


class UnpackBudget:
    """What the chunks of one file may unpack to: so much for every packed byte, and a reserve for all of them together.

    64 kB can hold chunks that unpack to gigabytes, or to millions of records that take seconds to go through. The reserve
    is for small chunks that pack well; a chunk that stays within its own share is read whatever stands before it.

    Attributes
    ----------
    bytes, records : int
        What is left of the reserve.
    """

    def __init__(self) -> None:
        self.bytes, self.records = LARGEST, 20_000

    def unpack(self, chunk: Chunk, limit: int) -> bytes:
        """The first `limit` bytes of the content of a chunk; UnpackError if that, or what is in it, is too much."""
        packed = len(chunk.data)
        own = BYTES_PER_BYTE * packed
        room = min(own + self.bytes, LARGEST)
        content = _UNPACK[chunk.compression](chunk.data, min(limit, room + 1))
        self.bytes -= max(0, len(content) - own)
        if len(content) > room:
            raise UnpackError(f"{packed} bytes unpack to more than {room} bytes, {_TOO_MUCH}")
        self._take_records(content, packed)
        return content

    def _take_records(self, content: bytes, packed: int) -> None:
        own = int(RECORDS_PER_BYTE * packed)
        most = own + self.records
        count = place = 0
        while place + PREFIX.size <= len(content) and count <= most:
            opcode, length = PREFIX.unpack_from(content, place)
            if opcode == 0:
                break
            place, count = place + PREFIX.size + length, count + 1
        self.records -= max(0, min(count, most) - own)
        if count > most:
            raise UnpackError(f"{packed} bytes unpack to more than {most} records, {_TOO_MUCH}")


def unpack(chunk: Chunk, budget: UnpackBudget) -> bytes:
    """The content of a chunk, its size and checksum (where it has one) verified.

    Raises
    ------
    McapError
        If the compression is unknown, more would come out than `budget` allows, or size or checksum do not fit.
    """
    content = unpack_start(chunk, budget)
    if len(content) != chunk.uncompressed_size:
        raise McapError(f"unpacks to another size than the {chunk.uncompressed_size} bytes that it states")
    if chunk.uncompressed_crc not in (0, zlib.crc32(content)):
        raise McapError("crc validation failed: its checksum does not fit its content")
    return content


def unpack_start(chunk: Chunk, budget: UnpackBudget) -> bytes:
    """What can be unpacked of a chunk that may be cut off, at most one byte more than it states; nothing verified."""
    if chunk.compression not in _UNPACK:
        raise McapError(f"compression = {chunk.compression!r}: only zstd, lz4 and none are known")
    if chunk.uncompressed_size > LARGEST:
        raise McapError(f"unpacked size = {chunk.uncompressed_size} bytes: at most {LARGEST} are read")
    return budget.unpack(chunk, chunk.uncompressed_size + 1)


def bounds(content: bytes) -> Iterator[tuple[int, int, int]]:
    """Opcode of every record in the content of a chunk, and where its body begins and ends; McapError at one not whole."""
    place, size = 0, len(content)
    while place < size:
        start = place + PREFIX.size
        if start > size:
            raise McapError(f"{size - place} bytes are left at byte {place} of a chunk, too few for a record")
        opcode, length = PREFIX.unpack_from(content, place)
        if opcode == 0:
            raise McapError(f"record with opcode 0 at byte {place} of a chunk: there is none")
        place = start + length
        if place > size:
            raise McapError(f"record of {length} bytes at byte {start - PREFIX.size} of a chunk ends after the chunk")
        yield opcode, start, place


def parts(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and body of every record in the content of a chunk; McapError at one that is not whole."""
    return ((opcode, content[start:end]) for opcode, start, end in bounds(content))


def whole_parts(content: bytes) -> bytes:
    """The start of `content` up to where its last whole record ends."""
    end = 0
    try:
        for _, _, place in bounds(content):
            end = place
    except McapError:
        pass
    return content[:end]


def message_of(body: bytes) -> Message:
    """A message from the body of its record."""
    channel, sequence, log_time, publish_time = MESSAGE_HEAD.unpack_from(body)
    return Message(
        channel_id=channel,
        log_time=log_time,
        data=body[MESSAGE_HEAD.size :],
        publish_time=publish_time,
        sequence=sequence,
    )


def record_of(opcode: int, body: bytes) -> McapRecord:
    """A record of one of `KINDS` from its body; McapError if it does not fill that."""
    stream = ReadDataStream(BytesIO(body))
    record: McapRecord = KINDS[opcode].read(stream)
    if stream.count != len(body):
        raise McapError(f"{type(record).__name__} record of {len(body)} bytes holds {stream.count}")
    return record


def by_topic(counts: Mapping[int, int], channels: Mapping[int, Channel]) -> Counter[str]:
    """Counts by channel, added up by the name of the topic."""
    topics: Counter[str] = Counter()
    for channel, count in counts.items():
        topics[channels[channel].topic] += count
    return topics


def records(path: Path) -> Iterator[McapRecord]:
    """All records in the order of the file; those inside a chunk follow it."""
    budget = UnpackBudget()
    for record in outer_records(path):
        yield record
        if isinstance(record, Chunk):
            yield from _content(record, budget)


def outer_records(path: Path) -> Iterator[McapRecord]:
    """All records in the order of the file but those inside chunks."""
    with open_received(path) as file:
        limit = min(LARGEST, path.stat().st_size)
        yield from StreamReader(file, validate_crcs=True, emit_chunks=True, record_size_limit=limit).records


def heads(path: Path, chunks: ChunkTable) -> Iterator[tuple[int, int, bytes]]:
    """Channel, log time (ns) and encoded data of all messages in the order of the file, one chunk in memory."""
    if not chunks:
        for record in records(path):
            if isinstance(record, Message):
                yield record.channel_id, record.log_time, record.data
        return
    budget = UnpackBudget()
    with open_received(path) as file:
        for index in chunks.by_place():
            for opcode, body in parts(unpack(chunk_at(file, index), budget)):
                if opcode == Opcode.MESSAGE:
                    channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(body)
                    yield channel, log_time, body[MESSAGE_HEAD.size :]


def chunk_at(file: BinaryIO, index: ChunkPlace) -> Chunk:
    """The chunk that `index` points at."""
    if index.chunk_length > LARGEST:
        raise McapError(f"chunk of {index.chunk_length} bytes: at most {LARGEST} are read")
    file.seek(index.chunk_start_offset)
    raw = file.read(index.chunk_length)
    if len(raw) != index.chunk_length or raw[:9] != struct.pack("<BQ", Opcode.CHUNK, len(raw) - 9):
        raise McapError(f"no chunk of {index.chunk_length} bytes at byte {index.chunk_start_offset}")
    chunk: Chunk = Chunk.read(ReadDataStream(BytesIO(raw[9:])))
    return chunk


def _content(chunk: Chunk, budget: UnpackBudget) -> list[McapRecord]:
    """The messages and definitions inside a chunk, its checksum verified."""
    with fault_named_by_times(chunk):
        return [record for opcode, body in parts(unpack(chunk, budget)) if (record := inner_record(opcode, body)) is not None]


@contextmanager
def fault_named_by_times(chunk: Chunk) -> Iterator[None]:
    """Turn what the content of a chunk is at fault with into a McapError that names the chunk by its log times."""
    try:
        yield
    except PARSE_ERRORS as error:
        span = f"{chunk.message_start_time} to {chunk.message_end_time} ns"
        raise McapError(f"chunk with log times {span}: {error}") from error


def inner_record(opcode: int, body: bytes) -> McapRecord | None:
    """A message, a channel or a schema from the body of its record; None for any other record."""
    if opcode == Opcode.MESSAGE:
        return message_of(body)
    return record_of(opcode, body) if opcode in (Opcode.CHANNEL, Opcode.SCHEMA) else None
