"""What a node says of itself on /diagnostics while its inputs come, go and go wrong."""

from __future__ import annotations

import subprocess
import sys
import time
from array import array
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

import rclpy
from geometry_msgs.msg import PointStamped
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState

from boom_twin.diagnostics.topic_status import Peers
from boom_twin.messages.topic_table import Output, load_topics
from boom_twin.ros.node.diagnostics import GraphPeers
from boom_twin.types import Stream

OK, WARN, ERROR, STALE = b"\x00", b"\x01", b"\x02", b"\x03"
NAMES = ["cylinder_1", "cylinder_2", "cylinder_3", "cylinder_4"]
PROMPT = ["-p", "raise_after:=0.0", "-p", "clear_after:=0.0"]


def _strokes(stamp: int, values: list[float]) -> JointState:
    msg = JointState(name=NAMES, position=array("d", values))
    msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(stamp, 10**9)
    return msg


@pytest.fixture
def prompt(spawn_node: Callable[..., Any]) -> Iterator[Any]:
    """An active node that tells every level at once."""
    made = spawn_node(*PROMPT)
    made.wait_for("active;")
    yield made
    made.close()


def test_diagnostics_follow_the_strokes(node: Any, bench: Any, motion: dict[str, Any]) -> None:
    bench.until_matched()

    def shows(model: bytes, strokes: bytes) -> bool:
        found = bench.statuses()
        names = ["boom_twin: model", "boom_twin: cylinder_strokes"]
        return set(names) <= set(found) and [found[name].level for name in names] == [model, strokes]

    bench.until(lambda: shows(WARN, STALE))
    assert bench.statuses()["boom_twin: model"].message == "waiting for strokes"
    assert bench.statuses()["boom_twin: tip_imu"].level == OK
    start = motion["strokes"][0].tolist()
    bench.strokes.publish(_strokes(100 * 10**9, start))
    bench.until(lambda: shows(OK, OK))
    assert bench.values("boom_twin: cylinder_strokes")["newest_stamp_s"] == "100.000000000"
    bench.until(lambda: shows(WARN, STALE))
    for k in range(40):  # the first one is held until the next confirms that time has stepped
        bench.strokes.publish(_strokes(200 * 10**9 + k * 5_000_000, [50.0, -50.0, 50.0, -50.0]))
    bench.until(lambda: shows(ERROR, OK))
    assert node.said().count("silent for") == 1  # a line for the topic, its sensors and the model
    assert node.said().count("newest stamp is") == 1 and "set use_sim_time or play with --clock" in node.said()
    assert node.stop() == 0


def test_faults_of_sensors_are_told_and_taken_back(prompt: Any, bench: Any, motion: dict[str, Any]) -> None:
    """Cylinder 1 is well, 2 is frozen, 3 misses every fourth value, 4 is out of range; then all are well."""
    bench.until_matched()
    random, start = np.random.default_rng(2), motion["strokes"][0]
    sick, next_at, count = True, time.monotonic(), 0

    def levels() -> list[bytes]:
        """Publish for a moment, at 100 Hz; then what is said of the four."""
        nonlocal next_at, count
        values = start + random.normal(0.0, 2e-5, 4)
        if sick:
            values[1] = start[1]
            values[2] = float("nan") if count % 4 == 3 else values[2]
            values[3] = -0.01 if count else values[3]
        bench.strokes.publish(_strokes(time.time_ns(), values.tolist()))
        count, next_at = count + 1, next_at + 0.01
        time.sleep(max(0.0, next_at - time.monotonic()))
        found = bench.statuses()
        return [found[name].level for i in (1, 2, 3, 4) if (name := f"boom_twin: sensor cylinder_{i}") in found]

    bench.until(lambda: levels() == [OK, ERROR, WARN, ERROR])
    frozen = bench.values("boom_twin: sensor cylinder_2")
    assert float(frozen["unchanged_s"]) > float(frozen["unchanged_s_error"]) == 1.0
    assert abs(float(frozen["since_s"]) - time.time()) < 60.0
    assert float(bench.values("boom_twin: sensor cylinder_3")["missing_share"]) == pytest.approx(0.25, abs=0.05)
    assert "out of -0.0001 to" in bench.statuses()["boom_twin: sensor cylinder_4"].message
    assert 10.0 < float(bench.values("boom_twin: cylinder_strokes")["rate_Hz"]) < 200.0
    assert 0.0 < float(bench.values("boom_twin: model")["load"]) < 1.0
    sick = False
    bench.until(lambda: levels() == [OK] * 4)
    assert prompt.stop() == 0


