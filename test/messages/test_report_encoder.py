"""Reports to messages: numbers, signs, frames, stamps, rates."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from boom_twin.config.settings import Settings
from boom_twin.deviation.estimate_row import COORDINATES, RATES, WIDTH
from boom_twin.messages.report_encoder import ReportEncoder
from boom_twin.messages.sample_decoder import stamp_of
from boom_twin.messages.topic_table import TYPES, Output
from boom_twin.messages.type_store import jazzy, new_message
from boom_twin.scene import load_scene
from boom_twin.twin.blocks import estimate_of
from boom_twin.types import Alarm, Health, Prediction, Ranked, Report, Residuals, Stream

STAMP = 1_700_000_000_123_456_789


def prediction(stamp: int = STAMP) -> Prediction:
    return Prediction(
        stamp=stamp,
        tip_position=np.array([12.5, 3.25]),
        tip_displacement=np.array([0.01, -0.12]),
        tip_velocity=np.array([0.3, 0.4]),
        tip_acceleration=np.array([0.5, -0.6]),
        tip_angle=0.1,
        tip_angular_velocity=0.2,
        tip_angular_acceleration=0.7,
        joints=np.array([1.0, -0.5, -0.25]),
        strokes=np.array([0.31, 0.22, 0.13]),
        cylinder_forces=np.array([-9e4, 8e3, 7e2]),
        shape=np.array([[0.0, 0.0], [4.0, 1.0], [12.5, 3.25]]),
        undeflected=np.array([[0.0, 0.0], [4.0, 1.0], [12.49, 3.37]]),
        pins=np.array([[0.5, -1.25, 0.6, -0.1], [3.0, 1.1, 4.0, 1.2], [6.0, 2.0, 7.0, 2.5]]),
    )


def report(stamp: int = STAMP) -> Report:
    residuals = Residuals(
        stream=Stream.ANGLES,
        stamp=stamp - 1_000_000,
        names=("joint_1", "joint_2"),
        values=np.array([2e-4, -3e-4]),
        sigmas=np.array([1e-4, 2e-4]),
    )
    return Report(stamp=stamp, accepted=True, prediction=prediction(stamp), residuals=(residuals,))


ALARM = Alarm(
    channel="joint_2",
    kind="softer",
    since=STAMP - 2_000_000_000,
    until=None,
    cause="cylinder_2.k",
    told="cylinder_2.k is 29 % softer",
    ranked=(
        Ranked("cylinder_2.k", 0.97, (("softer", 0.41, 0.02, ""),)),
        Ranked("joint_2.sensor", 0.03, (("bias", 0.0031, 0.0001, "rad"), ("drift", 0.0, 1e-5, "rad/s"))),
    ),
)


def judged(*alarms: Alarm) -> Report:
    """With news of the rig's health, which are of another stamp."""
    health = Health(STAMP - 100_000_000, alarms, np.array([0.001, 0.004]))
    return replace(report(), health=health)


def encoder() -> ReportEncoder:
    """One for the first three sections of the default boom."""
    scene = load_scene()
    three = scene.model_copy(update={"sections": scene.sections[:3], "joints": scene.joints[:3], "postures": {}})
    return ReportEncoder(three, Settings())


def decoded(messages: list[tuple[Output, bytes]]) -> dict[Output, Any]:
    return {key: jazzy().deserialize_cdr(data, TYPES[key]) for key, data in messages}


@pytest.fixture(scope="module")
def filled() -> dict[Output, Any]:
    return decoded(encoder().fill(report()))


def test_displacement(filled: dict[Output, Any]) -> None:
    vector = filled[Output.TIP_DISPLACEMENT].vector
    assert (vector.x, vector.y, vector.z) == (0.01, 0.0, -0.12)


def test_position(filled: dict[Output, Any]) -> None:
    point = filled[Output.TIP_POSITION].point
    assert (point.x, point.y, point.z) == (12.5, 0.0, 3.25)


def test_acceleration_turns_about_minus_y(filled: dict[Output, Any]) -> None:
    accel = filled[Output.TIP_ACCELERATION].accel
    assert (accel.linear.x, accel.linear.y, accel.linear.z) == (0.5, 0.0, -0.6)
    assert (accel.angular.x, accel.angular.y, accel.angular.z) == (0.0, -0.7, 0.0)


def test_angular_sign_fits_the_axes() -> None:
    """A turn that speeds up anticlockwise in the model lifts a point ahead: omega' x r must point up in base_link."""
    accel = decoded(encoder().fill(report()))[Output.TIP_ACCELERATION].accel
    lift = np.cross([accel.angular.x, accel.angular.y, accel.angular.z], [1.0, 0.0, 0.0])
    np.testing.assert_allclose(lift, [0.0, 0.0, 0.7])


