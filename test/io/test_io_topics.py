"""The table of topics."""

from __future__ import annotations

from pathlib import Path

import pytest

from boom_twin.errors import UsageError
from boom_twin.io.topics import DEFAULT_FILE, Output, load_topics
from boom_twin.records import Stream


def test_defaults_are_those_of_the_interface() -> None:
    topics = load_topics()
    assert {role: topic.name for role, topic in topics.inputs.items()} == {
        Stream.STROKES: "cylinder_strokes",
        Stream.ANGLES: "joint_angles",
        Stream.IMU: "tip_imu",
    }
    assert {role: topic.absolute for role, topic in topics.outputs.items()} == {
        Output.TIP_DISPLACEMENT: "/boom_twin/tip/displacement",
        Output.TIP_POSITION: "/boom_twin/tip/position",
        Output.TIP_ACCELERATION: "/boom_twin/tip/acceleration",
        Output.JOINT_STATES: "/boom_twin/joint_states",
        Output.RESIDUALS: "/boom_twin/residuals",
        Output.SHAPE: "/boom_twin/shape",
        Output.CHANGES: "/boom_twin/changes",
        Output.DIAGNOSTICS: "/diagnostics",
    }
    assert topics.inputs[Stream.IMU].absolute == "/tip_imu"
    assert [topic.required for topic in topics.inputs.values()] == [True, True, False]
    assert {topic.qos.reliability for topic in topics.inputs.values()} == {"best_effort"}
    assert load_topics() is topics


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("depth: 10}", "depth: 0}", "outputs.shape.qos.depth: Input should be greater than or equal to 1"),
        ("reliability: best_effort", "reliability: sometimes", "inputs.tip_imu.qos.reliability"),
        ("sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature", "only sensor_msgs/msg/Imu is read or filled there"),
        ("name: tip_imu", "name: joint_angles", "used by two topics"),
        ("name: tip_imu", "name: tip imu", "inputs.tip_imu.name"),
        ("  tip_imu:", "  tip_gyro:", "inputs.tip_gyro"),
        ("    required: false", "    requird: false", "inputs.tip_imu.requird: Extra inputs are not permitted"),
        ("inputs:", "inputs: [", "no readable YAML file"),
    ],
)
def test_what_cannot_be_used_is_refused_with_its_place(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = DEFAULT_FILE.read_text()
    assert old in text
    path = tmp_path / "topics.yaml"
    path.write_text(text.replace(old, new))
    with pytest.raises(UsageError) as caught:
        load_topics(path)
    assert words in str(caught.value) and str(path) in str(caught.value)


def test_a_missing_topic_is_named(tmp_path: Path) -> None:
    text = DEFAULT_FILE.read_text()
    path = tmp_path / "topics.yaml"
    path.write_text(text[: text.index("  # State of the node")])
    with pytest.raises(UsageError, match="diagnostics is missing"):
        load_topics(path)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"none\.yaml: no readable YAML file"):
        load_topics(tmp_path / "none.yaml")
