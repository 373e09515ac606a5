"""MCAP files written in other ways than the package writes them, and their records one by one."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

MAGIC = b"\x89MCAP0\r\n"
PREFIX = struct.Struct("<BQ")

VARIANTS: dict[str, dict[str, Any]] = {
    "plain": {"compression": CompressionType.NONE},
    "lz4": {"compression": CompressionType.LZ4},
    "zstd": {"compression": CompressionType.ZSTD},
    "unindexed": {"index_types": IndexType.NONE},
    "unchunked": {"use_chunking": False, "enable_data_crcs": True},
    "unchecked": {"enable_crcs": False},
}


def rewrite(
    source: Path,
    target: Path,
    *,
    profile: str = "ros2",
    encoding: str = "cdr",
    schema_encoding: str = "ros2msg",
    change: Callable[[bytes], bytes] = bytes,
    recode: Callable[[bytes], bytes] = bytes,
    rename: Callable[[str], str] = str,
    backwards: bool = False,
    **options: Any,
) -> Path:
    """Write the messages of `source` with other options, topics, order, definitions (`change`) or content (`recode`)."""
    options = {"chunk_size": 2048, "compression": CompressionType.NONE, **options}
    with source.open("rb") as old, target.open("wb") as new:
        writer = Writer(new, **options)
        writer.start(profile=profile, library="test")
        channels: dict[str, int] = {}
        found = list(make_reader(old).iter_messages())
        for schema, channel, message in reversed(found) if backwards else found:
            if channel.topic not in channels:
                kind = writer.register_schema(schema.name, schema_encoding, change(schema.data))
                channels[channel.topic] = writer.register_channel(rename(channel.topic), encoding, kind)
            writer.add_message(channels[channel.topic], message.log_time, recode(message.data), message.publish_time)
        writer.finish()
    return target


Entry = tuple[str, str, str, int, bytes]  # topic, type, encoding, log time (ns), data


def write(path: Path, entries: Iterable[Entry], name: Callable[[str], str] = str, **options: Any) -> Path:
    """Write messages into one file, types named otherwise, definitions empty."""
    with path.open("wb") as stream:
        writer, channels = Writer(stream, **options), dict[tuple[str, str, str], int]()
        writer.start(profile="ros2", library="test")
        for topic, kind, encoding, log, data in entries:
            if (topic, kind, encoding) not in channels:
                schema = writer.register_schema(name(kind), "ros2msg", b"")
                channels[topic, kind, encoding] = writer.register_channel(topic, encoding, schema)
            writer.add_message(channels[topic, kind, encoding], log, data, log)
        writer.finish()
    return path


def records(data: bytes) -> list[tuple[int, bytes]]:
    """Opcode and body of all records outside chunks of a sound file."""
    found, place = [], len(MAGIC)
    while place < len(data) - len(MAGIC):
        opcode, length = PREFIX.unpack_from(data, place)
        place += PREFIX.size + length
        found.append((opcode, data[place - length : place]))
    return found


def joined(found: list[tuple[int, bytes]]) -> bytes:
    """A file of these records."""
    return MAGIC + b"".join(PREFIX.pack(opcode, len(body)) + body for opcode, body in found) + MAGIC