TIP = ["tip_dx", "tip_dz", "tip_pitch"]
SWIVELS = ["cylinder_1_swivel", *(f"{name}_{i}_swivel" for i in (2, 3) for name in ("cylinder", "link_l", "link_r"))]


def test_joint_states(filled: dict[Output, Any]) -> None:
    msg = filled[Output.JOINT_STATES]
    assert list(msg.name) == ["joint_1", "joint_2", "joint_3", "cylinder_1", "cylinder_2", "cylinder_3", *TIP, *SWIVELS]
    assert msg.position.tolist()[:6] == [1.0, -0.5, -0.25, 0.31, 0.22, 0.13]
    assert np.all(np.abs(msg.position[9:]) <= np.pi)
    assert len(msg.velocity) == 0
    np.testing.assert_array_equal(msg.effort, [np.nan, np.nan, np.nan, -9e4, 8e3, 7e2, *[np.nan] * len([*TIP, *SWIVELS])])


def test_passive_joints_come_with_a_shape_only() -> None:
    """Both lengths in turn, from one outlet."""
    own, bare = encoder(), replace(report(), prediction=replace(prediction(), shape=None))
    counts = [len(decoded(own.fill(each))[Output.JOINT_STATES].name) for each in (report(), bare, report())]
    assert counts == [16, 9, 16]


def test_an_estimate_tells_velocity_and_modes_along_the_axes_of_the_base() -> None:
    row = 0.1 * np.arange(WIDTH)
    row[[COORDINATES + 5, RATES + 5]] = np.nan
    estimate = estimate_of(STAMP, row)
    told = decoded(encoder().fill(replace(report(), estimate=estimate)))
    twist, modes = told[Output.ESTIMATE_TWIST].twist, told[Output.ESTIMATE_MODES]
    (x, y, a), (xx, xy, xa, yy, ya, aa) = estimate.velocity, estimate.velocity_covariance
    linear, angular = twist.twist.linear, twist.twist.angular
    assert (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z) == (x, 0.0, y, 0.0, -a, 0.0)
    covariance = twist.covariance.reshape(6, 6)
    assert covariance[np.ix_([0, 2, 4], [0, 2, 4])].tolist() == [[xx, xy, -xa], [xy, yy, -ya], [-xa, -ya, aa]]
    assert np.count_nonzero(covariance) == 9
    assert list(modes.name) == [f"mode_{j}" for j in range(1, 7)] and len(modes.effort) == 0
    np.testing.assert_array_equal([modes.position, modes.velocity], [estimate.modes, estimate.mode_rates])
    assert np.isnan(modes.position).tolist() == [False] * 5 + [True]
    assert {stamp_of(told[key]) for key in (Output.ESTIMATE_TWIST, Output.ESTIMATE_MODES)} == {STAMP}


def test_residuals_are_named(filled: dict[Output, Any]) -> None:
    msg = filled[Output.RESIDUALS]
    assert list(msg.name) == ["joint_1", "joint_2"]
    assert msg.position.tolist() == [2e-4, -3e-4]
    np.testing.assert_allclose(msg.velocity, [2.0, -1.5])
    assert msg.effort.tolist() == [1e-4, 2e-4]


def test_an_alarm_is_told_in_words_and_numbers() -> None:
    msg = decoded(encoder().fill(judged(ALARM)))[Output.HEALTH]
    (status,) = msg.status
    assert (status.name, status.level, status.message) == ("joint_2", 2, "cylinder_2.k is 29 % softer")
    assert {pair.key: pair.value for pair in status.values} == {
        "kind": "softer",
        "cause": "cylinder_2.k",
        "from_s": "1699999998.123",
        "to_s": "nan",
        "cylinder_2.k: probability": "0.97",
        "cylinder_2.k: softer": "0.41",
        "cylinder_2.k: sigma of softer": "0.02",
        "joint_2.sensor: probability": "0.03",
        "joint_2.sensor: bias_rad": "0.0031",
        "joint_2.sensor: sigma of bias_rad": "0.0001",
        "joint_2.sensor: drift_rad/s": "0",
        "joint_2.sensor: sigma of drift_rad/s": "1e-05",
    }


def test_levels_of_alarms() -> None:
    unknown, ended = replace(ALARM, cause=None), replace(ALARM, until=STAMP)
    msg = decoded(encoder().fill(judged(ALARM, unknown, ended)))[Output.HEALTH]
    assert [status.level for status in msg.status] == [2, 1, 0]
    assert {pair.key: pair.value for pair in msg.status[2].values}["to_s"] == "1700000000.123"


