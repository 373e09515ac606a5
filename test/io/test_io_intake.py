"""Messages of the rig to samples in the scene's order."""

from __future__ import annotations

from array import array
from math import inf, isnan, nan
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boom_twin.io.factory import RosbagsTypes
from boom_twin.io.intake import Intake, stamp_of
from boom_twin.records import Stream

TYPES = RosbagsTypes()
FINITE = st.floats(-1e6, 1e6)
OTHER_NAMES = st.text(max_size=12).filter(lambda name: not name.startswith(("joint_", "cylinder_")))


def joint_state(names: list[str], positions: list[float]) -> Any:
    msg = TYPES.make("sensor_msgs/msg/JointState")
    msg.name, msg.position = names, TYPES.doubles(positions)
    return msg


def imu(x: float, z: float) -> Any:
    msg = TYPES.make("sensor_msgs/msg/Imu")
    msg.linear_acceleration.x, msg.linear_acceleration.y, msg.linear_acceleration.z = x, 77.0, z
    return msg


@settings(deadline=None)
@given(
    values=st.lists(FINITE, min_size=1, max_size=6),
    others=st.lists(st.tuples(OTHER_NAMES, FINITE), max_size=4),
    data=st.data(),
)
def test_any_order_and_extra_names(values: list[float], others: list[tuple[str, float]], data: st.DataObject) -> None:
    pairs = [(f"joint_{i}", value) for i, value in enumerate(values, 1)] + others
    mixed = data.draw(st.permutations(pairs))
    intake = Intake(len(values))
    sample = intake.put(Stream.ANGLES, 12, joint_state([n for n, _ in mixed], [v for _, v in mixed]))
    assert sample is not None and (sample.stream, sample.stamp) == (Stream.ANGLES, 12)
    assert sample.values.tolist() == values
    assert not intake.oddities


@settings(deadline=None)
@given(
    values=st.lists(st.one_of(FINITE, st.sampled_from([nan, inf, -inf, 1.1e6, -1e300])), min_size=3, max_size=3),
    present=st.sets(st.integers(0, 2)),
    cut=st.integers(0, 3),
)
def test_what_is_left_is_right_and_the_rest_is_nan(values: list[float], present: set[int], cut: int) -> None:
    """Whatever is wrong with a message: a value in the sample is the one under that name, or NaN."""
    names = [f"cylinder_{i + 1}" for i in sorted(present)]
    positions = [values[i] for i in sorted(present)][:cut]
    sample = Intake(3).put(Stream.STROKES, 0, joint_state(names, positions))
    usable = {i: values[i] for i in sorted(present)[:cut] if abs(values[i]) <= 1e6}
    if not usable:
        assert sample is None
    else:
        assert sample is not None and sample.values.dtype == np.float64
        assert {i: value for i, value in enumerate(sample.values.tolist()) if not isnan(value)} == usable


@pytest.mark.parametrize(
    ("names", "positions", "expected", "oddities"),
    [
        (["cylinder_1", "cylinder_2"], [0.1], [0.1, nan], {"unequal arrays": 1}),
        (["cylinder_1"], [0.1, 0.2], [0.1, nan], {"unequal arrays": 1, "missing names": 1}),
        (["cylinder_2"], [0.2], [nan, 0.2], {"missing names": 1}),
        (["cylinder_1", "cylinder_2"], [nan, 0.2], [nan, 0.2], {"not finite": 1}),
        (["cylinder_1", "cylinder_2"], [0.1, -inf], [0.1, nan], {"not finite": 1}),
        (["cylinder_1", "cylinder_2"], [0.1, 2e6], [0.1, nan], {"absurd magnitude": 1}),
        (
            ["cylinder_1", "cylinder_2"],
            [nan, 2e6],
            None,
            {"not finite": 1, "absurd magnitude": 1, "no usable value": 1},
        ),
        (["joint_1", "joint_2"], [0.1, 0.2], None, {"unknown names only": 1}),
        ([], [], None, {"unknown names only": 1}),
        (["cylinder_1", "cylinder_2"], [], None, {"unequal arrays": 1, "no usable value": 1}),
        (["cylinder_2", "cylinder_1", "cylinder_2"], [0.2, 0.1, 0.9], [0.1, 0.2], {}),
    ],
)
def test_oddities_are_counted_by_name(
    names: list[str], positions: list[float], expected: list[float] | None, oddities: dict[str, int]
) -> None:
    intake = Intake(2)
    sample = intake.put(Stream.STROKES, 5, joint_state(names, positions))
    assert dict(intake.oddities) == oddities
    if expected is None:
        assert sample is None
    else:
        assert sample is not None
        np.testing.assert_array_equal(sample.values, expected)


