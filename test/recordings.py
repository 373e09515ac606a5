"""Sessions that tests write, read and recover, with what they keep of their boom."""

from __future__ import annotations

from boom_twin.bag.metadata import read_metadata, write_metadata
from boom_twin.bag.reader import Session, read, read_both, scan
from boom_twin.bag.recover import Recovery, recover
from boom_twin.bag.session_model import SessionSheet, mapping_of, scene_of
from boom_twin.bag.session_writer import sensor_message, write_session
from boom_twin.bag.writer import FILE_NAME, MessageWriter
from boom_twin.messages.mapping import load_mapping
from boom_twin.offline.ground_truth import load_truth

__all__ = [
    "FILE_NAME",
    "MessageWriter",
    "Recovery",
    "Session",
    "SessionSheet",
    "load_mapping",
    "load_truth",
    "mapping_of",
    "read",
    "read_both",
    "read_metadata",
    "recover",
    "scan",
    "scene_of",
    "sensor_message",
    "write_metadata",
    "write_session",
]  # fmt: skip
