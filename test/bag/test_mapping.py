"""Mappings: what they leave out, what they may not say, and which one a session is read with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import SESSION_YAML as FILE_NAME
from recordings import SessionMetadata, load_mapping, mapping_of
from ros_messages import load_topics

from boom_twin import BagError, Stream, UsageError
from boom_twin.bag.metadata import dump
from boom_twin.bag.session_model import RIG_ORIGIN, strokes_of
from boom_twin.messages.topic_table import DEFAULT_FILE
from boom_twin.types import StrokeReading

EXAMPLE = """
inputs:
  cylinder_strokes: {name: /rig/joint_states, qos: {reliability: reliable}}
  joint_angles: {name: /rig/joint_states, qos: {reliability: reliable}}
sensors:
  cylinder_1: {name: boom_cyl_a, unit: mm, zero: 12.5}
  joint_1: {name: slew_pitch, sign: -1, unit: deg}
  joint_2: {name: incl_2, unit: deg, absolute: root}
"""


@pytest.fixture
def write(tmp_path: Path) -> Any:
    def write(text: str) -> Path:
        path = tmp_path / "mapping.yaml"
        path.write_text(text)
        return path

    return write


def test_what_is_left_out_is_as_usual(write: Any) -> None:
    topics, usual = load_mapping(write(EXAMPLE), 3), load_topics()
    shared = [Stream.STROKES, Stream.ANGLES]
    assert topics.streams_by_topic == {
        "/rig/joint_states": shared,
        "tip_imu": [Stream.IMU, Stream.RATE],
        "cylinder_forces": [Stream.FORCES],
    }
    assert topics.is_shared and topics.outputs == usual.outputs
    assert topics.inputs[Stream.STROKES].qos.depth == usual.inputs[Stream.STROKES].qos.depth
    assert [sensor.name for sensor in topics.sensors_of(Stream.ANGLES, 3).values()] == ["slew_pitch", "incl_2", "joint_3"]
    assert topics.mounts(3) == [None, "root", None]
    for nothing in ("", "sensors: {}", "inputs:\n  tip_imu: {}", DEFAULT_FILE.read_text()):
        assert load_mapping(write(nothing), 4) == usual
    lines = DEFAULT_FILE.read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("#   inputs:"))
    example = "\n".join(line[4:] for line in lines[first:][: lines[first:].index("#")])
    assert load_mapping(write(example), 4).mounts(4) == [None, "root", None, None]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("outputs: {shape: {qos: {depth: 0}}}", "outputs.shape.qos.depth = 0: it must be greater than or equal to 1."),
        ("inputs: {tip_imu: {qos: {reliability: sometimes}}}", "inputs.tip_imu.qos.reliability = 'sometimes'"),
        ("inputs: {tip_imu: {type: a/msg/B}}", "inputs.tip_imu.type = 'a/msg/B': only sensor_msgs/msg/Imu is read or"),
        ("inputs: {tip_imu: {name: joint_angles}}", "inputs.tip_imu.name = 'joint_angles': inputs.joint_angles has this"),
        ("inputs: {tip_imu: {name: tip imu}}", "inputs.tip_imu.name = 'tip imu'"),
        ("inputs: {tip_imu: {delay: 20.0}}", "inputs.tip_imu.delay = 20.0: it must be less than or equal to 10."),
        ("inputs: {tip_imu: {dely: 0.1}}", "inputs.tip_imu.dely = 0.1: unknown key. The nearest known key here is `delay`."),
        ("inputs: {cylinder_strokes: {delay: 0.1}}", "inputs.cylinder_strokes.delay = 0.1: every output has the stamp of a"),
        ("frame: /base_link", "frame = '/base_link'"),
        ("inputs: {tip_gyro: {}}", "inputs.tip_gyro = {}: unknown topic. The nearest is `tip_imu`."),
        ("sensor: {}", "sensor = {}: unknown key. The nearest known key here is `sensors`."),
        (EXAMPLE.replace("qos: {reliability: reliable}", "qos: {}", 1), "inputs.joint_angles.qos = {'reliability'"),
        ("sensors: {joint_1: {sign: 0}}", "sensors.joint_1.sign = 0: it must be 1 or -1. Give 1, or -1 for a sensor"),
        ("sensors: {joint_1: {scale: 0.0}}", "sensors.joint_1.scale = 0.0: it must be greater than 0."),
        ("sensors: {joint_1: {zero: .nan}}", "sensors.joint_1.zero = nan: it must be a finite number."),
        ("sensors: {joint_1: {unit: mm}}", "sensors.joint_1.unit = 'mm': it must be one of rad, mrad, deg, gon."),
        ("sensors: {joint_1: {absolut: root}}", "sensors.joint_1.absolut = 'root': unknown key. The nearest known key here"),
        ("sensors: {joint_1: {absolute: tip}}", "sensors.joint_1.absolute = 'tip': it must be 'root', 'head', 'root_comp"),
        ("sensors: {cylinder_1: {absolute: root}}", "only an angle (joint_i) can be absolute"),
        ("sensors: {elbow: {}}", "sensors.elbow = {}: channels are cylinder_1"),
        ("sensors: {joint_0: {}}", "sensors.joint_0 = {}: channels are cylinder_1"),
        ("sensors: {joint_5: {}}", "sensors.joint_5 = 'joint_5': the scene has 4 joints, so channels end at joint_4."),
        ("sensors: {joint_2: {name: joint_1}}", "sensors.joint_2.name = 'joint_1': joint_1 has this name too"),
        (EXAMPLE.replace("incl_2", "cylinder_3"), "sensors.joint_2.name = 'cylinder_3'"),
        ("sensors: {tip_imu_x: {name: z}}", "sensors.tip_imu_z.name = 'z': tip_imu_x has this name too"),
        ("sensors: {tip_imu_x: {name: up}}", "sensors.tip_imu_x.name = 'up': it must be x, y or z."),
        ("sensors: {cylinder_1: none}", "sensors.cylinder_1 = 'none': every cylinder's stroke drives the model"),
        ("sensors: [1]", "sensors = [1]: a block of channels is needed"),
        ("[1, 2]", "keys inputs, outputs, sensors are needed"),
        ("inputs: [", "not a readable YAML file"),
        ("inputs: {}\ninputs: {}", "inputs = {}: the key is there twice"),
        ("inputs: {cylinder_strokes: {reads: chord}}", "strokes.reads = 'chord': it must be 'length' or 'drive'"),
        ("inputs: {cylinder_strokes: {delay: auto}}", "strokes.delay = 'auto': every output has the stamp of a stroke sample"),
        ("inputs: {cylinder_strokes: {delay: auto}}", "Give the others auto"),
        ("inputs: {cylinder_strokes: {delay: often}}", "or auto"),
        ("inputs: {cylinder_pressures: {delay: auto}}", "auto is not for forces"),
        ("inputs: {joint_angles: {frame_id: boom}}", "only IMUs and points have it"),
        ("inputs: {tip_imu: {bore: [0.1]}}", "only cylinder_pressures has it"),
        ("sensors: {cylinder_5_cap: {unit: bar}}", "the scene has 4 joints"),
        ("inputs: {joint_angles: {reads: length}}", "inputs.joint_angles.reads = 'length': only cylinder_strokes has it"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused_with_its_place(write: Any, text: str, words: str) -> None:
    path = write(text)
    with pytest.raises(UsageError) as caught:
        load_mapping(path, 4)
    assert words in str(caught.value) and str(path) in str(caught.value)


def test_a_sensor_that_is_not_there_is_said_to_be_none(write: Any) -> None:
    topics = load_mapping(write("sensors: {joint_3: none, tip_imu_z: none, joint_1: {sign: -1}}"), 4)
    assert topics.absent == {"joint_3", "tip_imu_z"} and set(topics.sensors) == {"joint_1"}


def test_all_faults_are_told_at_once(write: Any) -> None:
    text = """
