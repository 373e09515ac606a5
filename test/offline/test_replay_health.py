"""Alarms of the rig's health in what a replay leaves behind."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import joint_angles_of_strokes, strokes_of_posture
from recordings import read, scan, write_session
from ros_messages import Output, load_topics

from boom_twin import load_scene, replay
from boom_twin.offline.recording import alarm_as_text

START, STEP = 1_700_000_000_000_000_000, 5_000_000


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """The reading of joint 3 repeats from 3 s on; otherwise a boom at rest, whose deflection the angles lack."""
    scene, random = load_scene(), np.random.default_rng(4)
    strokes = np.tile(strokes_of_posture(scene, "arch"), (1200, 1))
    joints = np.tile(joint_angles_of_strokes(scene, strokes[0]), (1200, 1)) + random.normal(0.0, 1.7e-4, strokes.shape)
    joints[600:, 2] = joints[600, 2]
    path = tmp_path_factory.mktemp("session") / "bag"
    stamps = START + STEP * np.arange(1200)
    strokes = strokes + random.normal(0.0, 2e-5, strokes.shape)
    write_session(path, stamps, strokes, joints, None, {"origin": "synthetic, a test"})
    return path


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("out")


@pytest.fixture(scope="module")
def result(session, out):
    return replay(session, load_scene(), out)


def test_a_stuck_sensor_is_in_the_summary(result):
    alarms = result.summary["alarms"]
    assert [alarm["from_s"] for alarm in alarms] == sorted(alarm["from_s"] for alarm in alarms)
    stuck = next(alarm for alarm in alarms if alarm["channel"] == "joint_3" and alarm["kind"] == "stuck")
    assert stuck.keys() == {"channel", "kind", "from_s", "to_s", "cause", "told", "evidence", "ranked"}
    assert stuck["cause"] == "joint_3.sensor" and stuck["to_s"] is None and 2.9 < stuck["from_s"] < 4.0
    assert alarm_as_text(stuck) == f"joint_3, {stuck['from_s']:.2f} s to the end: {stuck['told']}"


def test_the_result_bag_tells_of_the_alarm_and_is_the_same_each_time(result, out, tmp_path):
    folder = result.session.path
    again = replay(folder, load_scene(), tmp_path)
    assert again.summary["output_sha256"] == result.summary["output_sha256"]
    files = [next((place / "bag").glob("*.mcap")).read_bytes() for place in (out, tmp_path)]
    assert files[0] == files[1] and len(files[0]) > 1e5
    topics = load_topics().outputs
    wanted = {topics[key].absolute: topics[key].type for key in (Output.HEALTH, Output.TIP_UNCERTAINTY)}
    found = list(read(scan(tmp_path / "bag"), wanted))
    told = [message for name, _, message in found if name == topics[Output.HEALTH].absolute]
    assert len(told) == len(result.recording.whole.health) == len(found) - len(told)
    assert "joint_3" in {status.name for status in told[-1].status}
