"""Reports to messages: numbers, signs, frames, stamps, rates."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from ros_messages import Output, ReportEncoder, decode_health, decoded, encoded, stamp_of

from boom_twin import Report, Settings, Stream, load_scene
from boom_twin.deviation.estimate_row import COORDINATES, RATES, WIDTH
from boom_twin.predictions import Prediction
from boom_twin.twin.blocks import estimate_of
from boom_twin.types import Alarm, Health, Ranked, Residuals

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
    evidence="k 29 % lower (27 to 31)",
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


def filled(report: Report) -> dict[Output, Any]:
    return {key: decoded(data, key) for key, data in encoder().fill(report)}


TIP = ["tip_dx", "tip_dz", "tip_pitch"]
SWIVELS = ["cylinder_1_swivel", *(f"{name}_{i}_swivel" for i in (2, 3) for name in ("cylinder", "link_l", "link_r"))]


def xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def test_a_prediction_is_told_in_the_axes_of_the_base() -> None:
    """Model x is x and model y is z; a turn that lifts a point ahead is one about -y."""
    found = filled(report())
    assert xyz(found[Output.TIP_DISPLACEMENT].vector) == (0.01, 0.0, -0.12)
    assert xyz(found[Output.TIP_POSITION].point) == (12.5, 0.0, 3.25)
    accel = found[Output.TIP_ACCELERATION].accel
    assert xyz(accel.linear) == (0.5, 0.0, -0.6) and xyz(accel.angular) == (0.0, -0.7, 0.0)
    np.testing.assert_allclose(np.cross(xyz(accel.angular), [1.0, 0.0, 0.0]), [0.0, 0.0, 0.7])
    joints = found[Output.JOINT_STATES]
    assert list(joints.name) == ["joint_1", "joint_2", "joint_3", "cylinder_1", "cylinder_2", "cylinder_3", *TIP, *SWIVELS]
    assert joints.position.tolist()[:6] == [1.0, -0.5, -0.25, 0.31, 0.22, 0.13]
    assert np.all(np.abs(joints.position[9:]) <= np.pi) and len(joints.velocity) == 0
    np.testing.assert_array_equal(joints.effort, [np.nan, np.nan, np.nan, -9e4, 8e3, 7e2, *[np.nan] * len([*TIP, *SWIVELS])])
    residuals = found[Output.RESIDUALS]
    assert (list(residuals.name), residuals.position.tolist()) == (["joint_1", "joint_2"], [2e-4, -3e-4])
    np.testing.assert_allclose(residuals.velocity, [2.0, -1.5])
    assert residuals.effort.tolist() == [1e-4, 2e-4]
    markers = found.pop(Output.SHAPE).markers
    headers = [*(msg.header for msg in found.values()), *(marker.header for marker in markers)]
    assert {header.frame_id for header in headers} == {"base_link"}
    assert stamp_of(found.pop(Output.RESIDUALS)) == STAMP - 1_000_000
    assert len(found) == 4 and {*map(stamp_of, found.values()), *map(stamp_of, markers)} == {STAMP}


def test_shape_and_passive_joints_come_with_a_line_only() -> None:
    """Both lengths in turn, from one encoder."""
    own, bare = encoder(), replace(report(), prediction=replace(prediction(), shape=None))
    found = [{key: decoded(data, key) for key, data in own.fill(each)} for each in (report(), bare, report())]
    assert [len(each[Output.JOINT_STATES].name) for each in found] == [16, 9, 16]
    assert [Output.SHAPE in each for each in found] == [True, False, True]
    alone = Report(stamp=STAMP, accepted=True, residuals=report().residuals)
    assert [key for key, _ in own.fill(alone)] == [Output.RESIDUALS]
    assert own.fill(Report(stamp=STAMP, accepted=False)) == []


def test_an_estimate_tells_velocity_and_modes_along_the_axes_of_the_base() -> None:
    row = 0.1 * np.arange(WIDTH)
    row[[COORDINATES + 5, RATES + 5]] = np.nan
    estimate = estimate_of(STAMP, row)
    told = filled(replace(report(), estimate=estimate))
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


def test_an_alarm_is_told_in_words_and_numbers() -> None:
    msg = filled(judged(ALARM))[Output.HEALTH]
    (status,) = msg.status
    assert (status.name, status.level, status.message) == ("joint_2", 2, ALARM.told)
    assert {pair.key: pair.value for pair in status.values} == {
        "kind": "softer",
        "cause": "cylinder_2.k",
        "from_s": "1699999998.123",
        "to_s": "nan",
        "evidence": "k 29 % lower (27 to 31)",
        "cylinder_2.k: probability": "0.97",
        "cylinder_2.k: softer": "0.41",
        "cylinder_2.k: sigma of softer": "0.02",
        "joint_2.sensor: probability": "0.03",
        "joint_2.sensor: bias_rad": "0.0031",
        "joint_2.sensor: sigma of bias_rad": "0.0001",
        "joint_2.sensor: drift_rad/s": "0",
        "joint_2.sensor: sigma of drift_rad/s": "1e-05",
    }


def test_levels_of_alarms_and_how_far_off_the_tip_may_be() -> None:
    unknown, ended = replace(ALARM, cause=None), replace(ALARM, until=STAMP)
    found = filled(judged(ALARM, unknown, ended))
    assert [status.level for status in found[Output.HEALTH].status] == [2, 1, 0]
    assert {pair.key: pair.value for pair in found[Output.HEALTH].status[2].values}["to_s"] == "1700000000.123"
    assert xyz(found[Output.TIP_UNCERTAINTY].vector) == (0.001, 0.0, 0.004)
    assert {stamp_of(found[key]) for key in (Output.HEALTH, Output.TIP_UNCERTAINTY)} == {STAMP - 100_000_000}
    assert not filled(judged())[Output.HEALTH].status


def test_alarms_come_back_from_their_message_to_the_millisecond() -> None:
    """Without the sizes of what may be wrong. A status that is no alarm is left out."""
    ended = Alarm("joint_3", "stuck", STAMP - 5, STAMP, "joint_3.sensor", "repeats one value")
    message = filled(judged(ALARM, ended))[Output.HEALTH]
    found = decode_health(message)
    for alarm, sent in zip(found, (ALARM, ended), strict=True):
        bare = tuple(replace(each, parts=()) for each in sent.ranked)
        assert abs(alarm.since - sent.since) < 10**6 and replace(alarm, since=0, until=0) == replace(
            sent, since=0, until=0, ranked=bare
        )
    assert found[0].until is None and abs(found[1].until - STAMP) < 10**6
    for text in ("nan", "1e400", "soon"):
        message.status[0].values[2].value = text
        assert decode_health(message) == found[1:]


def test_the_bytes_are_those_of_rosbags() -> None:
    """Encoded anew by it, a message is the same to the byte: lengths, padding, order, byte order."""
    own = encoder()
    for number in range(60):
        for key, data in own.fill(replace(judged(ALARM), prediction=prediction(STAMP + 100_000_000 * number))):
            assert encoded(decoded(data, key)) == data, key
