"""The node lives through whatever a message holds, counts it, and goes on."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable, Iterator
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped
from sensor_msgs.msg import Imu, JointState

from boom_twin.io.intake import stamp_of

NAN, INF = float("nan"), float("inf")
NAMES = ["cylinder_1", "cylinder_2", "cylinder_3", "cylinder_4"]
LAST = 2**31 - 1


def _strokes(stamp: tuple[int, int], names: list[str], values: list[float]) -> JointState:
    msg = JointState(name=names, position=array("d", values))
    msg.header.stamp.sec, msg.header.stamp.nanosec = stamp
    return msg


class Bench:
    """Sends to a node and listens to it."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("bench")
        self.strokes = self.node.create_publisher(JointState, "cylinder_strokes", 100)
        self.imu = self.node.create_publisher(Imu, "tip_imu", 100)
        self.answers: list[int] = []
        self.diagnostics: list[DiagnosticArray] = []
        self.node.create_subscription(
            PointStamped, "/boom_twin/tip/position", lambda msg: self.answers.append(stamp_of(msg)), 100
        )
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self.diagnostics.append, 10)

    def until(self, condition: Callable[[], bool], patience: float = 60.0) -> None:
        end = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < end, self.statuses()
            rclpy.spin_once(self.node, timeout_sec=0.05)

    def statuses(self) -> dict[str, Any]:
        """The newest diagnostics by name."""
        return {status.name: status for status in self.diagnostics[-1].status} if self.diagnostics else {}

    def values(self, name: str) -> dict[str, str]:
        status = self.statuses().get(name)
        return {} if status is None else {pair.key: pair.value for pair in status.values}


@pytest.fixture
def bench(domain: None) -> Iterator[Bench]:
    made = Bench()
    yield made
    made.node.destroy_node()


@pytest.fixture
def node(spawn_node: Callable[..., Any]) -> Iterator[Any]:
    """An active node, gone after the test."""
    made = spawn_node()
    made.wait_for("active;")
    yield made
    made.close()


def test_garbage_is_counted_and_survived(node: Any, bench: Bench, motion: dict[str, Any]) -> None:
    bench.until(lambda: bench.strokes.get_subscription_count() == 1 and bench.imu.get_subscription_count() == 1)
    bench.until(lambda: bench.node.count_publishers("/boom_twin/tip/position") == 1 and bool(bench.diagnostics))
    start = [float(value) for value in motion["strokes"][0]]
    garbage = [
        _strokes((10, 0), [], []),
        _strokes((10, 0), ["elbow", "", "\u2603"], [1.0, 2.0, 3.0]),
        _strokes((10, 0), NAMES, [NAN] * 4),
        _strokes((10, 0), NAMES, [INF, -INF, 1e300, -1e300]),
        _strokes((10, 0), NAMES, start[:2]),
        _strokes((10, 0), NAMES[:1], start),
        _strokes((10, 0), NAMES, [50.0, -50.0, 50.0, -50.0]),
        _strokes((LAST, 4_294_967_295), NAMES, start),
        _strokes((-5, 0), NAMES, start),
        Imu(linear_acceleration_covariance=[-1.0, *[0.0] * 8]),
    ]
    garbage[-1].header.stamp.sec = 10
    for msg in garbage:
        (bench.imu if isinstance(msg, Imu) else bench.strokes).publish(msg)
    bench.strokes.publish(b"\x00\x01\x00\x00" + b"\xff" * 40)
    bench.until(lambda: bench.values("boom_twin: cylinder_strokes").get("messages") == str(len(garbage) - 1))
    bench.answers.clear()
    for k in range(20):
        bench.strokes.publish(_strokes((100, k * 5_000_000), NAMES, start))
    bench.until(lambda: len(bench.answers) >= 20)
    assert bench.answers == [100_000_000_000 + k * 5_000_000 for k in range(20)]

    bench.until(lambda: bench.values("boom_twin: cylinder_strokes").get("messages") == str(len(garbage) + 19))
    values = bench.values("boom_twin: model")
    for name, count in [
        ("messages: unknown names only", 2),
        ("messages: no usable value", 2),
        ("messages: absurd magnitude", 2),
        ("messages: not finite", 6),
        ("messages: unequal arrays", 2),
        ("messages: no measurement", 1),
    ]:
        assert values.get(name) == str(count), (name, values)
    assert int(values["samples: model"]) >= 1
    assert node.said().count("unequal arrays:") == 1
    assert node.stop() == 0


def test_diagnostics_follow_the_strokes(node: Any, bench: Bench, motion: dict[str, Any]) -> None:
    bench.until(lambda: bench.strokes.get_subscription_count() == 1)

    def shows(model: bytes, strokes: bytes) -> bool:
        found = bench.statuses()
        return bool(found) and (found["boom_twin: model"].level, found["boom_twin: cylinder_strokes"].level) == (
            model,
            strokes,
        )

    bench.until(lambda: shows(b"\x01", b"\x03"))
    assert bench.statuses()["boom_twin: model"].message == "waiting for strokes"
    assert bench.statuses()["boom_twin: tip_imu"].level == b"\x00"
    start = [float(value) for value in motion["strokes"][0]]
    bench.strokes.publish(_strokes((100, 0), NAMES, start))
    bench.until(lambda: shows(b"\x00", b"\x00"))
    assert bench.values("boom_twin: model")["newest stroke stamp"] == "100.000000000"
    bench.until(lambda: shows(b"\x01", b"\x03"))
    bench.strokes.publish(_strokes((101, 0), NAMES, [50.0, -50.0, 50.0, -50.0]))
    bench.strokes.publish(_strokes((200, 0), NAMES, [50.0, -50.0, 50.0, -50.0]))
    bench.until(lambda: shows(b"\x02", b"\x00"))
    assert node.stop() == 0
