"""A node beside a rig with sensors of its own: one topic for all, other names and units; recorded, and replayed alike."""

from __future__ import annotations

import signal
import time
from array import array
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

import rclpy
from geometry_msgs.msg import PointStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState

from boom_twin import load_scene, replay
from boom_twin.bag.reader import read_both, scan
from boom_twin.messages.sample_decoder import stamp_of
from boom_twin.messages.topic_table import NODE, TYPES, Output
from boom_twin.ros.bag.recorder import COMPLETE
from boom_twin.types import Stream

MAPPING = """
inputs:
  cylinder_strokes: {name: /rig/joint_states, qos: {reliability: reliable, depth: 500}}
  joint_angles: {name: /rig/joint_states, qos: {reliability: reliable, depth: 500}}
outputs:
  tip_position: {qos: {durability: transient_local, depth: 1}}
sensors:
  cylinder_1: {name: lift, unit: mm, sign: -1, zero: 900.0}
  joint_2: {name: knee, unit: deg}
"""
ROWS = 300


@pytest.fixture
def mapping(tmp_path: Path) -> Path:
    path = tmp_path / "mapping.yaml"
    path.write_text(MAPPING)
    return path


def message(stamp: int, strokes: Any, angles: Any) -> JointState:
    names = ["spare", "cylinder_4", "cylinder_3", "cylinder_2", "lift"]
    values = [7.0, strokes[3], strokes[2], strokes[1], 900.0 - 1e3 * strokes[0]]
    if angles is not None:
        names, values = [*names, "joint_1", "knee", "joint_3", "joint_4"], [*values, *angles]
        values[6] = np.degrees(angles[1])
    msg = JointState(name=names, position=array("d", values))
    msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(stamp, 10**9)
    return msg


def test_live_and_replayed_alike(
    spawn: Callable[..., Any], spawn_node: Callable[..., Any], motion: dict[str, Any], mapping: Path, tmp_path: Path
) -> None:
    node = spawn_node("-p", f"mapping:={mapping}")
    node.wait_for("active; listening to /rig/joint_states, /tip_imu")
    recorder = spawn("boom_twin.cli.main", "record", "--out", str(tmp_path / "bag"), "--mapping", str(mapping))
    recorder.wait_for("recording")
    rig = rclpy.create_node("rig")
    publisher = rig.create_publisher(JointState, "/rig/joint_states", QoSProfile(depth=500))
    end = time.monotonic() + 60.0
    while publisher.get_subscription_count() < 2 or rig.count_subscribers("/boom_twin/residuals") < 1:
        assert time.monotonic() < end
        rclpy.spin_once(rig, timeout_sec=0.05)
    recorder.wait_for(COMPLETE)
    for row in range(ROWS):
        angles = motion["joints"][row] if row % 4 == 0 else None
        publisher.publish(message(int(motion["stamps_ns"][row]), motion["strokes"][row], angles))
        time.sleep(0.004)
    time.sleep(1.0)
    late: list[PointStamped] = []
    keeping = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    rig.create_subscription(PointStamped, "/boom_twin/tip/position", late.append, keeping)
    last = divmod(int(motion["stamps_ns"][ROWS - 1]), 10**9)
    while not late or (late[-1].header.stamp.sec, late[-1].header.stamp.nanosec) != last:
        assert time.monotonic() < end
        rclpy.spin_once(rig, timeout_sec=0.05)
    time.sleep(1.0)  # the recorder has the same messages to take
    rig.destroy_node()
    assert recorder.stop(signal.SIGINT) == 0, recorder.said()
    assert node.stop() == 0

    live = published(tmp_path / "bag")
    found = replay(tmp_path / "bag", load_scene(), tmp_path / "out")
    assert found.summary["mapping"].endswith("session.yaml, mapping") and found.summary["dropped"] == 0
    angles = found.recording.of(Stream.ANGLES)
    assert len(found.recording.predictions.stamps) == ROWS and len(angles.stamps) == ROWS // 4
    assert len(live) == 2 * ROWS  # positions; residuals of lengths from the second on, of angles with the first
    assert published(tmp_path / "out" / "bag") == live


def published(bag: Path) -> dict[tuple[str, int], bytes]:
    """Every residual and tip position, by topic and stamp, as it was encoded."""
    types = {f"/{NODE}/residuals": TYPES[Output.RESIDUALS], f"/{NODE}/tip/position": TYPES[Output.TIP_POSITION]}
    return {(name, stamp_of(msg)): data for name, _, data, msg in read_both(scan(bag), types)}


def test_a_mapping_that_cannot_be_used_is_told(spawn_node: Callable[..., Any], mapping: Path) -> None:
    mapping.write_text(MAPPING.replace("unit: mm", "unit: furlong").replace("joint_2", "joint_9"))
    node = spawn_node("-p", f"mapping:={mapping}")
    assert node.end() != 0
    assert "sensors.cylinder_1.unit = 'furlong'" in node.said() and "Traceback" not in node.said()
