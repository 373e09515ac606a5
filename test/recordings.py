"""Sessions that tests write, read and recover, with what they keep of their boom."""

from __future__ import annotations

from boom_twin.bag.metadata import FILE_NAME as METADATA
from boom_twin.bag.metadata import read_metadata, write_metadata
from boom_twin.bag.reader import Session, read, read_both, scan
from boom_twin.bag.recovery.recover import Recovery, recover
from boom_twin.bag.session_files import samples_of, sensor_message, write_samples, write_session
from boom_twin.bag.session_model import mapping_of, scene_of
from boom_twin.bag.session_sheet import FILE_NAME as SHEET
from boom_twin.bag.session_sheet import SessionSheet, incompleteness, kept
from boom_twin.bag.writer import FILE_NAME, MessageWriter
from boom_twin.messages.mapping import load_mapping
from boom_twin.offline.ground_truth import FILE_NAME as TRUTH
from boom_twin.offline.ground_truth import load_truth

__all__ = [
    "FILE_NAME", "METADATA", "SHEET", "TRUTH", "MessageWriter", "Recovery", "Session", "SessionSheet", "incompleteness",
    "kept", "load_mapping", "load_truth", "mapping_of", "read", "read_both", "read_metadata", "recover", "samples_of",
    "scan", "scene_of", "sensor_message", "write_metadata", "write_samples", "write_session",
]  # fmt: skip
