"""Fill fields of ROS messages: header with stamp and frame, and the model plane in REP-103 axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..types import SECOND, Array

FRAME = "base_link"
TIP_JOINTS = ("tip_dx", "tip_dz", "tip_pitch")
"""Displacement of the tip from that of rigid sections: along and across the last section, m, and its rotation, rad."""


def fill_header(header: Any, stamp: int, frame: str = FRAME) -> None:
    """Put a stamp (nanoseconds) and a frame into a ``std_msgs/Header``."""
    header.stamp.sec, header.stamp.nanosec = divmod(stamp, SECOND)
    header.frame_id = frame


def fill_xz(target: Any, values: Array | Sequence[float]) -> None:
    """Write model x to x and model y to z; y stays 0."""
    target.x, target.y, target.z = float(values[0]), 0.0, float(values[1])