def test_imu_gives_x_and_z() -> None:
    sample = Intake(4).put(Stream.IMU, 9, imu(0.25, 9.81))
    assert sample is not None and sample.stream is Stream.IMU
    assert sample.values.tolist() == [0.25, 9.81]


def test_imu_without_acceleration_gives_nothing() -> None:
    intake, msg = Intake(4), imu(0.0, 0.0)
    msg.linear_acceleration_covariance[0] = -1.0
    assert intake.put(Stream.IMU, 9, msg) is None
    assert dict(intake.oddities) == {"no measurement": 1}


def test_imu_with_one_bad_axis_keeps_the_other() -> None:
    intake = Intake(4)
    sample = intake.put(Stream.IMU, 9, imu(nan, 9.7))
    assert sample is not None
    np.testing.assert_array_equal(sample.values, [nan, 9.7])
    assert dict(intake.oddities) == {"not finite": 1}


def test_counts_add_up_over_messages() -> None:
    intake = Intake(1)
    for _ in range(3):
        intake.put(Stream.STROKES, 0, joint_state(["x"], [1.0]))
    assert dict(intake.oddities) == {"unknown names only": 3}


def test_messages_of_rclpy_give_the_same() -> None:
    """They hold ``array.array`` where rosbags has numpy; nothing else differs for a reader."""
    names, positions = ["joint_2", "other", "joint_1"], [0.1 + 0.2, 5.0, -1 / 3]
    foreign = SimpleNamespace(name=names, position=array("d", positions))
    one = Intake(2).put(Stream.ANGLES, 1, joint_state(names, positions))
    other = Intake(2).put(Stream.ANGLES, 1, foreign)
    assert one is not None and other is not None
    assert one.values.tobytes() == other.values.tobytes()


def test_real_messages_of_rclpy_are_taken() -> None:
    messages = pytest.importorskip("sensor_msgs.msg")
    sample = Intake(2).put(Stream.ANGLES, 1, messages.JointState(name=["joint_2", "joint_1"], position=[0.2, 0.1]))
    assert sample is not None and sample.values.tolist() == [0.1, 0.2]
    force = messages.Imu()
    force.linear_acceleration.x, force.linear_acceleration.z = 1.5, 9.5
    sample = Intake(2).put(Stream.IMU, 1, force)
    assert sample is not None and sample.values.tolist() == [1.5, 9.5]


def test_stamp_of_is_exact() -> None:
    msg = TYPES.make("sensor_msgs/msg/Imu")
    msg.header.stamp.sec, msg.header.stamp.nanosec = 1_700_000_000, 999_999_999
    assert stamp_of(msg) == 1_700_000_000_999_999_999


@pytest.mark.parametrize("stamp", [-1, 2**31 * 10**9])
def test_impossible_stamps_give_no_sample(stamp: int) -> None:
    intake = Intake(1)
    message = RosbagsTypes().make("sensor_msgs/msg/JointState")
    message.name, message.position = ["cylinder_1"], np.array([0.1])
    assert intake.put(Stream.STROKES, stamp, message) is None
    assert intake.oddities == {"impossible stamp": 1}
