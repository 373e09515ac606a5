"""IMUs, strain gauges and points anywhere on the boom: expected readings, messages, places."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import strokes_of_angles, strokes_of_posture
from oracle import booms
from recordings import load_mapping
from ros_messages import SampleDecoder, new_message

from boom_twin import Sample, Settings, Stream, Twin, UsageError, load_scene, statics
from boom_twin.analysis.bending_stress import stations
from boom_twin.deviation.predictor import BoomPredictor
from boom_twin.deviation.states import PREDICTION, drive_place
from boom_twin.deviation.step import move_sites, place_live, write_ways
from boom_twin.scene.kinematics import gravity_in_base
from boom_twin.twin.blocks import CODES
from boom_twin.types import Array, Place, Residuals

SCENE = load_scene()
ARCH = strokes_of_posture(SCENE, "arch")
G = float(np.hypot(*gravity_in_base(SCENE)))
LAST = SCENE.sections[-1].length
STEP = 5_000_000  # ns


def moved(count: int) -> Array:
    times = 1e-9 * STEP * np.arange(count)
    return statics(SCENE, strokes=ARCH).lengths + 0.004 * np.sin(2.0 * np.outer(times, [1.0, 0.7, 1.3, 0.4]))


def residuals_of(twin: Twin, stream: Stream, readings: Array) -> list[Residuals]:
    """What a twin that moves makes of these readings of one stream."""
    found = []
    for k, (lengths, reading) in enumerate(zip(moved(len(readings)), readings, strict=True)):
        twin.update(Sample(Stream.STROKES, k * STEP, lengths))
        found += twin.update(Sample(stream, k * STEP, np.array(reading))).residuals
    return [each for each in found if each.stream is stream]


@pytest.mark.parametrize(("at", "turned"), [(0.0, 0.0), (1.3, 0.4), (3.0, -2.0)])
def test_rest_and_a_turn_about_one_joint_read_as_their_closed_form(at: float, turned: float) -> None:
    scene, angle, speed = booms.scene_of(booms.one_rigid()), math.radians(30.0), 0.4
    boom = BoomPredictor(scene, Settings(), places={"imu_2": Place(1, at, turned)})
    boom.start(strokes_of_angles(scene, np.array([angle])))
    p, f, gravity = boom.posture, boom.filters, gravity_in_base(scene)
    drive, channels = drive_place(p), [row for row in range(len(p.channels)) if p.channels[row].stream == CODES[Stream.IMU_2]]
    for rate in (0.0, speed):
        stroke_rate = rate / p.slope[0]
        f.mean[PREDICTION, drive + 1] = stroke_rate
        f.mean[PREDICTION, drive + 2] = -p.curvature[0] * stroke_rate**2 / p.slope[0]  # at which the joint turns evenly
        place_live(boom.plan.tables, boom.compiled.anchor, boom.live, boom.compiled.work, p, f)
        write_ways(boom.compiled.anchor, boom.live, boom.compiled.work, p, f)
        move_sites(boom.plan.tables, boom.compiled.anchor, boom.live, p, f, 0.0, gravity)
        along, across = G * math.sin(angle) - at * rate**2, G * math.cos(angle)
        c, s = math.cos(turned), math.sin(turned)
        assert f.felt[channels] == pytest.approx([c * along + s * across, c * across - s * along], abs=1e-6)
        assert f.motion[p.channels[channels[0]].site, 5] == pytest.approx(rate, rel=1e-7)


def test_an_acceleration_is_across_the_boom_where_it_is_not_where_it_rests() -> None:
    """Else a harmonic vibration would have a mean acceleration along the boom."""
    scene, at, turn, turning = booms.scene_of(booms.one_rigid()), 3.0, 0.05, 2.0
    boom = BoomPredictor(scene, Settings(), places={"imu_2": Place(1, at)})
    boom.start(strokes_of_angles(scene, np.array([0.5])))
    p, f, (tables, anchor, live, work, *_) = boom.posture, boom.filters, boom.compiled
    drive, (channel, _) = drive_place(p), np.flatnonzero(p.channels.stream == CODES[Stream.IMU_2])
    f.mean[PREDICTION, drive] += turn / p.slope[0]
    f.mean[PREDICTION, drive + 2] = turning / p.slope[0]
    place_live(tables, anchor, live, work, p, f)
    write_ways(anchor, live, work, p, f)
    move_sites(tables, anchor, live, p, f, 0.0, gravity_in_base(scene))
    angle = f.motion[p.channels[channel].site, 2]
    assert angle == pytest.approx(0.5 + turn, abs=1e-3)
    expected = [G * math.sin(angle), G * math.cos(angle) + at * turning]
    assert f.felt[channel : channel + 2] == pytest.approx(expected, abs=0.01)


def test_the_tip_is_one_place_among_others() -> None:
    readings = np.random.default_rng(0).normal([5.0, 8.0], 0.1, (60, 2))
    usual = residuals_of(Twin(SCENE), Stream.IMU, readings)
    for places, stream in (({"tip_imu": Place(4, LAST)}, Stream.IMU), ({"imu_2": Place()}, Stream.IMU_2)):
        for one, other in zip(usual, residuals_of(Twin(SCENE, places=places), stream, readings), strict=True):
            assert (one.values == other.values).all() and (one.sigmas == other.sigmas).all()


@pytest.mark.parametrize("at", [0.2, 2.0, 3.1])
def test_a_place_on_a_beam_is_where_statics_have_it(at: float) -> None:
    """Its angle at rest, by gravity, is continuous where parts meet, and lies between those of root and head."""
    angles = []
    for place in (at - 1e-7, at, at + 1e-7):
        (first, *_) = residuals_of(Twin(SCENE, places={"imu_2": Place(2, place)}), Stream.IMU_2, np.zeros((1, 2)))
        angles.append(math.atan2(-first.values[0], -first.values[1]))
        assert math.hypot(*first.values) == pytest.approx(G, rel=1e-9)
    assert angles == pytest.approx([angles[1]] * 3, abs=1e-6)


def test_a_mapping_places_them_and_their_messages_are_read(tmp_path: Path) -> None:
    path = tmp_path / "mapping.yaml"
    path.write_text(
        "inputs:\n  imu_2: {name: /mid/imu, place: {section: 2, at: 3.1, turned: 0.5}}\nsensors:\n  imu_2_rate: {unit: deg/s}\n"
    )
    topics = load_mapping(path, 4)
    assert topics.places == {"imu_2": Place(2, 3.1, 0.5)}
    assert topics.streams_by_topic["/mid/imu"] == [Stream.IMU_2, Stream.RATE_2]
    msg = new_message("sensor_msgs/msg/Imu")
    msg.header.stamp.sec = 5
    msg.linear_acceleration.x, msg.linear_acceleration.z, msg.angular_velocity.y = 1.0, 9.0, -2.0
    decoder = SampleDecoder(4, topics)
    force, rate = decoder.samples(topics.streams_by_topic["/mid/imu"], 5 * 10**9, msg)
    assert force.values.tolist() == [1.0, 9.0] and rate.values == pytest.approx([math.radians(2.0)])
    msg.angular_velocity_covariance[0] = -1.0
    assert [each.stream for each in decoder.samples(topics.streams_by_topic["/mid/imu"], 6 * 10**9, msg)] == [Stream.IMU_2]
    assert not decoder.oddities


@pytest.mark.parametrize(
    ("place", "told"), [(Place(5, 1.0), "sections 1 to 4"), (Place(2, 9.0), "section 2 reaches from 0 to")]
)
def test_a_place_off_the_boom_is_told(place: Place, told: str) -> None:
    with pytest.raises(UsageError, match=told):
        Twin(SCENE, places={"imu_2": place})


def test_a_sensor_without_a_place_is_told() -> None:
    with pytest.raises(UsageError, match="imu_3: this boom has no such sensor"):
        Twin(SCENE).update(Sample(Stream.IMU_3, 0, np.zeros(2)))


REST = statics(SCENE, strokes=strokes_of_posture(SCENE, "arch"))


def test_a_gauge_reads_the_predicted_moment_and_a_point_at_the_tip_its_position() -> None:
    where = stations(SCENE)
    middle = next(k for k, station in enumerate(where) if station.section == 1 and 0.5 < station.place < 2.9)
    twin = Twin(SCENE, places={"moment_2": Place(2, where[middle].place), "points": Place()})
    for k in range(100):
        lengths = REST.lengths + 0.003 * np.sin(0.01 * k * np.arange(1, 5))
        prediction = twin.update(Sample(Stream.STROKES, 5_000_000 * k, lengths)).prediction
        assert prediction is not None and prediction.moments is not None
        gauge = np.array([np.nan, 1000.0, np.nan, np.nan])
        (moment,) = twin.update(Sample(Stream.MOMENTS, 5_000_000 * k, gauge)).residuals
        assert moment.values[1] == pytest.approx(1000.0 - prediction.moments[middle], rel=1e-9)
        assert np.isnan(moment.values[[0, 2, 3]]).all()
        (point,) = twin.update(Sample(Stream.POINT, 5_000_000 * k, np.array([1.0, 2.0]))).residuals
        assert (point.values == np.array([1.0, 2.0]) - prediction.tip_position).all()
    assert not twin.counts["partial"], "channels without a gauge are not missed"


def test_a_point_seen_once_a_second_keeps_the_estimate_and_makes_it_surer() -> None:
    variances = []
    for point in (False, True):
        twin = Twin(SCENE, Settings(point_sigma=1e-4), places={"points": Place()})
        for k in range(2000):
            report = twin.update(Sample(Stream.STROKES, 5_000_000 * k, REST.lengths))
            if point and k % 200 == 0:
                twin.update(Sample(Stream.POINT, 5_000_000 * k, REST.tip))
        assert report.estimate is not None
        variances.append(report.estimate.tip_covariance[[0, 3]])
    assert variances[1].sum() < variances[0].sum(), "also 1 s after the newest reading"


def test_messages_are_read_by_the_mapping(tmp_path: Path) -> None:
    path = tmp_path / "mapping.yaml"
    path.write_text(
        "inputs:\n  points: {name: /station/prism, place: {section: 4, at: 3.1}}\n"
        "sensors:\n  moment_2: {name: gauge_b, unit: kN m, place: {at: 1.5}}\n"
    )
    topics = load_mapping(path, 4)
    assert topics.places == {"points": Place(4, 3.1), "moment_2": Place(None, 1.5)}
    decoder = SampleDecoder(4, topics)
    point, gauge = new_message("geometry_msgs/msg/PointStamped"), new_message("sensor_msgs/msg/JointState")
    point.header.stamp.sec = gauge.header.stamp.sec = 5
    point.point.x, point.point.z, gauge.name, gauge.effort = 7.0, 2.0, ["gauge_b", "moment_1"], np.array([-3.0, 1.0])
    (found,) = decoder.samples(topics.streams_by_topic["/station/prism"], 5 * 10**9, point)
    assert (found.stream, found.values.tolist()) == (Stream.POINT, [7.0, 2.0])
    (found,) = decoder.samples(topics.streams_by_topic["section_moments"], 5 * 10**9, gauge)
    assert found.stream is Stream.MOMENTS and found.values[1] == -3000.0 and np.isnan(found.values[[0, 2, 3]]).all()
    assert not decoder.oddities


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("sensors: {joint_1: {place: {at: 1.0}}}", "only a moment_i has a place"),
        ("sensors: {moment_1: {place: {att: 1.0}}}", "nearest known key here is `at`"),
        ("inputs: {points: {name: other}}", "inputs.points.place"),
        ("inputs: {imu_2: {place: {section: 0}}}", "inputs.imu_2.place.section"),
        ("inputs: {joint_angles: {place: {section: 1}}}", "only IMUs and points have it"),
        ("inputs: {imu_5: {name: other}}", "nearest is `imu_"),
    ],
)
def test_a_wrong_place_is_told(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "mapping.yaml"
    path.write_text(text)
    with pytest.raises(UsageError, match=told):
        load_mapping(path, 4)


def test_a_gauge_on_a_rigid_part_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UsageError, match=r"section 2 is rigid at 0\.1 m"):
        Twin(SCENE, places={"moment_2": Place(2, 0.1)})
    assert main(["check", "--sensors", "angles,moment@2:0.1"]) == 1
    assert "section 2 bends from 0.25 to 3.05 m" in capsys.readouterr().err
