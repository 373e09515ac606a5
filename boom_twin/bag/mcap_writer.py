"""Writer of an .mcap file from single messages or arrays of messages.

Every chunk has an index. A summary ends the file. The bytes equal those of `mcap.writer.Writer`, which takes no arrays.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Mapping
from typing import BinaryIO

import numpy as np
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC
from zstandard import ZstdCompressor

from ..messages.cdr_encoder import Bytes, EncodedBlock
from ..types import Integers
from .mcap_records import HEADS, MESSAGE_HEAD, PREFIX

COMPRESSION, LEVEL = "zstd", 1  # the level that zstd uses unless told otherwise, 3, takes twice as long for 1 % fewer bytes
_INDEX_HEAD = struct.Struct("<HI")  # index of one channel in one chunk: channel, bytes of entries
_INDEX_ENTRY = struct.Struct("<QQ")  # log time (ns), place in the chunk


class McapWriter:
    """Writer of one .mcap file. `finish` writes its summary.

    Nothing else may write to `stream`, which is empty and is not closed. A chunk is complete above `chunk_size` bytes of
    records. Every method raises the OSErrors of the stream.
    """

    def __init__(self, stream: BinaryIO, profile: str, library: str, chunk_size: int) -> None:
        self._stream, self._chunk_size = stream, chunk_size
        self._chunk = _OpenChunk()
        self._schemas: list[records.Schema] = []
        self._channels: list[records.Channel] = []
        self._chunks = bytearray()  # encoded chunk index, long for a day
        self._chunk_count, self._span = 0, (2**64, 0)  # of all chunks: first and last log time, ns
        self._metadata: list[records.MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        stream.write(MCAP0_MAGIC + _encoded(records.Header(profile, library)))

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record at once, ahead of messages in the open chunk."""
        record, start = _encoded(records.Metadata(name, dict(values))), self._stream.tell()
        self._stream.write(record)
        self._metadata.append(records.MetadataIndex(start, len(record), name))

    def register_schema(self, name: str, encoding: str, definition: bytes) -> int:
        """Add a message type and return its number."""
        self._schemas.append(records.Schema(id=len(self._schemas) + 1, data=definition, encoding=encoding, name=name))
        self._chunk.content += _encoded(self._schemas[-1])
        self._finish_full_chunk()
        return len(self._schemas)

    def register_channel(self, topic: str, encoding: str, schema: int, details: Mapping[str, str]) -> int:
        """Add a topic with the message type of number `schema` and return its channel number."""
        number = len(self._channels) + 1
        self._channels.append(records.Channel(number, topic, encoding, dict(details), schema))
        self._chunk.content += _encoded(self._channels[-1])
        self._finish_full_chunk()
        return number

    def add_message(self, channel: int, log_time: int, data: bytes, publish_time: int, sequence: int) -> None:
        """Append a message to the channel with this number. Times are in ns."""
        head = MESSAGE_HEAD.pack(channel, sequence, log_time, publish_time)
        self._chunk.add(channel, log_time, PREFIX.pack(Opcode.MESSAGE, len(head) + len(data)) + head + data)
        self._finish_full_chunk()

    def add_block(self, channels: Integers, sequences: Integers, block: EncodedBlock) -> None:
        """Append many messages as `add_message` does, each with its channel and sequence number. Publish time is log time."""
        lengths = np.empty(len(channels), np.int64)
        for rows in block.rows:
            lengths[rows.places] = rows.data.shape[1]
        ends = np.cumsum(lengths + HEADS.itemsize)
        starts = ends - lengths - HEADS.itemsize
        content = np.empty(ends[-1], np.uint8)
        _scatter(_heads(channels, sequences, block.log_times, lengths), content, starts)
        for rows in block.rows:
            _scatter(rows.data, content, starts[rows.places] + HEADS.itemsize)
        encoded, first, begin = content.data, 0, 0
        while first < len(ends):
            room = self._chunk_size - len(self._chunk.content)
            part = slice(first, int(np.searchsorted(ends, begin + room, side="right")) + 1)
            end = int(ends[part][-1])
            self._chunk.add_block(channels[part], block.log_times[part], starts[part] - begin, encoded[begin:end])
            self._finish_full_chunk()
            first, begin = part.stop, end

    def flush(self) -> None:
        """Complete a chunk that has messages, and give all bytes to the operating system."""
        self._finish_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Write the end of the file: summary, offsets of its parts, footer."""
        self._finish_chunk()
        self._stream.write(_encoded(records.DataEnd(0)))
        place = start = self._stream.tell()
        checksum, offsets = 0, []
        groups = (
            (Opcode.SCHEMA, _encoded(*self._schemas)),
            (Opcode.CHANNEL, _encoded(*self._channels)),
            (Opcode.STATISTICS, _encoded(self._statistics())),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, b""),
            (Opcode.METADATA_INDEX, _encoded(*self._metadata)),
        )
        for opcode, group in groups:
            offsets.append(records.SummaryOffset(opcode, place, len(group)))
            checksum, place = zlib.crc32(group, checksum), place + len(group)
            self._stream.write(group)
        footer, last = records.Footer(start, place, 0), _encoded(*offsets)
        footer.summary_crc = zlib.crc32(_encoded(footer)[:-4], zlib.crc32(last, checksum))  # covers all but itself
        self._stream.write(last + _encoded(footer) + MCAP0_MAGIC)

    def _statistics(self) -> records.Statistics:
        return records.Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=self._chunk_count,
            message_count=self._counts.total(),
            message_end_time=self._span[1],
            message_start_time=self._span[0] if self._chunk_count else 0,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _finish_full_chunk(self) -> None:
        if len(self._chunk.content) > self._chunk_size:
            self._finish_chunk()

    def _finish_chunk(self) -> None:
        """Write the open chunk and the index of each of its channels, if the chunk has messages."""
        if not self._chunk.entries:
            return
        chunk, self._chunk = self._chunk, _OpenChunk()
        packed, start = ZstdCompressor(LEVEL).compress(chunk.content), self._stream.tell()
        written = bytearray(
            _encoded(
                records.Chunk(
                    compression=COMPRESSION,
                    data=packed,
                    message_start_time=chunk.start,
                    message_end_time=chunk.end,
                    uncompressed_crc=zlib.crc32(chunk.content),
                    uncompressed_size=len(chunk.content),
                )
            )
        )
        length, offsets = len(written), {}
        for channel, entries in chunk.entries.items():
            offsets[channel] = start + len(written)
            size = len(entries)
            written += PREFIX.pack(Opcode.MESSAGE_INDEX, _INDEX_HEAD.size + size) + _INDEX_HEAD.pack(channel, size) + entries
            self._counts[channel] += size // _INDEX_ENTRY.size
        self._stream.write(written)
        self._chunk_count += 1
        self._span = min(self._span[0], chunk.start), max(self._span[1], chunk.end)
        self._chunks += _encoded(
            records.ChunkIndex(
                message_start_time=chunk.start,
                message_end_time=chunk.end,
                chunk_start_offset=start,
                chunk_length=length,
                message_index_offsets=offsets,
                message_index_length=len(written) - length,
                compression=COMPRESSION,
                compressed_size=len(packed),
                uncompressed_size=len(chunk.content),
            )
        )


class _OpenChunk:
    """Records of a chunk that is not yet compressed.

    `entries` are its index (log time and place of every message) by channel, in the order of their first messages.
    """

    def __init__(self) -> None:
        self.content = bytearray()  # the records
        self.entries: dict[int, bytearray] = {}
        self.start = self.end = 0  # first and last log time, ns

    def add(self, channel: int, log_time: int, record: bytes) -> None:
        self._extend_span(log_time, log_time)
        self.entries.setdefault(channel, bytearray()).extend(_INDEX_ENTRY.pack(log_time, len(self.content)))
        self.content += record

    def add_block(self, channels: Integers, log_times: Integers, places: Integers, encoded: memoryview) -> None:
        """Append one or more messages whose records begin at `places` in `encoded`."""
        self._extend_span(int(log_times.min()), int(log_times.max()))
        entries = np.column_stack([log_times, places + len(self.content)]).astype("<u8")
        kinds, firsts = np.unique(channels, return_index=True)
        for channel in kinds[np.argsort(firsts)].tolist():
            self.entries.setdefault(channel, bytearray()).extend(entries[channels == channel].tobytes())
        self.content += encoded

    def _extend_span(self, start: int, end: int) -> None:
        self.start = min(self.start, start) if self.entries else start
        self.end = max(self.end, end)


def _heads(channels: Integers, sequences: Integers, log_times: Integers, lengths: Integers) -> Bytes:
    """Return the bytes before the data of each message, a row each. `lengths` are the bytes of the data."""
    heads = np.empty(len(channels), HEADS)
    columns = (Opcode.MESSAGE, lengths + MESSAGE_HEAD.size, channels, sequences, log_times, log_times)
    for name, column in zip(HEADS.names or (), columns, strict=True):
        heads[name] = column
    return heads.view(np.uint8).reshape(-1, HEADS.itemsize)


def _scatter(rows: Bytes, target: Bytes, starts: Integers) -> None:
    """Copy every row into `target` at its start."""
    kind = np.dtype((np.void, rows.shape[1]))  # one element per row, copied as a whole
    places = np.ndarray(len(target) - kind.itemsize + 1, kind, target, strides=(1,))
    places[starts] = rows.view(kind)[:, 0]


def _encoded(*group: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    for record in group:
        record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]
