"""`boom_twin record` as a process, published to from here."""

from __future__ import annotations

import random
import resource
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

import rclpy
from rcl_interfaces.msg import ParameterEvent
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_types_from_msg
from ruamel.yaml import YAML
from sensor_msgs.msg import Image, JointState

from boom_twin import __version__
from boom_twin.bag.inspect import inspect
from boom_twin.bag.reader import read, scan
from boom_twin.bag.recovery.recover import recover
from boom_twin.errors import UsageError
from boom_twin.messages.type_store import jazzy
from boom_twin.ros.bag import subscriptions as definition
from boom_twin.ros.bag.recorder import COMPLETE
from boom_twin.ros.bag.subscriptions import requested_topics

JOINT_STATE = "sensor_msgs/msg/JointState"
STATE = "boom_twin_recorder: recording"


class Source:
    """Publishes from a thread; `times` (ns) tells when."""

    def __init__(self, topic: str, kind: Any, rate: float, make: Callable[[int], Any]) -> None:
        self._node = rclpy.create_node("source_of" + topic.replace("/", "_"))
        self._publisher = self._node.create_publisher(kind, topic, 100)
        self.times: list[int] = []
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(rate, make))
        self._thread.start()

    def _run(self, rate: float, make: Callable[[int], Any]) -> None:
        began = time.monotonic()
        while not self._end.wait(max(0.0, began + len(self.times) / rate - time.monotonic())):
            self.times.append(time.time_ns())
            self._publisher.publish(make(len(self.times)))

    def wait_for_listener(self) -> None:
        end = time.monotonic() + 30.0
        while self._publisher.get_subscription_count() == 0:
            assert time.monotonic() < end, "nobody listens"
            time.sleep(0.02)

    def close(self) -> None:
        self._end.set()
        self._thread.join()
        self._node.destroy_node()


@contextmanager
def publishing(topic: str, kind: Any, rate: float, make: Callable[[int], Any]) -> Iterator[Source]:
    source = Source(topic, kind, rate, make)
    try:
        yield source
    finally:
        source.close()


def strokes(number: int) -> JointState:
    msg = JointState(name=["cylinder_1"], position=[1e-6 * number])
    msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(time.time_ns(), 10**9)
    return msg


def test_any_topics_with_a_sheet_and_splits(spawn: Callable[..., Any], tmp_path: Path) -> None:
    out = tmp_path / "bag"
    with (
        publishing("cylinder_strokes", JointState, 200.0, strokes) as first,
        publishing("/odd", ParameterEvent, 50.0, lambda number: ParameterEvent(node=f"/n{number}")) as second,
    ):
        topics = ["cylinder_strokes", "/odd", "/never:std_msgs/String"]
        options = ["--split-duration", "1", "--note", "wind: 5 m/s\nx", "--origin", "a test"]
        record = spawn("boom_twin.cli.main", "record", "--out", str(out), "--topics", *topics, *options)
        record.wait_for("recording 3 topics")
        first.wait_for_listener()
        second.wait_for_listener()
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
    assert "scene" not in sheet and "no scene is kept in session.yaml" in record.said()  # there was no twin to tell it
    here = Path(__file__).parents[2] / "msg_config"
    assert sheet["parameters"] == (here / "twin.yaml").read_text()
    assert sheet["mapping"] == (here / "topics.yaml").read_text()
    found = {count["topic"]: (count["received"], count["written"], count["missed"]) for count in sheet["counts"]}
    assert found == {name: (count, count, 0) for name, count in counts.items()} | {"/never": (0, 0, None)}
    assert sheet["started"] < sheet["ended"]
    assert sheet["topics"] == {"/cylinder_strokes": JOINT_STATE, "/odd": None, "/never": "std_msgs/msg/String"}


def test_a_large_message_of_another_topic_is_kept_and_can_be_read(spawn: Callable[..., Any], tmp_path: Path) -> None:
    """A picture of 67 MB, as a camera beside the rig sends it."""
    huge, bag = Image(data=np.random.default_rng(0).bytes(67_500_000)), tmp_path / "bag"
    with (
        publishing("cylinder_strokes", JointState, 50.0, strokes),
        publishing("/huge", Image, 0.5, lambda _: huge),
    ):
        topics = ["cylinder_strokes", "/huge:sensor_msgs/Image"]
        record = spawn("boom_twin.cli.main", "record", "--out", str(bag), "--topics", *topics)
        deadline = time.monotonic() + 120.0
        while sum(file.stat().st_size for file in bag.glob("*.mcap")) < 67_500_000 and time.monotonic() < deadline:
            time.sleep(0.1)
        assert record.stop(signal.SIGINT) == 0, record.said()
    counts = {tally.name: tally.count for tally in inspect(bag).tallies}
    assert counts["/huge"] > 0 < counts["/cylinder_strokes"]


def test_a_publisher_of_another_type_is_told(spawn: Callable[..., Any], tmp_path: Path) -> None:
    """DDS never connects it, so that nothing would be missed."""
    with publishing("/joint_angles", ParameterEvent, 50.0, lambda number: ParameterEvent()):
        record = spawn("boom_twin.cli.main", "record", "--out", str(tmp_path / "bag"), "--only", "inputs")
        record.wait_for("/joint_angles: is published as rcl_interfaces/msg/ParameterEvent, of which nothing is recorded")
        assert record.stop(signal.SIGINT) == 1, record.said()  # nothing came
    assert record.said().count("is published as") == 1


