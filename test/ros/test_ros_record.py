"""`boom_twin record` as a process, published to from here."""

from __future__ import annotations

import hashlib
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
from rcl_interfaces.msg import ParameterEvent
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_types_from_msg
from ruamel.yaml import YAML
from sensor_msgs.msg import JointState

from boom_twin import __version__
from boom_twin.errors import UsageError
from boom_twin.io.info import inspect
from boom_twin.io.reader import read, scan
from boom_twin.io.recover import recover
from boom_twin.io.typestore import jazzy
from boom_twin.ros import definition
from boom_twin.ros.recorder import COMPLETE
from boom_twin.ros.wanted import wanted_of

JOINT_STATE = "sensor_msgs/msg/JointState"


@contextmanager
def publishing(topic: str, kind: Any, rate: float, make: Callable[[int], Any]) -> Iterator[list[int]]:
    """Publishes in a thread; gives the times (ns) at which."""
    node = rclpy.create_node("source_of" + topic.replace("/", "_"))
    publisher, times, end = node.create_publisher(kind, topic, 100), [], threading.Event()

    def run() -> None:
        began = time.monotonic()
        while not end.wait(max(0.0, began + len(times) / rate - time.monotonic())):
            times.append(time.time_ns())
            publisher.publish(make(len(times)))

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield times
    finally:
        end.set()
        thread.join()
        node.destroy_node()


def strokes(number: int) -> JointState:
    msg = JointState(name=["cylinder_1"], position=[1e-6 * number])
    msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(time.time_ns(), 10**9)
    return msg


def test_any_topics_with_a_sheet_and_splits(spawn: Callable[..., Any], tmp_path: Path) -> None:
    out = tmp_path / "bag"
    with (
        publishing("cylinder_strokes", JointState, 200.0, strokes),
        publishing("/odd", ParameterEvent, 50.0, lambda number: ParameterEvent(node=f"/n{number}")),
    ):
        topics = ["cylinder_strokes", "/odd", "/never:std_msgs/String"]
        options = ["--split-duration", "1", "--note", "wind: 5 m/s\nx", "--origin", "a test"]
        record = spawn("boom_twin.cli.main", "record", "--out", str(out), "--topics", *topics, *options)
        record.wait_for("recording 3 topics")
        time.sleep(3.5)
        assert record.stop(signal.SIGINT) == 0, record.said()
    info = inspect(out)
    counts = {tally.name: tally.count for tally in info.tallies}
    assert counts.keys() == {"/cylinder_strokes", "/odd"} and counts["/cylinder_strokes"] > 300 and counts["/odd"] > 80
    for name, count in counts.items():
        assert f"{count:9d} {count:9d} {0:14d}  {name}" in record.said()
    assert "unknown  /never" in record.said()
    assert len(info.session.files) >= 3
    with AnyReader([out]) as reader:
        names = [reader.deserialize(data, c.msgtype).node for c, _, data in reader.messages() if c.topic == "/odd"]
    assert names == [f"/n{number}" for number in range(int(names[0][2:]), int(names[0][2:]) + len(names))]
    sheet = YAML(typ="safe").load((out / "session.yaml").read_text())
    assert (sheet["boom_twin"], sheet["note"], sheet["origin"]) == (__version__, "wind: 5 m/s\nx", "a test")
    assert hashlib.sha256(sheet["scene"].encode()).hexdigest() == sheet["scene_sha256"]
    here = Path(__file__).parents[2] / "msg_config"
    assert sheet["scene"] == (here / "scene.yaml").read_text()
    assert sheet["parameters"] == (here / "twin.yaml").read_text()
    assert sheet["mapping"] == (here / "topics.yaml").read_text()
    assert sheet["topics"] == {"/cylinder_strokes": JOINT_STATE, "/odd": None, "/never": "std_msgs/msg/String"}


def kill_once(spawn: Callable[..., Any], tmp_path: Path, delay: float) -> None:
    """Record at 200 Hz, kill the recorder after so long, and look at what is left."""
    with publishing("cylinder_strokes", JointState, 200.0, strokes) as times:
        record = spawn("boom_twin.cli.main", "record", "--out", str(tmp_path / "bag"), "--topics", "cylinder_strokes")
        record.wait_for(COMPLETE)
        time.sleep(delay)
        assert record.stop(signal.SIGKILL) == -signal.SIGKILL
        killed = time.time_ns()
        assert times
    outcome = recover(tmp_path / "bag", tmp_path / "out")
    session = scan(tmp_path / "out")
    assert killed - session.end < 1_200_000_000
    values = [msg.position[0] for _, _, msg in read(session, {"cylinder_strokes": JOINT_STATE})]
    first = round(1e6 * values[0])
    assert values == pytest.approx([1e-6 * number for number in range(first, first + len(values))])
    assert outcome.saved.total() == len(values)


def test_a_killed_recorder_loses_little(spawn: Callable[..., Any], tmp_path: Path) -> None:
    kill_once(spawn, tmp_path, 2.7)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(20))
def test_a_recorder_killed_many_times(spawn: Callable[..., Any], tmp_path: Path, number: int) -> None:
    kill_once(spawn, tmp_path, 1.3 + 0.0937 * number)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--topics", "/a:no_such_msgs/msg/Thing"], "not an installed message type"),
        (["--topics", "/a:std_msgs/msg/Nothing"], "not an installed message type"),
        (["--topics", "/a", "a"], "topic /a is named twice"),
        (["--scene", "/no/such/scene.yaml"], "/no/such/scene.yaml"),
        (["--split-size", "10"], "must be at least 1M"),
    ],
)
def test_refused_at_once(options: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from boom_twin.cli.main import main

    try:
        code = main(["record", "--out", str(tmp_path / "bag"), *options])
    except SystemExit as end:
        code = int(end.code or 0)
    assert code in (1, 2) and words in capsys.readouterr().err
    assert not (tmp_path / "bag").exists()


@pytest.mark.parametrize("name", ["sensor_msgs/msg/Imu", "visualization_msgs/msg/MarkerArray", "std_msgs/msg/Empty"])
def test_definitions_from_classes_are_those_of_the_packages(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    class Nothing:
        types: dict[str, Any] = {}

    with monkeypatch.context() as patch:
        patch.setattr(definition, "jazzy", Nothing)
        text = definition.definition_of(definition.installed_class(name))
    for inner, (_, fields) in get_types_from_msg(text, name).items():
        assert list(fields) == list(jazzy().fielddefs[inner][1]), inner


def test_names_of_topics() -> None:
    (found,) = wanted_of(["a:std_msgs/String"], {})
    assert (found.name, found.type, found.required) == ("/a", "std_msgs/msg/String", True)
    with pytest.raises(UsageError, match="named twice"):
        wanted_of(["/a", "a"], {})
