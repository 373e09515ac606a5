"""`boom_twin record` as a process, published to from here."""

from __future__ import annotations

import resource
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import pytest

pytest.importorskip("rclpy")

import rclpy
from rcl_interfaces.msg import ParameterEvent
from recordings import read, recover, scan
from ros_rig import Rig, joint_state
from rosbags.highlevel import AnyReader
from ruamel.yaml import YAML
from sensor_msgs.msg import JointState

from boom_twin import __version__
from boom_twin.bag.inspect import inspect

JOINT_STATE = "sensor_msgs/msg/JointState"
STATE = "boom_twin_recorder: recording"


class Source:
    """Publishes numbered messages from a thread; `times` (ns) tells when."""

    def __init__(self, topic: str, kind: Any, make: Callable[[int], Any], period: float = 0.005) -> None:
        self._node = rclpy.create_node("source_of" + topic.replace("/", "_"))
        self._publisher, self._make, self._period = self._node.create_publisher(kind, topic, 100), make, period
        self.times: list[int] = []
        self._end, self._thread = threading.Event(), threading.Thread(target=self._run)

    def _run(self) -> None:
        while not self._end.wait(self._period):
            self.times.append(time.time_ns())
            self._publisher.publish(self._make(len(self.times)))

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()
        self._node.destroy_node()


def strokes(number: int) -> JointState:
    return joint_state(number, ["cylinder_1"], [1e-6 * number])


def odd(number: int) -> ParameterEvent:
    return ParameterEvent(node=f"/n{number}")


def received(rig: Rig, topic: str) -> float:
    """How many messages a recorder has by its own words."""
    for status in (status for msg in rig.diagnostics[-3:] for status in msg.status if status.name == STATE):
        for pair in status.values:
            if pair.key == f"received {topic}":
                return float(pair.value)
    return 0.0


def test_any_topics_with_a_sheet(spawn: Callable[..., Any], new_rig: Callable[..., Rig], tmp_path: Path) -> None:
    out, rig = tmp_path / "bag", new_rig()
    with Source("odd_strokes", JointState, strokes), Source("/odd", ParameterEvent, odd), Source("/other", ParameterEvent, odd):
        topics = ["odd_strokes", "/odd", "/never:std_msgs/String", "/other:sensor_msgs/JointState"]
        options = ["--note", "wind: 5 m/s\nx", "--origin", "a test"]
        record = spawn("boom_twin.cli.main", "record", "--out", str(out), "--topics", *topics, *options)
        rig.until(lambda: received(rig, "/odd_strokes") > 300 and received(rig, "/odd") > 80)
        record.wait_for("/other: is published as rcl_interfaces/msg/ParameterEvent, of which nothing is recorded")
        assert record.stop(signal.SIGINT) == 0, record.said()
    assert record.said().count("is published as") == 1
    info = inspect(out)
    counts = {tally.name: tally.count for tally in info.tallies if tally.count}
    assert counts.keys() == {"/odd_strokes", "/odd"} and counts["/odd_strokes"] > 300 and counts["/odd"] > 80
    for name, count in counts.items():
        assert f"{count:9d} {count:9d} {0:14d}  {name}" in record.said()
    assert "unknown  /never" in record.said()
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
    nothing = (0, 0, None)
    assert found == {name: (count, count, 0) for name, count in counts.items()} | {"/never": nothing, "/other": nothing}
    assert sheet["started"] < sheet["ended"]
    types = {"/odd_strokes": None, "/odd": None, "/never": "std_msgs/msg/String", "/other": JOINT_STATE}
    assert sheet["topics"] == types


def test_the_state_of_a_recording_is_published_until_its_disk_is_full(
    spawn: Callable[..., Any], new_rig: Callable[..., Rig], tmp_path: Path
) -> None:
    """The limit on the size of a file stands for the disk's. All that came before can be saved."""
    bag, rig = tmp_path / "bag", new_rig()

    def state(level: bytes) -> Any:
        """The newest one of a level, if any."""
        told = [status for msg in rig.diagnostics for status in msg.status if status.name == STATE and status.level == level]
        return told[-1] if told else None

    with Source("odd_strokes", JointState, strokes) as source:
        record = spawn("boom_twin.cli.main", "record", "--out", str(bag), "--topics", "odd_strokes:sensor_msgs/JointState")
        rig.until(lambda: received(rig, "/odd_strokes") > 300)
        values = {pair.key: pair.value for pair in state(b"\x00").values}
        assert values["never_arrived"] == values["never_arrived /odd_strokes"] == "0" and float(values["lag_s_warn"]) == 2.0
        assert int(values["disk_free_bytes"]) > 0 and float(values["disk_left_s"]) > 1800.0
        full = (bag / "session_0.mcap").stat().st_size + 10_000
        resource.prlimit(record.pid, resource.RLIMIT_FSIZE, (full, full))
        rig.until(lambda: state(b"\x02") is not None)
        assert record.end() == 1
    fault = [line for line in record.said().splitlines() if "cannot be written" in line]
    assert "Make room or choose another disk" in fault[-1] and "Traceback" not in record.said()
    assert "cannot be written" in state(b"\x02").message
    outcome = recover(bag, tmp_path / "out")
    saved = numbers(tmp_path / "out", "odd_strokes")
    assert saved == list(range(saved[0], saved[0] + len(saved))) and outcome.saved.total() == len(saved) > 300
    assert len(saved) < len(source.times)


def numbers(path: Path, topic: str) -> list[int]:
    """Those of the messages, see `strokes`."""
    return [round(1e6 * msg.position[0]) for _, _, msg in read(scan(path), {topic: JOINT_STATE})]


@pytest.mark.parametrize(
    "delay", [pytest.param(0.0, id="soon"), *(pytest.param(0.1 * k, marks=pytest.mark.slow, id=f"{k}") for k in range(10))]
)
def test_a_killed_recorder_loses_little(
    spawn: Callable[..., Any], new_rig: Callable[..., Rig], tmp_path: Path, delay: float
) -> None:
    """Every message that it told of a moment before is saved."""
    bag, rig = tmp_path / "bag", new_rig()
    with Source("cylinder_strokes", JointState, strokes):
        record = spawn("boom_twin.cli.main", "record", "--out", str(bag), "--topics", "cylinder_strokes")
        rig.until(lambda: received(rig, "/cylinder_strokes") > 200)
        told = received(rig, "/cylinder_strokes")
        rig.until(lambda: received(rig, "/cylinder_strokes") > told)  # a second later
        time.sleep(delay)
        assert record.stop(signal.SIGKILL) == -signal.SIGKILL
    outcome = recover(bag, tmp_path / "out")
    saved = numbers(tmp_path / "out", "cylinder_strokes")
    assert saved == list(range(saved[0], saved[0] + len(saved)))
    assert outcome.saved.total() == len(saved) >= told
    assert outcome.lost is None or not any(outcome.lost.values())
