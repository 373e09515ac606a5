"""Messages with bytes behind their end, as Fast DDS leaves them there: decoder, wire and replay read them all alike."""

from __future__ import annotations

from array import array
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import main
from fuzz.mcap_files import rewrite
from recordings import FILE_NAME, read, scan
from ros_messages import IMU, JOINT_STATE, PADDING, TYPES, decode, encoded, new_message
from rosbags.serde import SerdeError

from boom_twin import BagError, load_scene, replay

NOISE = np.random.default_rng(5)


def both_orders(msg: Any) -> list[bytes]:
    return [encoded(msg, little) for little in (True, False)]


def padded(data: bytes, size: int = PADDING) -> bytes:
    """What stands behind the end is not initialised."""
    return data + NOISE.bytes(size)


@pytest.mark.parametrize("type_name", sorted(set(TYPES.values())))
def test_every_type_is_read_with_as_much_behind_it_as_there_may_be(type_name: str) -> None:
    for data in both_orders(new_message(type_name)):
        for size in range(PADDING + 1):
            assert encoded(decode(padded(data, size), type_name), bool(data[1])) == data, size
        for size in (PADDING + 1, 1000):
            told = f"{size} bytes stand behind its last field, which ends at byte {len(data)};"
            with pytest.raises(SerdeError, match=f"{type_name} of {len(data) + size} bytes: {told}"):
                decode(padded(data, size), type_name)


def test_what_rclpy_hands_to_raw_publishers_is_read() -> None:
    """And that is as much behind the end as we take: more than rosbags does."""
    serialization = pytest.importorskip("rclpy.serialization")
    from sensor_msgs.msg import JointState

    most = 0
    for filled in range(8):
        msg = JointState(name=["cylinder_1"])
        msg.position, msg.velocity, msg.effort = (array("d", [1.5] * bool(filled & bit)) for bit in (1, 2, 4))
        for msg.header.frame_id in ("", "a", "ab", "abc", "abcd", "abcde", "abcdef", "abcdefg"):
            data = serialization.serialize_message(msg)
            found = decode(data, JOINT_STATE)
            for key in ("position", "velocity", "effort"):
                assert list(getattr(found, key)) == list(getattr(msg, key))
            most = max(most, len(data) - len(encoded(found)))
    assert most == PADDING


def test_a_session_with_padding_is_replayed_to_the_same_outputs(moving: Path, tmp_path: Path) -> None:
    scene, types = load_scene(), cycle((JOINT_STATE, JOINT_STATE, IMU))  # in the order of the session

    def recoded(data: bytes) -> bytes:
        """Of either byte order, with anything behind it."""
        orders = both_orders(decode(data, next(types)))
        return padded(orders[int(NOISE.integers(2))], int(NOISE.integers(PADDING + 1)))

    found = {}
    for name, recode in {"none": bytes, "some": recoded}.items():
        other = rewrite(moving / FILE_NAME, tmp_path / f"{name}.mcap", recode=recode)
        summary = replay(other, scene, tmp_path / name).summary
        found[name] = summary["output_sha256"], summary["samples"]
    assert set(found.values()) == {(found["none"][0], 400)}


def test_one_byte_more_is_refused_by_topic_time_and_place(moving: Path, tmp_path: Path, capsys: Any) -> None:
    other = rewrite(moving / FILE_NAME, tmp_path / "more.mcap", recode=lambda data: padded(data, PADDING + 1))
    told = r"more\.mcap: topic /cylinder_strokes at log time 1700000000000000000 ns: .*: 13 bytes stand behind its last field"
    with pytest.raises(BagError, match=told):
        list(read(scan(other), {"cylinder_strokes": JOINT_STATE}))
    for command in (["replay", str(other), "--out", str(tmp_path / "out")], ["monitor", "--bag", str(other), "--port", "0"]):
        assert main(command) == 1
        assert "13 bytes stand behind its last field" in capsys.readouterr().err
