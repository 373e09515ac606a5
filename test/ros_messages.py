"""Topics, messages of sensors and their bytes, without ROS: by rosbags and by the package."""

from __future__ import annotations

from typing import Any

import numpy as np

from boom_twin import Stream
from boom_twin.messages.report_encoder import ReportEncoder, decode_changes, decode_health, encode_changes, encode_health
from boom_twin.messages.sample_decoder import SampleDecoder, stamp_of
from boom_twin.messages.topic_table import Output, Qos, Topic, Topics, every_input, load_topics, type_of
from boom_twin.messages.type_store import PADDING, decode, fill_header, jazzy, new_message
from boom_twin.types import SENSORS

__all__ = [
    "IMU", "JOINT_STATE", "PADDING", "TYPES", "Output", "Qos", "ReportEncoder", "SampleDecoder", "Topic", "Topics",
    "decode", "decode_changes", "decode_health", "decoded", "encode_changes", "encode_health", "encoded", "every_input",
    "fill_header", "imu", "jazzy", "joint_state", "load_topics", "new_message", "stamp_of",
]  # fmt: skip

TYPES: dict[Stream | Output, str] = {
    **{stream: kind.message for stream, kind in SENSORS.items()},
    **{output: type_of(output) for output in Output},
}
JOINT_STATE, IMU = TYPES[Stream.STROKES], TYPES[Stream.IMU]


def joint_state(names: list[str], position: Any, stamp: int = 0, frame: str = "", **arrays: Any) -> Any:
    """Return a sensor_msgs/JointState; `arrays` are velocity and effort."""
    msg = new_message(JOINT_STATE)
    fill_header(msg.header, stamp, frame)
    msg.name = names
    for name, values in {"position": position, **arrays}.items():
        setattr(msg, name, np.array(values, dtype=float))
    return msg


def imu(x: float, z: float, stamp: int = 0, frame: str = "", covariance: float = 0.0) -> Any:
    """Return a sensor_msgs/Imu that also has an acceleration across the model's plane."""
    msg = new_message(IMU)
    fill_header(msg.header, stamp, frame)
    msg.linear_acceleration.x, msg.linear_acceleration.y, msg.linear_acceleration.z = x, 77.0, z
    msg.linear_acceleration_covariance[0] = covariance
    return msg


def encoded(msg: Any, little_endian: bool = True) -> bytes:
    return bytes(jazzy().serialize_cdr(msg, msg.__msgtype__, little_endian=little_endian))


def decoded(data: bytes, role: Stream | Output) -> Any:
    return jazzy().deserialize_cdr(data, TYPES[role])