def test_the_state_of_a_recording_is_published_until_its_disk_is_full(
    spawn: Callable[..., Any], bench: Any, tmp_path: Path
) -> None:
    """The limit on the size of a file stands for the disk's. All that came before can be saved."""
    bag = tmp_path / "bag"
    with publishing("odd_strokes", JointState, 200.0, strokes) as source:
        record = spawn("boom_twin.cli.main", "record", "--out", str(bag), "--topics", "odd_strokes:sensor_msgs/JointState")
        bench.until(lambda: float(bench.values(STATE).get("received /odd_strokes", 0)) > 300)
        status, values = bench.statuses()[STATE], bench.values(STATE)
        assert (status.level, status.message) == (b"\x00", "running")
        assert float(values["lag_s"]) < 2.0 == float(values["lag_s_warn"])
        assert values["never_arrived"] == values["never_arrived /odd_strokes"] == "0"
        assert int(values["disk_free_bytes"]) > 0 and float(values["disk_left_s"]) > 1800.0
        full = (bag / "session_0.mcap").stat().st_size + 10_000
        resource.prlimit(record.pid, resource.RLIMIT_FSIZE, (full, full))
        bench.until(lambda: bench.statuses().get(STATE) is not None and bench.statuses()[STATE].level == b"\x02")
        assert record.end(10.0) == 1
    fault = [line for line in record.said().splitlines() if "cannot be written" in line]
    assert "Make room or choose another disk" in fault[-1] and "Traceback" not in record.said()
    assert "cannot be written" in bench.statuses()[STATE].message
    outcome = recover(bag, tmp_path / "out")
    saved = numbers(tmp_path / "out", "odd_strokes")
    assert saved == list(range(saved[0], saved[0] + len(saved))) and outcome.saved.total() == len(saved) > 300
    assert len(saved) < len(source.times)


def numbers(path: Path, topic: str) -> list[int]:
    """Those of the messages, see `strokes`."""
    return [round(1e6 * msg.position[0]) for _, _, msg in read(scan(path), {topic: JOINT_STATE})]


def kill_once(spawn: Callable[..., Any], tmp_path: Path, delay: float, *options: str) -> None:
    """Record at 200 Hz, kill the recorder after so long, and look at what is left."""
    bag = tmp_path / "bag"
    with publishing("cylinder_strokes", JointState, 200.0, strokes) as source:
        record = spawn("boom_twin.cli.main", "record", "--out", str(bag), "--topics", "cylinder_strokes", *options)
        record.wait_for(COMPLETE)
        time.sleep(delay)
        assert record.stop(signal.SIGKILL) == -signal.SIGKILL
        killed = time.time_ns()
    outcome = recover(bag, tmp_path / "out")
    saved = numbers(tmp_path / "out", "cylinder_strokes")
    assert saved == list(range(saved[0], saved[0] + len(saved)))
    lost = killed - source.times[saved[-1] - 1]
    print(f"killed after {delay:.3f} s, lost {lost * 1e-9:.3f} s")
    assert lost < 1_200_000_000
    assert outcome.saved.total() == len(saved)
    assert outcome.lost is None or not any(outcome.lost.values())


def test_a_killed_recorder_loses_little(spawn: Callable[..., Any], tmp_path: Path) -> None:
    kill_once(spawn, tmp_path, 2.7)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(10))
def test_a_recorder_killed_many_times(spawn: Callable[..., Any], tmp_path: Path, number: int) -> None:
    """At a moment drawn anew in each run; every other one while its files are split."""
    kill_once(spawn, tmp_path, random.uniform(1.3, 4.0), *(["--split-duration", "0.4"] if number % 2 else []))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--topics", "/a:no_such_msgs/msg/Thing"], "not an installed message type"),
        (["--topics", "/a:std_msgs/msg/Nothing"], "not an installed message type"),
        (["--topics", "/a", "a"], "topic /a is named twice"),
        (["--scene", "/no/such/scene.yaml"], "/no/such/scene.yaml"),
        (["--split-size", "10"], "must be at least 1M"),
        (["--split-duration", "0.01"], "must be at least 0.1 s"),
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


@pytest.mark.parametrize("inner", ["", "bag", "bag/today"])
def test_nothing_is_recorded_into_what_was_left(inner: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from boom_twin.cli.main import main

    left = tmp_path / "out.unfinished"
    left.mkdir()
    (left / "unfinished.json").write_text('{"command": "replay"}')
    assert main(["record", "--out", str(left / inner), "--duration", "0.1"]) == 1
    assert "lies in an unfinished result" in capsys.readouterr().err
    assert [entry.name for entry in left.iterdir()] == ["unfinished.json"]


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
    (found,) = requested_topics(["a:std_msgs/String"], {})
    assert (found.name, found.type, found.required) == ("/a", "std_msgs/msg/String", True)
    with pytest.raises(UsageError, match="named twice"):
        requested_topics(["/a", "a"], {})
