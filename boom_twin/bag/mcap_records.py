"""Read the records of an .mcap file within memory limits, every checksum verified, in the order of the file."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from operator import attrgetter
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from lz4.frame import LZ4FrameDecompressor
from mcap import records as mcap_records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message
from mcap.stream_reader import StreamReader
from zstandard import ZstdDecompressor

from ..errors import BagError
from ..system.received_files import open_received
from .integrity import PARSE_ERRORS

LARGEST = 64 * 2**20
"""Size limit of one record of a summary, and of all definitions together, bytes."""
MOST_HELD = 2**30
"""Size limit of one message, and of one unpacked chunk, in memory, bytes."""
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
CHUNK_HEAD = PREFIX.size + 8 + 8 + 8 + 4 + 4 + 8
"""Bytes of the record of a chunk beside the name of its compression and its packed content."""

_TOO_MUCH = "the most that is read. Bombs pack like that"
_START = 2**22  # bytes that are unpacked at first: they show a bomb of records
_WINDOW = 2**27  # of zstd, as its command line allows without --long


def _zstd(data: bytes, limit: int) -> bytes:
    return ZstdDecompressor(max_window_size=_WINDOW).stream_reader(data).read(limit)


def _lz4(data: bytes, limit: int) -> bytes:
    unpacked: bytes = LZ4FrameDecompressor().decompress(data, max_length=limit)
    return unpacked


_UNPACK: dict[str, Callable[[bytes, int], bytes]] = {"": lambda data, limit: data[:limit], "zstd": _zstd, "lz4": _lz4}


class ChunkPlace(NamedTuple):
    """Place of a chunk, or of messages outside chunks on end; fields as in ``ChunkIndex``.

    `channels` are the channels with messages in it; empty if unknown.
    """

    message_start_time: int
    message_end_time: int
    chunk_start_offset: int
    chunk_length: int
    uncompressed_size: int
    message_index_length: int
    channels: frozenset[int]


def by_place(chunks: Sequence[ChunkPlace]) -> list[ChunkPlace]:
    """Return chunks in the order of the file, which may differ from that of its index."""
    return sorted(chunks, key=attrgetter("chunk_start_offset"))


class UnpackError(McapError):
    """Error of a chunk that unpacks to more than its `UnpackBudget` allows."""


class UnpackBudget:
    """Limit of the unpacked chunks of one file: bytes limit the memory, records the time.

    64 kB can hold chunks of millions of records that take seconds to read. The reserve of records is for small chunks that
    pack well. A chunk within its own share of records is always read.

    Attributes
    ----------
    records : int
        Records left in the reserve.
    """

    def __init__(self) -> None:
        self.records = 20_000

    def unpack(self, chunk: Chunk, limit: int) -> bytes:
        """Return the first `limit` bytes of the content of a chunk. Raise UnpackError for too many bytes or records."""
        own = int(RECORDS_PER_BYTE * len(chunk.data))
        for room in (_START, MOST_HELD + 1):
            content = _UNPACK[chunk.compression](chunk.data, min(limit, room))
            if (count := _records(content, own + self.records)) > own + self.records:
                most, self.records = own + self.records, 0
                raise UnpackError(f"{len(chunk.data)} bytes unpack to more than {most} records, {_TOO_MUCH}")
            if len(content) < room:
                break
        if len(content) > MOST_HELD:
            raise UnpackError(f"{len(chunk.data)} bytes unpack to more than {MOST_HELD} bytes, the most that memory holds")
        self.records -= max(0, count - own)
        return content


def _records(content: bytes, most: int) -> int:
    """Return the number of records in the content of a chunk, as far as they are whole, or one more than `most`."""
    count = place = 0
    while place + PREFIX.size <= len(content) and count <= most:
        opcode, length = PREFIX.unpack_from(content, place)
        if opcode == 0:
            break
        place, count = place + PREFIX.size + length, count + 1
    return count


def unpack(chunk: Chunk, budget: UnpackBudget) -> bytes:
    """Return the content of a chunk after verifying its size and, if it has one, its checksum.

    Raises
    ------
    McapError
        The compression is unknown, the content exceeds `budget`, or size or checksum do not fit.
    """
    content = unpack_start(chunk, budget)
    if len(content) != chunk.uncompressed_size:
        raise McapError(f"unpacks to another size than the {chunk.uncompressed_size} bytes that it states")
    if chunk.uncompressed_crc not in (0, zlib.crc32(content)):
        raise McapError("crc validation failed: its checksum does not fit its content")
    return content


def unpack_start(chunk: Chunk, budget: UnpackBudget) -> bytes:
    """Return what unpacks of a chunk that may be cut off, at most one byte above its stated size. Nothing is verified."""
    if chunk.compression not in _UNPACK:
        raise McapError(f"compression = {chunk.compression!r}: only zstd, lz4 and none are known")
    return budget.unpack(chunk, chunk.uncompressed_size + 1)


def bounds(content: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, start and end of the body of every record in the content of a chunk. McapError at a partial record."""
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
    """Return an iterator of opcode and body of every record in the content of a chunk. McapError at a partial record."""
    return ((opcode, content[start:end]) for opcode, start, end in bounds(content))


