"""Summarise one .mcap file without decoding its messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Message, Metadata, Schema, Statistics
from mcap.summary import Summary

from ..errors import BagError
from ..system.received_files import open_received
from .integrity import as_bag_error, check_ends, compare_counts
from .mcap_records import LARGEST, by_topic, records
from .recovery.chunk_head import head_at

PROFILE = "ros2"
NOTES = "boom_twin"
"""Name of the metadata record that holds the notes on a session."""


@dataclass(frozen=True, slots=True)
class McapFile:
    """What one file holds.

    Attributes
    ----------
    path : Path
    channels : dict of int to Channel
    schemas : dict of int to Schema
    counts : dict of int to int
        Messages by channel.
    start, end : int
        First and last log time in nanoseconds; 0 without messages.
    chunks : tuple of ChunkIndex
        Empty when the file has no complete index and must be read as a whole.
    checked : bool
        Whether its messages are under a checksum and counted. If not, a flipped bit can pass without notice.
    notes : dict of str to str
    """

    path: Path
    channels: dict[int, Channel]
    schemas: dict[int, Schema]
    counts: dict[int, int]
    start: int
    end: int
    chunks: tuple[ChunkIndex, ...]
    checked: bool
    notes: dict[str, str]

    def check_counts(self, source: str, counts: Mapping[int, int], other: str, others: Mapping[int, int]) -> None:
        """Raise BagError, as `compare_counts`, if two counts by channel are not the same for every topic."""
        one, two = by_topic(counts, self.channels), by_topic(others, self.channels)
        compare_counts(self.path, source, one, other, two)


def summarise(path: Path) -> McapFile:
    """Look at one file: only at its summary if that is complete, else at all of it.

    Raises
    ------
    BagError
        If it is not there, not MCAP, cut off, damaged, or of another profile than ros2.
    """
    with as_bag_error(path), open_received(path) as file:
        check_ends(path, file)
        file.seek(0)
        reader = SeekingReader(file, validate_crcs=True, record_size_limit=min(LARGEST, path.stat().st_size))
        if (profile := reader.get_header().profile) != PROFILE:
            raise BagError(f"{path}: profile = {profile!r}: only {PROFILE!r} is read. Record the session with ROS 2.")
        summary = reader.get_summary()
        told = summary.statistics if summary else None
        if summary is None or told is None or not _is_complete(summary, told):
            return _walk(path)
        return McapFile(
            path=path,
            channels=summary.channels,
            schemas=summary.schemas,
            counts=dict(told.channel_message_counts),
            start=told.message_start_time,
            end=told.message_end_time,
            chunks=tuple(summary.chunk_indexes),
            checked=all(_has_checksum(file, index) for index in summary.chunk_indexes),
            notes=_notes(reader.iter_metadata()),
        )


def _is_complete(summary: Summary, told: Statistics) -> bool:
    """Whether the summary alone tells what is in the file and where."""
    return (
        0 < told.chunk_count == len(summary.chunk_indexes)
        and told.channel_message_counts.keys() <= summary.channels.keys()
        and {channel.schema_id for channel in summary.channels.values()} <= {0, *summary.schemas}
    )


def _has_checksum(file: BinaryIO, index: ChunkIndex) -> bool:
    head = head_at(file, index.chunk_start_offset)
    return head is not None and head.crc != 0


def _walk(path: Path) -> McapFile:
    """Look at all of a file, and compare its statistics, if it has them, with what is there."""
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    notes: list[Metadata] = []
    counts: Counter[int] = Counter()
    start, end = 2**64, 0
    told: Statistics | None = None
    is_summed, chunks_summed = False, set[bool]()
    for record in records(path):
        match record:
            case Message():
                counts[record.channel_id] += 1
                start, end = min(start, record.log_time), max(end, record.log_time)
            case Channel():
                channels[record.id] = record
            case Schema():
                schemas[record.id] = record
            case Metadata():
                notes.append(record)
            case Chunk():
                chunks_summed.add(record.uncompressed_crc != 0)
            case DataEnd():
                is_summed = record.data_section_crc != 0
            case Statistics():
                told = record
    start = start if counts else 0
    checked = is_summed or (chunks_summed == {True} and told is not None)
    held = McapFile(path, channels, schemas, dict(counts), start, end, (), checked, _notes(notes))
    if told is not None:
        held.check_counts("statistics", told.channel_message_counts, "in the file", counts)
    return held


def _notes(found: Iterable[Metadata]) -> dict[str, str]:
    return {key: value for record in found if record.name == NOTES for key, value in record.metadata.items()}