def test_how_far_off_the_tip_may_be() -> None:
    found = decoded(encoder().fill(judged()))
    vector = found[Output.TIP_UNCERTAINTY].vector
    assert (vector.x, vector.y, vector.z) == (0.001, 0.0, 0.004)
    assert {stamp_of(found[key]) for key in (Output.HEALTH, Output.TIP_UNCERTAINTY)} == {STAMP - 100_000_000}
    assert not found[Output.HEALTH].status


def test_every_message_has_the_stamp_of_its_cause(filled: dict[Output, Any]) -> None:
    markers = filled[Output.SHAPE].markers
    stamps = {key: stamp_of(msg) for key, msg in filled.items() if key is not Output.SHAPE}
    assert stamps.pop(Output.RESIDUALS) == STAMP - 1_000_000
    assert len(stamps) == 4 and {*stamps.values(), *map(stamp_of, markers)} == {STAMP}
    headers = [msg.header for key, msg in filled.items() if key is not Output.SHAPE]
    assert {header.frame_id for header in [*headers, *(marker.header for marker in markers)]} == {"base_link"}


def test_without_prediction_only_residuals() -> None:
    bare = Report(stamp=STAMP, accepted=True, residuals=report().residuals)
    assert [key for key, _ in encoder().fill(bare)] == [Output.RESIDUALS]
    assert encoder().fill(Report(stamp=STAMP, accepted=False)) == []


def test_no_shape_without_a_line() -> None:
    bare = replace(report(), prediction=replace(report().prediction, shape=None))
    assert Output.SHAPE not in dict(encoder().fill(bare))


@pytest.mark.parametrize("type_name", sorted(set(TYPES.values())))
def test_factory_makes_what_can_be_encoded(type_name: str) -> None:
    store = jazzy()
    data = bytes(store.serialize_cdr(new_message(type_name), type_name))
    assert bytes(store.serialize_cdr(store.deserialize_cdr(data, type_name), type_name)) == data
    assert not any(data[4:].replace(b"\x01\x00\x00\x00\x00", b""))


def test_factory_makes_a_new_message_each_time() -> None:
    one, other = new_message("sensor_msgs/msg/Imu"), new_message("sensor_msgs/msg/Imu")
    one.header.stamp.sec, one.orientation_covariance[0] = 5, -1.0
    assert (other.header.stamp.sec, other.orientation_covariance[0]) == (0, 0.0)


def test_the_bytes_are_those_of_rosbags() -> None:
    """Encoded anew by it, a message is the same to the byte: lengths, padding, order, byte order."""
    own = encoder()
    for number in range(60):
        for key, data in own.fill(replace(judged(ALARM), prediction=prediction(STAMP + 100_000_000 * number))):
            msg = jazzy().deserialize_cdr(data, TYPES[key])
            assert bytes(jazzy().serialize_cdr(msg, TYPES[key])) == data, key


def test_rclpy_reads_the_same_numbers() -> None:
    serialization = pytest.importorskip("rclpy.serialization")
    types = pytest.importorskip("boom_twin.ros.runtime")
    for key, data in encoder().fill(judged(ALARM)):
        assert_same(
            jazzy().deserialize_cdr(data, TYPES[key]),
            serialization.deserialize_message(data, types.message_class(TYPES[key])),
            key.value,
        )


def assert_same(one: Any, other: Any, place: str) -> None:
    """Field by field, with rosbags' message as the guide."""
    if hasattr(one, "__dataclass_fields__"):
        for name in one.__dataclass_fields__.keys() - {"__msgtype__"}:
            assert_same(getattr(one, name), getattr(other, name), f"{place}.{name}")
    elif isinstance(one, np.ndarray):
        np.testing.assert_array_equal(one, np.asarray(other), err_msg=place)
    elif isinstance(one, list):
        assert len(one) == len(other), place
        for left, right in zip(one, other, strict=True):
            assert_same(left, right, place)
    else:
        assert one == (other[0] if isinstance(other, bytes) else other), place  # rclpy has a byte as bytes


def test_only_what_is_wanted_is_encoded_and_as_ever() -> None:
    given = replace(judged(ALARM), prediction=prediction(STAMP), residuals=report().residuals)
    everything = dict(encoder().fill(given))
    for wanted in everything:
        assert encoder().fill(given, wanted.__eq__) == [(wanted, everything[wanted])]
    assert encoder().fill(given, lambda output: False) == []
