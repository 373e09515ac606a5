"""What a node says of itself on /diagnostics while its inputs come, go and go wrong."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

import rclpy
from geometry_msgs.msg import PointStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from ros_rig import Rig, joint_state
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

from boom_twin.texts import alarm_text
from boom_twin.types import SECOND

OK, WARN, ERROR, STALE = range(4)


@pytest.fixture(scope="module")
def node(spawn_node: Callable[..., Any], reliable: list[str]) -> Any:
    """An active node that tells every level at once."""
    made = spawn_node(*reliable, "-p", "raise_after:=0.0", "-p", "clear_after:=0.0")
    made.wait_for("active;")
    return made


@pytest.fixture(scope="module")
def rig(node: Any, new_rig: Callable[..., Rig]) -> Rig:
    return new_rig()


def test_inputs_come_and_go(node: Any, rig: Rig, remote: Any) -> None:
    def shows(model: int, strokes: int) -> bool:
        return (rig.level("model"), rig.level("cylinder_strokes")) == (model, strokes)

    rig.until(lambda: shows(WARN, STALE))
    assert rig.words("model") == "waiting for strokes" and rig.level("tip_imu") == OK
    assert not remote.set("stale_after", -1.0).successful
    rig.until(lambda: shows(OK, OK), rig.send)
    sent = f"{rig.stamp // SECOND}.{rig.stamp % SECOND:09d}"
    rig.until(lambda: rig.values("cylinder_strokes")["newest_stamp_s"] == sent)
    rig.until(lambda: shows(WARN, STALE))
    assert remote.set("stale_after", 1e6).successful  # thresholds change while the node runs
    rig.until(lambda: rig.level("cylinder_strokes") == OK)
    assert "silent" in node.said() and "set use_sim_time or play with --clock" in node.said()
    well, rig.strokes = rig.strokes, np.array([50.0, -50.0, 50.0, -50.0])
    rig.until(lambda: shows(ERROR, OK), rig.send)
    rig.strokes = well


def test_faults_of_sensors_are_told_and_taken_back(rig: Rig) -> None:
    """Cylinder 1 is well, 2 is stuck, 3 misses every fourth value, 4 is noisy; then all are well."""
    random, count = np.random.default_rng(2), 0

    def send(is_sick: bool) -> None:
        nonlocal count
        values, count, rig.stamp = rig.strokes + random.normal(0.0, 2e-5, 4), count + 1, rig.stamp + 5_000_000
        if is_sick:
            values[1], values[3] = rig.strokes[1], rig.strokes[3] + random.normal(0.0, 2e-4)
            values[2] = float("nan") if count % 4 == 3 else values[2]
        rig.publishers["cylinder_strokes"].publish(joint_state(rig.stamp, "cylinder", values))

    def levels() -> list[int]:
        return [rig.level(f"sensor cylinder_{i}") for i in (1, 2, 3, 4)]

    rig.until(lambda: levels() == [OK] * 4 and rig.level("swing") == OK, lambda: send(False))  # predictions have begun
    rig.until(lambda: levels() == [OK, ERROR, ERROR, ERROR], lambda: send(True))
    assert alarm_text("cylinder_2", "stuck", None) in rig.words("sensor cylinder_2")
    assert 0.0 < float(rig.values("sensor cylinder_3")["missing_share"]) < 0.5
    assert alarm_text("cylinder_4", "noise", None) in rig.words("sensor cylinder_4")
    rig.until(lambda: levels() == [OK] * 4, lambda: send(False))


def test_who_is_at_the_other_end(node: Any, rig: Rig) -> None:
    """Two publishers of the strokes, ends that cannot be heard and of another type, and a second node of the same name."""
    rig.until(lambda: rig.level("outputs") == OK)
    other = rclpy.create_node("other", namespace="rig")
    other.create_publisher(JointState, "/cylinder_strokes", 10)
    other.create_publisher(Imu, "/tip_imu", QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT))
    other.create_publisher(String, "/cylinder_forces", 10)
    kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    other.create_subscription(PointStamped, "/boom_twin/tip/position", print, kept)
    rig.until(lambda: "several publishers of /cylinder_strokes" in rig.words("publishers"))
    assert rig.level("publishers") == ERROR
    assert all(name in rig.words("publishers") for name in ("/rig", "/rig/other"))
    rig.until(lambda: "/boom_twin/tip/position: incompatible QoS: /rig/other:" in rig.words("outputs"))
    rig.until(lambda: "/rig/other: Best effort publisher and reliable subscription" in rig.words("tip_imu"))
    told = "/cylinder_forces: another type of message: /rig/other: std_msgs/msg/String, not sensor_msgs/msg/JointState"
    rig.until(lambda: told in node.said())
    other.destroy_node()
    rig.until(lambda: rig.words("outputs") == rig.words("publishers") == "")

    second = rclpy.create_node("boom_twin", start_parameter_services=False)
    second.create_publisher(PointStamped, "~/tip/position", 10)
    rig.until(lambda: rig.words("outputs").startswith("another node publishes them too: give each node a namespace"))
    assert rig.level("outputs") == ERROR
    second.destroy_node()
    rig.until(lambda: not rig.words("outputs"))
    assert node.stop() == 0