def test_thresholds_change_while_the_node_runs(prompt: Any, bench: Any) -> None:
    def level() -> bytes | None:
        found = bench.statuses().get("boom_twin: cylinder_strokes")
        return None if found is None else found.level

    def set_to(value: float) -> Any:
        future = client.set_parameters([Parameter("stale_after", value=value)])
        bench.until(future.done)
        return future.result().results[0]

    client = AsyncParameterClient(bench.node, "boom_twin")
    bench.until(lambda: level() == STALE)
    assert set_to(1e6).successful
    bench.until(lambda: level() == OK)
    refused = set_to(-1.0)
    assert not refused.successful and "stale_after" in refused.reason
    assert prompt.stop() == 0


def test_who_is_at_the_other_end(prompt: Any, bench: Any, motion: dict[str, Any]) -> None:
    """A second publisher of the strokes, and a subscriber that asks for more than is offered."""
    bench.until(lambda: bench.statuses().get("boom_twin: outputs") is not None)
    assert bench.statuses()["boom_twin: outputs"].level == OK, bench.statuses()["boom_twin: outputs"]
    other = rclpy.create_node("other", namespace="rig")
    other.create_publisher(JointState, "/cylinder_strokes", 10)
    kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    other.create_subscription(PointStamped, "/boom_twin/tip/position", lambda msg: None, kept)

    def told(name: str) -> str:
        status = bench.statuses().get(f"boom_twin: {name}")
        return status.message if status is not None and status.level != OK else ""

    bench.until(lambda: "2 publishers of /cylinder_strokes" in told("publishers"))
    assert bench.statuses()["boom_twin: publishers"].level == ERROR
    assert all(name in told("publishers") for name in ("/bench", "/rig/other"))
    bench.until(lambda: "/boom_twin/tip/position: incompatible QoS: /rig/other:" in told("outputs"))
    other.destroy_node()
    bench.until(lambda: told("outputs") == told("publishers") == "")
    assert prompt.stop() == 0


def test_a_second_node_of_the_same_name_is_told(prompt: Any, bench: Any) -> None:
    """Both answer every stroke on the same topics, and nobody who listens can tell them apart."""

    def told() -> str:
        status = bench.statuses().get("boom_twin: outputs")
        return status.message if status is not None and status.level == ERROR else ""

    bench.until(lambda: bench.statuses().get("boom_twin: outputs") is not None)
    assert not told()
    other = rclpy.create_node("boom_twin")
    other.create_publisher(PointStamped, "~/tip/position", 10)
    bench.until(lambda: told().startswith("1 of them are published by another node too: give each node a namespace"))
    other.destroy_node()
    bench.until(lambda: not told())
    assert prompt.stop() == 0


def test_ends_of_another_type_are_told(domain: None) -> None:
    """Nothing of them arrives, and DDS does not say why; discovery tells their type, from another process."""
    code = """
import rclpy, sys, time
from std_msgs.msg import String
rclpy.init()
driver = rclpy.create_node("driver")
sends = driver.create_publisher(String, "/cylinder_strokes", 10)
hears = driver.create_subscription(String, "/boom_twin/shape", print, 10)
sys.stdin.read()
"""
    driver = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE)
    node = rclpy.create_node("boom_twin")
    book, end = GraphPeers(node, load_topics()), time.monotonic() + 60.0
    strokes = shape = Peers()
    while not all("/driver: " in "".join(each.mistyped) for each in (strokes, shape)) and time.monotonic() < end:
        book.look()
        strokes, shape = book.publishers[Stream.STROKES], book.subscribers[Output.SHAPE]
        time.sleep(0.02)
    assert strokes.mistyped == ("/driver: std_msgs/msg/String, not sensor_msgs/msg/JointState",) and strokes.names == ()
    assert shape.mistyped == ("/driver: std_msgs/msg/String, not visualization_msgs/msg/MarkerArray",)
    driver.communicate()
    node.destroy_node()


def test_a_publisher_that_cannot_be_heard_is_named(domain: None) -> None:
    topics = load_topics()
    imu = topics.inputs[Stream.IMU]
    strict = imu.model_copy(update={"qos": imu.qos.model_copy(update={"reliability": "reliable"})})
    topics = topics.model_copy(update={"inputs": topics.inputs | {Stream.IMU: strict}})
    node, driver = rclpy.create_node("strict"), rclpy.create_node("driver")
    driver.create_publisher(Imu, "tip_imu", QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT))
    book, end = GraphPeers(node, topics), time.monotonic() + 30.0
    while not book.publishers[Stream.IMU].incompatible and time.monotonic() < end:
        book.look()
        time.sleep(0.02)
    found = book.publishers[Stream.IMU]
    assert found.address == "/tip_imu" and "/driver" in found.names
    assert found.incompatible == ("/driver: Best effort publisher and reliable subscription",)
    node.destroy_node()
    driver.destroy_node()
