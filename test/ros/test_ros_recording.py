"""A recorded live run: every reader reads the same values, and its replay gives what the node published, bit for bit."""

from __future__ import annotations

import dataclasses
import json
import math
import shutil
import signal
import struct
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

from default_boom import default_text
from recordings import MessageWriter, read_both, scan
from ros_messages import TYPES, Output, decode_changes, jazzy, load_topics, stamp_of
from ros_rig import all_stored, published
from rosbags.highlevel import AnyReader
from ruamel.yaml import YAML

from boom_twin import Settings, Stream, load_scene, load_settings, replay
from boom_twin.ros.bag.player import Player
from boom_twin.ros.bag.recorder import COMPLETE

ROOT = Path(__file__).parents[2]
PARAMETERS = ROOT / "msg_config" / "twin.yaml"
CLIENT, MODULES = ROOT / "test" / "clients" / "read.cjs", ROOT / ".node"
NODE_JS = shutil.which("node") or shutil.which("node", path=MODULES / "venv" / "bin")
IS_INSTALLED = NODE_JS is not None and (MODULES / "node_modules").is_dir()
TOPICS = load_topics()
Values = dict[str, list[list[str]]]
RARE = (Output.CHANGES, Output.HEALTH, Output.TIP_UNCERTAINTY, Output.SHAPE)
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


@pytest.fixture(scope="module")
def recorded(
    spawn: Callable[..., Any],
    spawn_node: Callable[..., Any],
    reliable_bag: Path,
    mapping: Path,
    remote: Any,
    tmp_path_factory: Any,
) -> Path:
    """Inputs and outputs of a live run, recorded in a process of its own; much is asked of the node meanwhile.

    The node's scene has a text of its own, which the recorder is not given.
    """
    out = tmp_path_factory.mktemp("recording") / "bag"
    scene = out.parent / "scene.yaml"
    scene.write_text(default_text() + "# a copy\n")
    node = spawn_node("--params-file", str(PARAMETERS), "-p", f"scene:={scene}", "-p", f"mapping:={mapping}")
    node.wait_for("active;")
    recorder = spawn("boom_twin.cli.main", "record", "--out", str(out), "--mapping", str(mapping))
    player = Player(scan(reliable_bag))
    recorder.wait_for(COMPLETE)
    assert player.wait(60.0, listeners=2) == []
    for sent, _ in enumerate(player.play(), 1):
        if (act := ASKED.get(sent)) is not None:
            answer = act(remote)
            assert getattr(answer, "success", None) or getattr(answer, "successful", None), answer
    all_stored(remote.node)
    player.close()
    assert sent == scan(reliable_bag).topics[0].count * 3
    assert recorder.stop(signal.SIGINT) == 0, recorder.said()
    assert "no scene is kept" not in recorder.said()
    assert node.stop(signal.SIGINT) == 0, node.said()
    return out


@pytest.fixture(scope="module")
def values(recorded: Path) -> Values:
    """Log time and values of every message by topic, as rosbags reads them."""
    found: Values = {}
    with AnyReader([recorded]) as reader:
        for connection, log_time, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append([str(log_time), *_flat(message)])
    return found


def _flat(value: Any) -> Iterator[str]:
    """The values of a message in the order of its definition, spelled as `CLIENT` does."""
    if isinstance(value, str):
        yield f'"{value}'
    elif isinstance(value, (bool, int, float, np.number)):
        number = float(value)
        yield "nan" if math.isnan(number) else struct.pack(">d", number).hex()
    elif dataclasses.is_dataclass(value):
        for each in dataclasses.fields(value):
            if each.name[0].islower():  # not the constants, nor the name of the type
                yield from _flat(getattr(value, each.name))
    else:
        for inner in value:
            yield from _flat(inner)


