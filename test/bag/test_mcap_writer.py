"""The writer of .mcap files against the library's: the same bytes, message by message and in blocks."""

from __future__ import annotations

from io import BytesIO
from itertools import pairwise

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from zstandard import ZstdCompressor

from boom_twin.bag.mcap_writer import LEVEL, McapWriter
from boom_twin.messages.cdr_encoder import EncodedBlock, EncodedRows

CHUNK = 2000
Message = tuple[int, int, int, bytes]
"""Channel, log time, sequence, data."""


def random_messages(seed: int) -> list[Message]:
    """Of three channels and lengths of all kinds, also beyond a chunk; times go back too, some are 0."""
    random = np.random.default_rng(seed)
    lengths = random.choice([1, 52, 76, 300, 2100, 9000], 600, p=[0.1, 0.3, 0.3, 0.27, 0.02, 0.01])
    times = np.maximum(0, np.cumsum(random.integers(-3, 9, 600)) - 20)
    rows = zip(random.choice([2, 1, 3], 600), times, lengths, strict=True)
    return [(int(channel), int(time), k, random.bytes(size // 3) * 3 or b"x") for k, (channel, time, size) in enumerate(rows)]


def block_of(messages: list[Message]) -> EncodedBlock:
    """By channel and length; only the places and the data of its rows matter here."""
    groups: dict[tuple[int, int], list[int]] = {}
    for place, (channel, _, _, data) in enumerate(messages):
        groups.setdefault((channel, len(data)), []).append(place)
    rows = [
        EncodedRows(str(channel), np.array(places), np.array([np.frombuffer(messages[k][3], np.uint8) for k in places]))
        for (channel, _), places in groups.items()
    ]
    return EncodedBlock(np.array([time for _, time, _, _ in messages]), rows)


def define(writer: Writer | McapWriter, flushed: set[int]) -> None:
    """Write a note, types and topics. A definition is longer than a chunk where the chunk is flushed in between."""
    writer.add_metadata("notes", {"origin": "synthetic", "": "ä"})
    for name in ("pkg/msg/A", "pkg/msg/B"):
        writer.register_schema(name, "ros2msg", b"int32 value\n" * (200 if flushed else 40))
    for number in range(3):
        writer.register_channel(f"/{number}", "cdr", 1 + number % 2, {"offered_qos_profiles": "- x"})


def by_the_library(messages: list[Message], flushed: set[int]) -> bytes:
    with BytesIO() as file:
        writer = Writer(file, chunk_size=CHUNK)
        writer.start("ros2", "test")
        define(writer, flushed)
        for place, (channel, time, sequence, data) in enumerate(messages):
            if place in flushed:
                writer.flush()
            writer.add_message(channel, time, data, time, sequence)
        writer.register_channel("/late", "cdr", 1, {})
        writer.finish()
        return file.getvalue()


def by_the_package(messages: list[Message], flushed: set[int], size: int) -> bytes:
    """In blocks of so many, and one by one where that is 0."""
    file = BytesIO()
    writer = McapWriter(file, "ros2", "test", CHUNK)
    define(writer, flushed)
    ends = sorted({0, *flushed, len(messages), *(range(0, len(messages), size) if size else ())})
    for first, end in pairwise(ends):
        if first in flushed:
            writer.flush()
        part = messages[first:end]
        if size:
            channels, _, sequences, _ = zip(*part, strict=True)
            writer.add_block(np.array(channels), np.array(sequences), block_of(part))
        else:
            for channel, time, sequence, each in part:
                writer.add_message(channel, time, each, time, sequence)
    writer.register_channel("/late", "cdr", 1, {})
    writer.finish()
    return file.getvalue()


@pytest.mark.parametrize("size", [0, 1, 7, 150, 600])
def test_the_bytes_are_those_of_the_library(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mcap.writer.zstandard.compress", ZstdCompressor(LEVEL).compress)
    for seed, flushed in enumerate([set(), {0, 100, 101, 333}]):
        messages = random_messages(seed)
        expected = by_the_library(messages, flushed)
        assert by_the_package(messages, flushed, size) == expected
    with BytesIO(expected) as file:
        found = [message for *_, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False)]
    assert [(each.channel_id, each.log_time, each.sequence, each.data) for each in found] == messages
