"""Bytes of the rig's messages against full decoding, the table of topics, and pressures that become forces."""

from __future__ import annotations

from math import hypot, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recordings import load_mapping
from ros_messages import TYPES, SampleDecoder, Topics, decode, encoded, joint_state, load_topics, new_message, stamp_of

from boom_twin import Scene, Settings, Stream, UsageError, load_scene
from boom_twin.messages.cdr_decoder import CdrDecoder
from boom_twin.types import SENSORS


class Wire:
    """Decoder that counts the messages that it decodes whole."""

    def __init__(self, stream: Stream) -> None:
        self.stream, self.whole = stream, 0
        self.decoder = CdrDecoder(TYPES[stream], self._decode, SENSORS[stream].field)

    def _decode(self, data: bytes, type_name: str) -> Any:
        self.whole += 1
        return decode(data, type_name)

    def check(self, data: bytes) -> Any:
        """Compare what an intake makes of a message, with and without decoding all of it."""
        decoded = decode(data, TYPES[self.stream])
        stamp, msg = self.decoder.read(data)
        assert stamp == stamp_of(decoded)
        mine, theirs = SampleDecoder(4), SampleDecoder(4)
        ours, other = mine.sample_of(self.stream, stamp, msg), theirs.sample_of(self.stream, stamp, decoded)
        assert mine.oddities == theirs.oddities
        assert (ours and ours.values.tobytes()) == (other and other.values.tobytes())
        return msg


def test_a_message_that_is_not_whole_is_refused_and_the_next_one_read() -> None:
    """Lengths behind the numbers count too: else a recording is taken that can never be replayed."""
    wire = Wire(Stream.STROKES)
    data = encoded(joint_state(["cylinder_1", "cylinder_2"], [1.0, 2.0], 7))
    wire.check(data)
    velocity = len(data) - 8
    long = [data[:place] + b"\xff\xff\xff\x7f" + data[place + 4 :] for place in (velocity, velocity + 4)]
    for broken in (*(data[:cut] for cut in (0, 3, 8, 11, 20, 40, 60)), *long):
        with pytest.raises(Exception):  # noqa: B017 - whatever the decoder raises
            wire.decoder.read(broken)
        wire.check(data)


def test_names_that_are_not_utf_8_have_question_marks() -> None:
    """Layouts known or not, and many names of one message; numbers that happen to have the same bytes stay."""
    wire = Wire(Stream.STROKES)
    for k in range(3):
        sent = joint_state(["cylinder_1", "Druck_X", "X", "cylinder_2"], [0.1, 9.0, 9.0, 0.2], k + 1, "Rahmen X")
        msg = wire.check(encoded(sent).replace(b"X\0", b"\xfc\0"))
        assert list(msg.name) == ["cylinder_1", "Druck_?", "?", "cylinder_2"] and list(msg.position) == [0.1, 9.0, 9.0, 0.2]
    assert wire.whole == 1


def test_inputs_are_best_effort_and_only_strokes_and_angles_are_required() -> None:
    topics = load_topics()
    assert [topic.required for topic in topics.inputs.values()] == [True, True, False, False, False]
    assert {topic.qos.reliability for topic in topics.inputs.values()} == {"best_effort"}
    assert not topics.sensors and topics.mounts(3) == [None] * 3 and not topics.is_shared


SCENE = load_scene()
BORE, ROD = (0.16, 0.16, 0.12, 0.10), (0.09, 0.09, 0.07, 0.06)
PISTON = pi / 4 * np.square(BORE)
RING = PISTON - pi / 4 * np.square(ROD)
MAPPING = f"inputs:\n  cylinder_pressures: {{bore: {[*BORE]}, rod: {[*ROD]}}}\nsensors:\n  cylinder_2_cap: {{unit: bar}}\n"


def mapped(tmp_path: Path, text: str, scene: Scene = SCENE) -> Topics:
    path = tmp_path / "mapping.yaml"
    path.write_text(text)
    return load_mapping(path, 4).of_scene(scene.joints)


def test_they_become_forces_positive_in_tension(tmp_path: Path) -> None:
    topics = mapped(tmp_path, MAPPING)
    assert topics.streams_by_topic["cylinder_pressures"] == [Stream.PRESSURES]
    cap, rod = np.array([2e6, 3e6, 0.0, 150e5]), np.array([1e6, 0.0, 40e5, 10e5])
    msg = new_message("sensor_msgs/msg/JointState")
    msg.header.stamp.sec = 5
    msg.name = [f"cylinder_{i}_{side}" for side in ("cap", "rod") for i in (1, 2, 3, 4)]
    msg.effort = np.concatenate([cap, rod])
    msg.effort[1] = 30.0  # bar
    decoder = SampleDecoder(4, topics)
    (sample,) = decoder.samples(topics.streams_by_topic["cylinder_pressures"], 5 * 10**9, msg)
    assert sample.stream is Stream.FORCES
    assert sample.values == pytest.approx(rod * RING - cap * PISTON, rel=1e-12)
    assert sample.values[2] > 0.0 > sample.values[1], "the rod side pulls"
    assert not decoder.oddities
    msg.name = msg.name[:7]  # without the rod side of the last
    (sample,) = decoder.samples(topics.streams_by_topic["cylinder_pressures"], 6 * 10**9, msg) or list(decoder.assembler.rest())
    assert np.isnan(sample.values).tolist() == [False, False, False, True]


def test_a_force_without_one_of_its_sides_is_no_fault(tmp_path: Path) -> None:
    assert mapped(tmp_path, f"{MAPPING}  cylinder_3_rod: none\n").absent == {"cylinder_3_rod", "cylinder_force_3"}
    assert mapped(tmp_path, "sensors: {cylinder_3_rod: none}").absent == {"cylinder_3_rod"}


def test_their_noise_is_that_of_the_forces(tmp_path: Path) -> None:
    settings = Settings(pressure_sigma=2e4)
    assert mapped(tmp_path, MAPPING).noise_of(settings).force_sigma == pytest.approx(2e4 * hypot(PISTON[3], RING[3]))
    assert mapped(tmp_path, "").noise_of(settings) is settings


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("inputs: {cylinder_pressures: {required: true}}", "oil: {bore, rod, ..}` to each cylinder of the scene, or bore"),
        ("inputs: {cylinder_pressures: {bore: [0.1], rod: [0.05]}}", "1 and 1 entries, the scene has 4 cylinders"),
        (
            "inputs: {cylinder_pressures: {bore: [0.1, 0.1, 0.1, 0.1], rod: [0.05, 0.1, 0.05, 0.05]}}",
            "cylinder 2 has bore 0.1 and rod 0.1 m, and the rod must be thinner",
        ),
    ],
)
def test_what_is_missing_or_wrong_is_told(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(UsageError) as error:
        mapped(tmp_path, text)
    assert told in str(error.value)
