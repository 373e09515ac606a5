"""Messages read from their bytes against the same messages decoded."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boom_twin.messages.cdr_decoder import CdrDecoder
from boom_twin.messages.message_fields import fill_header
from boom_twin.messages.sample_decoder import SampleDecoder
from boom_twin.messages.topic_table import TYPES
from boom_twin.messages.type_store import decode, jazzy, new_message
from boom_twin.types import SENSORS, Stream


def counted(calls: list[bytes]) -> Any:
    def counting(data: bytes, type_name: str) -> Any:
        calls.append(data)
        return decode(data, type_name)

    return counting


def joint_state(stamp: int, names: list[str], values: Any, frame: str = "", effort: int = 0) -> bytes:
    msg = new_message(TYPES[Stream.STROKES])
    fill_header(msg.header, stamp, frame)
    msg.name, msg.position, msg.effort = names, np.array(values, dtype=float), np.zeros(effort)
    return bytes(jazzy().serialize_cdr(msg, TYPES[Stream.STROKES]))


def forces(stamp: int, names: list[str], values: Any, frame: str = "", position: int = 0) -> bytes:
    msg = new_message(TYPES[Stream.FORCES])
    fill_header(msg.header, stamp, frame)
    msg.name, msg.effort, msg.position = names, np.array(values, dtype=float), np.arange(float(position))
    return bytes(jazzy().serialize_cdr(msg, TYPES[Stream.FORCES]))


def imu(stamp: int, frame: str, covariance: float, x: float, z: float) -> bytes:
    msg = new_message(TYPES[Stream.IMU])
    fill_header(msg.header, stamp, frame)
    msg.linear_acceleration.x, msg.linear_acceleration.z = x, z
    msg.linear_acceleration_covariance[0] = covariance
    return bytes(jazzy().serialize_cdr(msg, TYPES[Stream.IMU]))


def same(wire: CdrDecoder, stream: Stream, data: bytes) -> None:
    """What an intake makes of it, with and without decoding all of it."""
    decoded = decode(data, TYPES[stream])
    stamp, msg = wire.read(data)
    assert stamp == decoded.header.stamp.sec * 10**9 + decoded.header.stamp.nanosec
    mine, theirs = SampleDecoder(4), SampleDecoder(4)
    ours, other = mine.put(stream, stamp, msg), theirs.put(stream, stamp, decoded)
    assert mine.oddities == theirs.oddities
    assert (ours is None) == (other is None)
    if ours is not None and other is not None:
        assert ours.values.tobytes() == other.values.tobytes()


def test_strokes_of_every_layout() -> None:
    random, calls = np.random.default_rng(2), []
    wire = CdrDecoder(TYPES[Stream.STROKES], counted(calls))
    names = [f"cylinder_{i}" for i in (3, 1, 4, 2)]
    for frame in ("", "base_link", "x" * 7):
        for extra in ([], ["boom_é"], ["a", "bb", "ccc"]):
            for count in (0, 4, 9):
                for effort in (0, 3):
                    for k in range(3):
                        same(wire, Stream.STROKES, joint_state(k, names + extra, random.normal(size=count), frame, effort))
    assert len(calls) == 3 * 3, "each frame with each list of names"


def test_forces_behind_positions_of_every_layout() -> None:
    random, calls = np.random.default_rng(2), []
    wire = CdrDecoder(TYPES[Stream.FORCES], counted(calls), SENSORS[Stream.FORCES].field)
    names = [f"cylinder_{i}" for i in (3, 1, 4, 2)]
    for frame in ("", "x" * 7):
        for extra in ([], ["a", "bb", "ccc"]):
            for count in (0, 4, 9):
                for position in (0, 3):
                    for k in range(3):
                        same(wire, Stream.FORCES, forces(k, names + extra, random.normal(size=count), frame, position))
    assert len(calls) == 2 * 2


def test_accelerations_of_every_frame() -> None:
    calls: list[bytes] = []
    wire = CdrDecoder(TYPES[Stream.IMU], counted(calls))
    for frame in ("", "tip", "tip_link", "base_footprint"):
        for k, covariance in enumerate((0.0, -1.0, 0.2)):
            same(wire, Stream.IMU, imu(10**18 + k, frame, covariance, 0.1 * k, -9.0))
    assert len(calls) == 4


def test_other_names_of_the_same_length() -> None:
    """Layouts that take turns, as of joints in messages of their own, are remembered."""
    calls: list[bytes] = []
    wire = CdrDecoder(TYPES[Stream.ANGLES], counted(calls))
    for names in (["joint_1", "joint_2"], ["joint_2", "joint_1"], ["joint_1", "joint_2"]):
        same(wire, Stream.ANGLES, joint_state(5, names, [1.0, 2.0]))
    assert len(calls) == 2


@pytest.mark.parametrize("cut", [0, 3, 8, 11, 20, 40, 60])
def test_a_message_that_is_cut_off_is_refused_and_the_next_one_read(cut: int) -> None:
    wire = CdrDecoder(TYPES[Stream.STROKES])
    data = joint_state(7, ["cylinder_1", "cylinder_2"], [1.0, 2.0])
    wire.read(data)
    with pytest.raises(Exception):  # noqa: B017 - whatever the decoder raises
        wire.read(data[:cut])
    same(wire, Stream.STROKES, data)


@pytest.mark.parametrize("length", [0, 1])
def test_lengths_behind_the_numbers_count_too(length: int) -> None:
    """Else a message that a full decoder refuses is taken, and the recording of it can never be replayed."""
    wire = CdrDecoder(TYPES[Stream.STROKES])
    data = joint_state(7, ["cylinder_1", "cylinder_2"], [1.0, 2.0])
    wire.read(data)
    velocity = len(data) - 8
    for place in (velocity, velocity + 4):
        with pytest.raises(Exception):  # noqa: B017 - whatever the decoder raises
            wire.read(data[:place] + b"\xff\xff\xff\x7f" + data[place + 4 :])
    same(wire, Stream.STROKES, joint_state(7, ["cylinder_1", "cylinder_2"], [1.0, 2.0], effort=length))


def test_names_that_are_not_utf_8_have_question_marks() -> None:
    """Layouts known or not, and many names of one message; numbers that happen to have the same bytes stay."""
    names, calls = ["cylinder_1", "Druck_X", "X", "cylinder_2"], list[bytes]()
    wire = CdrDecoder(TYPES[Stream.STROKES], counted(calls))
    for k in range(3):
        data = joint_state(k + 1, names, [0.1, 9.0, 9.0, 0.2], "Rahmen X").replace(b"X\0", b"\xfc\0")
        same(wire, Stream.STROKES, data)
        msg = wire.read(data)[1]
        assert list(msg.name) == ["cylinder_1", "Druck_?", "?", "cylinder_2"] and list(msg.position) == [0.1, 9.0, 9.0, 0.2]
    assert len(calls) == 1
