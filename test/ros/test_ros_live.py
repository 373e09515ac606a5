"""The live node against the same three calls in this process, on what it accepted."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

from boom_twin.bag.reader import read, scan
from boom_twin.config.settings import load_settings
from boom_twin.health.baseline import load_baseline
from boom_twin.messages.report_encoder import ReportEncoder, decode_changes
from boom_twin.messages.sample_decoder import SampleDecoder, stamp_of
from boom_twin.messages.topic_table import TYPES, Output, load_topics
from boom_twin.messages.type_store import jazzy
from boom_twin.offline.replay import replay
from boom_twin.scene import load_scene
from boom_twin.twin.twin import Twin
from boom_twin.types import Stream

PARAMETERS = Path(__file__).parents[2] / "msg_config" / "twin.yaml"
ESTIMATES = [output for output in Output if output.startswith("estimate_")]
SINGLE = [Output.TIP_DISPLACEMENT, Output.TIP_POSITION, Output.TIP_ACCELERATION, Output.JOINT_STATES, *ESTIMATES]
ASKED: dict[int, Callable[[Any], Any]] = {
    300: lambda remote: remote.set("payload", 35.0),  # the model is made beside the samples, which takes its time
    900: lambda remote: remote.trigger("rezero/joint_2"),
    1200: lambda remote: remote.trigger("reset"),
    1500: lambda remote: remote.set("gap", 0.2),
    1800: lambda remote: remote.trigger("rezero/cylinder_1"),
    1950: lambda remote: remote.set("line_fill", 8.0),
    2200: lambda remote: remote.trigger("acknowledge"),
}
"""What is done after so many messages."""
Recorded = dict[str, list[tuple[int, bytes]]]


@pytest.fixture(scope="module")
def recorded(spawn: Callable[..., Any], spawn_node: Callable[..., Any], bag: Path, remote: Any, tmp_path_factory: Any) -> Path:
    """Inputs and outputs of a live run, recorded over DDS in a third process; much is asked of the node meanwhile."""
    from boom_twin.ros.bag.player import Player
    from boom_twin.ros.bag.recorder import COMPLETE

    out = tmp_path_factory.mktemp("live") / "bag"
    node = spawn_node("--params-file", str(PARAMETERS))
    node.wait_for("active;")
    recorder = spawn("boom_twin.cli.main", "record", "--out", str(out))
    player = Player(scan(bag))
    recorder.wait_for(COMPLETE)
    assert player.wait(60.0, listeners=2) == []
    sent = 0
    for _ in player.play():
        sent += 1
        if (act := ASKED.get(sent)) is not None:
            answer = act(remote)
            assert getattr(answer, "success", None) or getattr(answer, "successful", None), answer
    time.sleep(1.0)
    player.close()
    assert sent == scan(bag).topics[0].count * 3
    assert recorder.stop(signal.SIGINT) == 0, recorder.said()
    assert node.stop(signal.SIGINT) == 0, node.said()
    return out


@pytest.fixture(scope="module")
def outputs(recorded: Path) -> dict[Output, list[tuple[int, bytes]]]:
    """Stamp and CDR of every output as the node published it, in the order of arrival."""
    topics, session = load_topics().outputs, scan(recorded)
    keys = [key for key in Output if key is not Output.DIAGNOSTICS]
    return {key: _encoded(session, topics[key].absolute, TYPES[key]) for key in keys}


def _encoded(session: Any, name: str, type_name: str) -> list[tuple[int, bytes]]:
    return [(_stamp(msg), bytes(jazzy().serialize_cdr(msg, type_name))) for _, _, msg in read(session, {name: type_name})]


def _stamp(msg: Any) -> int:
    return stamp_of(msg.markers[0] if hasattr(msg, "markers") else msg)


@pytest.fixture(scope="module")
def expected(
    bag: Path, recorded: Path, outputs: dict[Output, list[tuple[int, bytes]]]
) -> dict[Output, list[tuple[int, bytes]]]:
    """What intake, twin and outlet make here of the strokes that the node answered, and of all other samples.

    As they were sent: on a starved machine the recorder may lose some of them on the way, which come by best effort.
    """
    answered = {stamp for stamp, _ in outputs[Output.TIP_POSITION]}
    inputs = {topic.absolute: stream for stream, topic in load_topics().inputs.items()}
    scene, settings = load_scene(), load_settings(PARAMETERS)
    twin = Twin(scene, settings, baseline=load_baseline())
    decoder, encoder = SampleDecoder(twin.plan.joints), ReportEncoder(scene, settings)
    made: dict[Output, list[tuple[int, bytes]]] = {key: [] for key in outputs}
    changed = load_topics().outputs[Output.CHANGES]
    asked = [decode_changes(msg) for _, _, msg in read(scan(recorded), {changed.absolute: changed.type})]
    changes, session = {change.stamp: change for change in asked}, scan(bag)
    sent = {name: stream for name, stream in inputs.items() if (topic := session.find(name)) is not None and topic.count}
    for name, _, msg in read(session, {name: TYPES[stream] for name, stream in sent.items()}):
        stream, stamp = inputs[name], stamp_of(msg)
        if stream is Stream.STROKES:
            if stamp not in answered:
                continue
            if stamp in changes:
                twin.requests.repeat(changes[stamp])
        sample = decoder.put(stream, stamp, msg)
        assert sample is not None
        for key, data in encoder.fill(twin.update(sample)):
            made[key].append((_stamp(jazzy().deserialize_cdr(data, TYPES[key])), data))
    return made


@pytest.mark.parametrize("key", SINGLE)
def test_nearly_every_stroke_is_answered_and_none_twice(outputs: Any, motion: dict[str, Any], key: Output) -> None:
    stamps = [stamp for stamp, _ in outputs[key]]
    assert len(stamps) == len(set(stamps))
    assert set(stamps) <= set(motion["stamps_ns"].tolist())
    assert len(stamps) > 0.99 * len(motion["stamps_ns"])


@pytest.mark.parametrize("key", [*SINGLE, Output.SHAPE, Output.CHANGES, Output.HEALTH, Output.TIP_UNCERTAINTY])
def test_predictions_are_those_of_the_twin_bit_for_bit(outputs: Any, expected: Any, key: Output) -> None:
    assert len(outputs[key]) > 0
    assert outputs[key] == expected[key]


def test_residuals_are_those_of_the_twin_bit_for_bit(outputs: Any, expected: Any, motion: dict[str, Any]) -> None:
    live, here = set(outputs[Output.RESIDUALS]), set(expected[Output.RESIDUALS])
    assert len(live) == len(outputs[Output.RESIDUALS]) > 0.98 * 3 * len(motion["stamps_ns"])
    assert live <= here


def test_what_was_asked_is_in_the_recording(recorded: Path) -> None:
    topic = load_topics().outputs[Output.CHANGES]
    changes = [decode_changes(msg) for _, _, msg in read(scan(recorded), {topic.absolute: topic.type})]
    assert [change.from_rest for change in changes] == [True, True, False, True, False, True, True]
    assert [change.settings["payload"] for change in changes] == [-1.0] + 6 * [35.0]
    assert (changes[-1].settings["line_fill"], changes[-1].settings["gap"]) == (8.0, 0.2)
    assert set(changes[-1].zeros) == {"joint_2", "cylinder_1"}


def test_a_replay_of_the_recording_is_the_live_run(recorded: Path, outputs: Any, tmp_path: Path) -> None:
    result = replay(recorded, load_scene(), tmp_path, load_settings(PARAMETERS))
    strokes = scan(recorded).find("cylinder_strokes")
    assert strokes is not None
    if strokes.count != len(outputs[Output.TIP_POSITION]):
        pytest.skip("a stroke was lost on the way to the node")
    for key in (Output.TIP_POSITION, *ESTIMATES):
        topic, live = load_topics().outputs[key], [data for _, data in outputs[key]]
        assert [data for _, data in _encoded(scan(tmp_path / "bag"), topic.absolute, topic.type)] == live, key
    assert {"load": 2, "zero": 2, "reset": 1, "limits": 1}.items() <= result.summary["events"].items()


def test_the_node_read_its_parameter_file(recorded: Path, outputs: Any) -> None:
    """The deviation of an IMU residual is at least the noise that the file states."""
    decode = jazzy().deserialize_cdr
    residuals = [decode(data, TYPES[Output.RESIDUALS]) for _, data in outputs[Output.RESIDUALS]]
    deviations = np.array([msg.effort[0] for msg in residuals if msg.name[0] == "tip_imu_x"])
    assert deviations.min() >= load_settings(PARAMETERS).imu_sigma