def test_every_topic_was_recorded(recorded: Path, values: Values) -> None:
    sent = [topic for stream, topic in TOPICS.inputs.items() if stream not in (Stream.FORCES, Stream.PRESSURES)]
    assert values.keys() == {topic.absolute for topic in [*sent, *TOPICS.outputs.values()]}
    sheet = YAML(typ="safe").load((recorded / "session.yaml").read_text())
    assert {count["topic"]: count["written"] for count in sheet["counts"]} == {
        **{name: len(messages) for name, messages in values.items()},
        TOPICS.events.absolute: 0,
        TOPICS.inputs[Stream.FORCES].absolute: 0,
        TOPICS.inputs[Stream.PRESSURES].absolute: 0,
    }
    assert len(list(recorded.glob("*.mcap"))) == 1
    assert sheet["scene"] == default_text() + "# a copy\n"  # as the node told it
    settings = load_settings(PARAMETERS).model_dump()
    assert sheet["twin"].keys() == {"scene", "mapping", "frame_prefix", *Settings.model_fields}
    assert sheet["twin"]["imu_sigma"] == settings["imu_sigma"]


@pytest.mark.slow
@pytest.mark.skipif(not IS_INSTALLED, reason="no Node.js packages in .node; make test-extra installs them")
def test_an_independent_client_reads_the_same_values(recorded: Path, values: Values) -> None:
    found: Values = {}
    for path in sorted(recorded.glob("*.mcap")):
        command = [str(NODE_JS), str(CLIENT), str(MODULES), str(path)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
        for line in done.stdout.splitlines():
            topic, *message = json.loads(line)
            found.setdefault(topic, []).append(message)
    assert found.keys() == values.keys()
    for topic, messages in values.items():
        assert len(found[topic]) == len(messages)
        for one, other in zip(found[topic], messages, strict=True):
            assert one == other, topic


def test_what_was_asked_is_in_the_recording(recorded: Path, motion: dict[str, Any]) -> None:
    topic = TOPICS.outputs[Output.CHANGES]
    changes = [decode_changes(msg) for *_, msg in read_both(scan(recorded), {topic.absolute: topic.type})]
    assert [change.from_rest for change in changes] == [True, True, False, True, False, True, True]
    assert [change.settings["payload"] for change in changes] == [-1.0] + 6 * [35.0]
    assert (changes[-1].settings["line_fill"], changes[-1].settings["gap"]) == (8.0, 0.2)
    assert set(changes[-1].zeros) == {"joint_2", "cylinder_1"}
    stamps = [stamp for stamp, _ in published(recorded, TOPICS, Output.TIP_POSITION)]
    assert stamps == motion["stamps_ns"].tolist()
    residuals = [
        jazzy().deserialize_cdr(data, TYPES[Output.RESIDUALS]) for _, data in published(recorded, TOPICS, Output.RESIDUALS)
    ]
    deviations = [msg.effort[0] for msg in residuals if msg.name[0] == "tip_imu_x"]
    assert min(deviations) >= load_settings(PARAMETERS).imu_sigma  # the node read its parameter file


def test_a_replay_gives_what_the_node_published(recorded: Path, bag: Path, tmp_path: Path) -> None:
    """Of all samples as they were sent, and what was asked of the node."""
    inputs = {
        topic.absolute: stream for stream, topic in TOPICS.inputs.items() if stream not in (Stream.FORCES, Stream.PRESSURES)
    }  # none is sent
    topic = TOPICS.outputs[Output.CHANGES]
    changes = {stamp_of(msg): data for *_, data, msg in read_both(scan(recorded), {topic.absolute: topic.type})}
    with MessageWriter(tmp_path / "bag", TOPICS.inputs | {Output.CHANGES: topic}) as writer:
        for name, log_time, data, msg in read_both(scan(bag), {name: TYPES[stream] for name, stream in inputs.items()}):
            if inputs[name] is Stream.STROKES and (change := changes.get(stamp_of(msg))):
                writer.write_encoded(Output.CHANGES, log_time, change)
            writer.write_encoded(inputs[name], log_time, data)
    result = replay(tmp_path / "bag", load_scene(), tmp_path / "out", load_settings(PARAMETERS))
    for key in set(Output) - {Output.DIAGNOSTICS, Output.RESIDUALS}:
        live = published(recorded, TOPICS, key)
        assert len(live) > (0 if key in RARE else 100), key
        here = published(tmp_path / "out" / "bag", TOPICS, key)
        assert set(live) <= set(here) if key is Output.SHAPE else live == here, key  # a busy node skips shapes
    live, here = (published(path, TOPICS, Output.RESIDUALS) for path in (recorded, tmp_path / "out" / "bag"))
    assert sorted(live) == sorted(here)
    assert {"load": 2, "zero": 2, "reset": 1, "limits": 1}.items() <= result.summary["events"].items()
