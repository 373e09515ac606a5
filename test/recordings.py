"""Sessions that tests write, read and recover, with what they keep of their boom."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from boom_twin import Stream
from boom_twin.bag.metadata import FILE_NAME as METADATA
from boom_twin.bag.metadata import read_metadata, write_metadata
from boom_twin.bag.reader import Session, read, read_both, scan
from boom_twin.bag.recover import Recovery, recover
from boom_twin.bag.session_model import FILE_NAME as SESSION_YAML
from boom_twin.bag.session_model import SessionMetadata, incompleteness, kept, mapping_of, scene_of
from boom_twin.bag.session_writer import samples_in_rows, sensor_message, write_samples
from boom_twin.bag.writer import FILE_NAME, MessageWriter
from boom_twin.messages.mapping import load_mapping
from boom_twin.offline.ground_truth import FILE_NAME as TRUTH
from boom_twin.offline.ground_truth import load_truth
from boom_twin.types import Array

__all__ = [
    "FILE_NAME", "METADATA", "SESSION_YAML", "TRUTH", "MessageWriter", "Recovery", "Session", "SessionMetadata",
    "incompleteness", "kept", "load_mapping", "load_truth", "mapping_of", "read", "read_both", "read_metadata", "recover",
    "samples_in_rows", "scan", "scene_of", "sensor_message", "write_metadata", "write_samples", "write_session",
]  # fmt: skip


def write_session(
    directory: Path,
    stamps_ns: Array,
    strokes: Array,
    joints: Array | None,
    imu: Array | None,
    description: Mapping[str, str],
    angle_stamps_ns: Array | None = None,
    forces: Array | None = None,
    placed: Mapping[Stream, Array] | None = None,
) -> None:
    """Write rows of readings at `stamps_ns` as a session; angles may have stamps of their own."""
    values = {Stream.STROKES: strokes, Stream.ANGLES: joints, Stream.IMU: imu, Stream.FORCES: forces, **(placed or {})}
    there = {stream: rows for stream, rows in values.items() if rows is not None}
    write_samples(directory, samples_in_rows(stamps_ns, there, angle_stamps_ns), there, description)