inputs: {tip_imu: {type: x, nam: y}}
outputs: {shape: {qos: {depth: 0}}}
sensors:
  cylinder_1: {sign: 0, scale: 0, unit: furlong}
  joint_9: {}
  elbow: {}
"""
    with pytest.raises(UsageError, match="8 faults") as caught:
        load_mapping(write(text), 4)
    assert len(str(caught.value).splitlines()) == 9
    with pytest.raises(UsageError, match=r"none\.yaml: No such file"):
        load_mapping(write("").with_name("none.yaml"))


KEYS = ["inputs", "outputs", "sensors", "joint_1", "cylinder_2", "tip_imu", "shape", "qos", "name", "sign", "unit"]
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-5, 5) | st.floats() | st.sampled_from(["x", "root", "joint_1", "mm", "~/a"]),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.sampled_from(KEYS), inner, max_size=4),
    max_leaves=12,
)


@settings(deadline=None, max_examples=200)
@given(document=st.dictionaries(st.sampled_from(["inputs", "outputs", "sensors", "x"]), VALUES, max_size=3))
def test_whatever_stands_in_a_mapping_is_used_or_refused(document: dict[str, Any], tmp_path_factory: Any) -> None:
    path = tmp_path_factory.getbasetemp() / "any.yaml"
    path.write_text(dump(document))
    try:
        load_mapping(path, 4)
    except UsageError as error:
        assert "fault" in str(error)


def recorded(directory: Path, mapping: str) -> Path:
    directory.mkdir(exist_ok=True)
    SessionMetadata("1", "scene", "parameters", mapping, {}).write(directory)
    return directory


RIG = f"origin: {RIG_ORIGIN}\n"


@pytest.mark.parametrize(
    ("sheet", "reading"),
    [
        (None, "length"),
        ("boom_twin: 0.1.0\norigin: a rig in Graz\n", "length"),
        (f"boom_twin: 0.1.0\n{RIG}", "drive"),
        (f"boom_twin: 0.1.7.dev3\n{RIG}", "drive"),
        (f"boom_twin: 0.1.0\n{RIG}strokes: length\n", "length"),
        (f"boom_twin: 0.2.0\n{RIG}", "length"),
        (f"boom_twin: 0.10.0\n{RIG}", "length"),
        (f"boom_twin: newest\n{RIG}", "length"),
        ("strokes: drive\n", "drive"),
    ],
)
def test_a_session_says_what_its_transducers_read(tmp_path: Path, write: Any, sheet: str | None, reading: str) -> None:
    if sheet is not None:
        (tmp_path / FILE_NAME).write_text(sheet)
    found = strokes_of(tmp_path, mapping_of(tmp_path))
    assert found.reading == StrokeReading(reading) and found.source
    for other in (StrokeReading.LENGTH, StrokeReading.DRIVE):
        given = mapping_of(tmp_path, write(f"inputs: {{cylinder_strokes: {{reads: {other}}}}}"))
        assert strokes_of(tmp_path, given).reading is other
        assert strokes_of(None, given).reading is other and "cylinder_strokes.reads" in strokes_of(None, given).source
    assert strokes_of(None, mapping_of(tmp_path)).reading is StrokeReading.LENGTH


@pytest.mark.parametrize("mapping", ["sensors: {joint_1: {sign: 2}}", "sensors: ["])
def test_a_recorded_mapping_that_cannot_be_used_is_told(tmp_path: Path, mapping: str) -> None:
    bag = recorded(tmp_path / "bag", mapping)
    with pytest.raises((BagError, UsageError), match=FILE_NAME):
        mapping_of(bag)
