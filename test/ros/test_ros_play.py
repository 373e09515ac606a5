"""`boom_twin play` as a process, heard from here."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from boom_twin.io.intake import stamp_of


def test_a_part_of_a_session_with_its_clock(spawn: Callable[..., Any], bag: Path, motion: dict[str, Any]) -> None:
    strokes: list[JointState] = []
    ticks: list[int] = []
    node = rclpy.create_node("listener")
    qos = QoSProfile(depth=2000, reliability=ReliabilityPolicy.BEST_EFFORT)
    node.create_subscription(JointState, "cylinder_strokes", strokes.append, qos)
    node.create_subscription(Clock, "/clock", lambda msg: ticks.append(msg.clock.sec * 10**9 + msg.clock.nanosec), qos)
    part = ["--start", "1", "--duration", "2", "--rate", "2", "--clock"]
    play = spawn("boom_twin.cli.main", "play", str(bag), *part, "--wait", "5")
    end = time.monotonic() + 60.0
    while "sent in" not in play.said() and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.05)
    node.destroy_node()
    assert play.end() == 0, play.said()
    assert "nobody listens to joint_angles, tip_imu" in play.said()
    first = int(motion["stamps_ns"].min())
    assert 390 <= len(strokes) <= 401
    assert all(first + 10**9 <= stamp_of(msg) < first + 3 * 10**9 for msg in strokes)
    rows = {int(stamp): row for row, stamp in enumerate(motion["stamps_ns"])}
    for msg in strokes:
        assert list(msg.position) == motion["strokes"][rows[stamp_of(msg)]].tolist()
    assert 70 <= len(ticks) <= 81
    assert {after - before for before, after in pairwise(ticks)} == {25_000_000}


def test_nobody_listens(spawn: Callable[..., Any], bag: Path) -> None:
    play = spawn("boom_twin.cli.main", "play", str(bag), "--wait", "0.5")
    assert play.end() == 1
    assert "boom_twin play: nobody listened within 0.5 s" in play.said()


def test_no_such_part(spawn: Callable[..., Any], bag: Path) -> None:
    play = spawn("boom_twin.cli.main", "play", str(bag), "--wait", "0", "--start", "10")
    assert play.end() == 1
    assert "nothing from 10 s on; the session lasts 4.0 s" in play.said()


def test_nothing_to_record(spawn: Callable[..., Any], tmp_path: Path) -> None:
    record = spawn("boom_twin.cli.main", "record", "--out", str(tmp_path / "bag"), "--duration", "0.5")
    assert record.end() == 1
    assert "nothing came" in record.said()
    assert (tmp_path / "bag" / "metadata.yaml").is_file()
