"""Strain gauges and measured points: what they are expected to read, and how their messages and places are given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import strokes_of_posture
from recordings import load_mapping
from ros_messages import SampleDecoder, new_message

from boom_twin import Sample, Settings, Stream, Twin, UsageError, load_scene, statics
from boom_twin.analysis.bending_moments import stations
from boom_twin.types import Place

SCENE = load_scene()
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
    (found,) = decoder.samples(topics.heard["/station/prism"], 5 * 10**9, point)
    assert (found.stream, found.values.tolist()) == (Stream.POINT, [7.0, 2.0])
    (found,) = decoder.samples(topics.heard["section_moments"], 5 * 10**9, gauge)
    assert found.stream is Stream.MOMENTS and found.values[1] == -3000.0 and np.isnan(found.values[[0, 2, 3]]).all()
    assert not decoder.oddities


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("sensors: {joint_1: {place: {at: 1.0}}}", "only a moment_i has a place"),
        ("sensors: {moment_1: {place: {att: 1.0}}}", "nearest known key here is `at`"),
        ("inputs: {points: {name: other}}", "inputs.points.place"),
        ("inputs: {imu_2: {place: {section: 0}}}", "inputs.imu_2.place.section"),
        ("inputs: {joint_angles: {place: {section: 1}}}", "only IMUs and points have a place"),
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