def whole_parts(content: bytes) -> bytes:
    """Return the start of `content` up to the end of its last whole record."""
    end = 0
    try:
        for _, _, place in bounds(content):
            end = place
    except McapError:
        pass
    return content[:end]


def message_of(body: bytes) -> Message:
    """Return a message from the body of its record."""
    channel, sequence, log_time, publish_time = MESSAGE_HEAD.unpack_from(body)
    return Message(
        channel_id=channel,
        log_time=log_time,
        data=body[MESSAGE_HEAD.size :],
        publish_time=publish_time,
        sequence=sequence,
    )


def record_of(opcode: int, body: bytes) -> McapRecord:
    """Return a record of one of `KINDS` from its body. Raise McapError if it does not fill the body."""
    stream = ReadDataStream(BytesIO(body))
    record: McapRecord = KINDS[opcode].read(stream)
    if stream.count != len(body):
        raise McapError(f"{type(record).__name__} record of {len(body)} bytes holds {stream.count}")
    return record


def by_topic(counts: Mapping[int, int], channels: Mapping[int, Channel]) -> Counter[str]:
    """Return counts by topic name from counts by channel."""
    topics: Counter[str] = Counter()
    for channel, count in counts.items():
        topics[channels[channel].topic] += count
    return topics


def outer_records(path: Path) -> Iterator[tuple[int, McapRecord]]:
    """Yield all records outside chunks in the order of the file, each with the offset after it."""
    with open_received(path) as file:
        limit = min(MOST_HELD, path.stat().st_size)
        for record in StreamReader(file, validate_crcs=True, emit_chunks=True, record_size_limit=limit).records:
            yield file.tell(), record


def heads(path: Path, chunks: Sequence[ChunkPlace]) -> Iterator[tuple[int, int, bytes]]:
    """Yield channel, log time (ns) and encoded data of all messages in the order of the file, with one piece in memory."""
    budget = UnpackBudget()
    with open_received(path) as file:
        for place in by_place(chunks):
            for opcode, body in parts(content_at(file, place, budget)):
                if opcode == Opcode.MESSAGE:
                    channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(body)
                    yield channel, log_time, body[MESSAGE_HEAD.size :]


def content_at(file: BinaryIO, place: ChunkPlace, budget: UnpackBudget) -> bytes:
    """Return the bytes of the records in a piece of a file: a chunk with verified checksum, or messages outside chunks.

    Raises
    ------
    BagError
        The piece is larger than `MOST_HELD`.
    """
    if (size := max(place.chunk_length, place.uncompressed_size)) > MOST_HELD:
        remedy = "Write smaller chunks: `mcap compress --chunk-size 1048576 IN.mcap -o OUT.mcap`."
        raise BagError(f"{file.name}: a chunk of {size} bytes; at most {MOST_HELD} are held in memory. {remedy}")
    file.seek(place.chunk_start_offset)
    raw = file.read(place.chunk_length)
    if len(raw) != place.chunk_length or not raw.startswith(PREFIX.pack(Opcode.CHUNK, len(raw) - PREFIX.size)):
        if len(raw) == place.chunk_length == place.uncompressed_size and raw[0] == Opcode.MESSAGE:
            return raw
        raise McapError(f"no chunk of {place.chunk_length} bytes at byte {place.chunk_start_offset}")
    chunk: Chunk = Chunk.read(ReadDataStream(BytesIO(raw[PREFIX.size :])))
    with fault_named_by_times(chunk):
        return unpack(chunk, budget)


def chunk_records(chunk: Chunk, budget: UnpackBudget) -> list[McapRecord]:
    """Return the messages and definitions inside a chunk after verifying its checksum."""
    with fault_named_by_times(chunk):
        return [record for opcode, body in parts(unpack(chunk, budget)) if (record := inner_record(opcode, body)) is not None]


@contextmanager
def fault_named_by_times(chunk: Chunk) -> Iterator[None]:
    """Turn errors of the content of a chunk into a McapError that names the chunk by its log times."""
    try:
        yield
    except PARSE_ERRORS as error:
        span = f"{chunk.message_start_time} to {chunk.message_end_time} ns"
        raise McapError(f"chunk with log times {span}: {error}") from error


def inner_record(opcode: int, body: bytes) -> McapRecord | None:
    """Return a message, a channel or a schema from the body of its record; None for any other record."""
    if opcode == Opcode.MESSAGE:
        return message_of(body)
    return record_of(opcode, body) if opcode in (Opcode.CHANNEL, Opcode.SCHEMA) else None
