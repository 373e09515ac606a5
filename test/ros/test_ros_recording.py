"""A recorded live run: every reader reads the same values, and its replay gives what the node published."""

from __future__ import annotations

import dataclasses
import json
import math
import shutil
import signal
import struct
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import numpy as np
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from ruamel.yaml import YAML

from boom_twin.bag.reader import read, read_both, scan
from boom_twin.bag.writer import SessionWriter
from boom_twin.config.settings import Settings
from boom_twin.messages.sample_decoder import stamp_of
from boom_twin.messages.topic_table import TYPES, Output, load_topics
from boom_twin.messages.type_store import jazzy
from boom_twin.offline.replay import replay
from boom_twin.scene import load_scene
from boom_twin.scene.load import default_text
from boom_twin.types import Stream

ROOT = Path(__file__).parents[2]
CLIENT, MODULES = ROOT / "test" / "clients" / "read.cjs", ROOT / ".node"
NODE_JS = shutil.which("node") or shutil.which("node", path=MODULES / "venv" / "bin")
IS_INSTALLED = NODE_JS is not None and (MODULES / "node_modules").is_dir()
TOPICS = load_topics()
Values = dict[str, list[list[str]]]
RARE = (Output.CHANGES, Output.HEALTH, Output.TIP_UNCERTAINTY)


@pytest.fixture(scope="module")
def recorded(spawn: Callable[..., Any], spawn_node: Callable[..., Any], bag: Path, tmp_path_factory: Any) -> Path:
    """Inputs and outputs of a live run, recorded in a process of its own into several files.

    The node's scene has a text of its own, which the recorder is not given.
    """
    from boom_twin.ros.bag.player import Player
    from boom_twin.ros.bag.recorder import COMPLETE

    out = tmp_path_factory.mktemp("recording") / "bag"
    scene = out.parent / "scene.yaml"
    scene.write_text(default_text() + "# a copy\n")
    node = spawn_node("-p", f"scene:={scene}")
    node.wait_for("active;")
    recorder = spawn("boom_twin.cli.main", "record", "--out", str(out), "--split-duration", "1.5")
    player = Player(scan(bag))
    recorder.wait_for(COMPLETE)
    assert player.wait(60.0, listeners=2) == []
    for _ in player.play():
        pass
    time.sleep(1.0)
    player.close()
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
    sent = [topic for stream, topic in TOPICS.inputs.items() if stream is not Stream.FORCES]
    assert values.keys() == {topic.absolute for topic in [*sent, *TOPICS.outputs.values()]}
    sheet = YAML(typ="safe").load((recorded / "session.yaml").read_text())
    assert {count["topic"]: count["written"] for count in sheet["counts"]} == {
        **{name: len(messages) for name, messages in values.items()},
        TOPICS.events.absolute: 0,
        TOPICS.inputs[Stream.FORCES].absolute: 0,
    }
    assert len(list(recorded.glob("*.mcap"))) >= 3
    assert sheet["scene"] == default_text() + "# a copy\n"  # as the node told it
    assert "baseline" not in sheet  # the package's own
    assert sheet["twin"] == {
        "scene": str(recorded.parent / "scene.yaml"),
        "mapping": "",
        "frame_prefix": "",
        **Settings().model_dump(),
    }


def test_the_reader_of_mcap_gives_the_same_bytes(recorded: Path) -> None:
    with AnyReader([recorded]) as reader:
        expected = Counter((c.topic, log_time, bytes(data)) for c, log_time, data in reader.messages())
    found: Counter[tuple[str, int, bytes]] = Counter()
    for path in recorded.glob("*.mcap"):
        with path.open("rb") as file:
            for _, channel, message in make_reader(file, validate_crcs=True).iter_messages():
                found[channel.topic, message.log_time, message.data] += 1
    assert found == expected


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


@pytest.fixture(scope="module")
def again(recorded: Path, values: Values, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bag that a replay of the recorded inputs writes: of all strokes that the node answered."""
    answered = {tuple(message[1:3]) for message in values[TOPICS.outputs[Output.TIP_POSITION].absolute]}
    session, accepted = scan(recorded), tmp_path_factory.mktemp("accepted") / "bag"
    keys = {topic.absolute: stream for stream, topic in TOPICS.inputs.items()}
    wanted = {name: TYPES[stream] for name, stream in keys.items() if stream is not Stream.FORCES}  # none is sent here
    with SessionWriter(accepted, {stream.value: topic for stream, topic in TOPICS.inputs.items()}) as writer:
        for name, log_time, data, message in read_both(session, wanted):
            if keys[name] is not Stream.STROKES or tuple(list(_flat(message))[:2]) in answered:
                writer.write_encoded(keys[name].value, log_time, data)
    out = tmp_path_factory.mktemp("replay")
    replay(accepted, load_scene(), out)
    return out / "bag"


def _published(path: Path, key: Output) -> list[tuple[int, bytes]]:
    """Stamp and CDR of every message of one output; encoded anew, because rclpy does not clear the bytes between values."""
    found, encode = read(scan(path), {TOPICS.outputs[key].absolute: TYPES[key]}), jazzy().serialize_cdr
    stamped = [(message.markers[0] if key is Output.SHAPE else message, message) for _, _, message in found]
    return [(stamp_of(holder), bytes(encode(message, TYPES[key]))) for holder, message in stamped]


@pytest.mark.parametrize("key", [key for key in Output if key not in (Output.DIAGNOSTICS, Output.RESIDUALS)])
def test_a_replay_gives_what_the_node_published(recorded: Path, again: Path, key: Output) -> None:
    live = _published(recorded, key)
    assert len(live) > (0 if key in RARE else 30)
    assert live == _published(again, key)


def test_a_replay_gives_the_residuals_that_the_node_published(recorded: Path, again: Path) -> None:
    live, here = _published(recorded, Output.RESIDUALS), _published(again, Output.RESIDUALS)
    assert len(live) == len(set(live)) > 1000
    assert set(live) <= set(here)
