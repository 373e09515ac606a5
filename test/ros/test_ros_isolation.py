"""Demonstrations, tests and benchmarks neither feed a live rig on the same computer nor are fed by it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
from demo import isolation as module
from demo.isolation import Isolation
from eventually import eventually
from ros_rig import spin_until
from sensor_msgs.msg import JointState

TOPIC = "cylinder_strokes"
RIG = f"""
import sys, time, rclpy
from sensor_msgs.msg import JointState
rclpy.init(args=[])
node = rclpy.create_node("some_rig")
publisher = node.create_publisher(JointState, "{TOPIC}", 10)
def hear(msg):
    if msg.name != ["rig"]:
        print("fed by", msg.name[0], flush=True)
node.create_subscription(JointState, "{TOPIC}", hear, 10)
print("there", flush=True)
while True:
    publisher.publish(JointState(name=["rig"]))
    rclpy.spin_once(node, timeout_sec=0.02)
"""
"""A program of somebody else, with the twin's default topics."""
FREE = ("FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_AUTOMATIC_DISCOVERY_RANGE")


@contextmanager
def rig_in(domain: int, log: Path) -> Iterator[None]:
    """It runs, in the same domain, and knows nothing of isolation."""
    known = {name: value for name, value in os.environ.items() if name not in FREE} | {"ROS_DOMAIN_ID": str(domain)}
    with log.open("w") as file, subprocess.Popen([sys.executable, "-c", RIG], env=known, stdout=file, stderr=file) as process:
        try:
            eventually(lambda: _says(log, "there"), 120.0)
            yield
        finally:
            process.kill()


def _says(log: Path, word: str) -> None:
    assert word in log.read_text()


def test_a_rig_in_the_same_domain_neither_feeds_nor_is_fed(isolation: Isolation, domain: None, tmp_path: Path) -> None:
    heard: list[str] = []
    node = rclpy.create_node("isolated")
    publisher = node.create_publisher(JointState, TOPIC, 10)
    node.create_subscription(JointState, TOPIC, lambda msg: heard.append(msg.name[0]), 10)

    def send() -> None:
        publisher.publish(JointState(name=["isolated"]))
        rclpy.spin_once(node, timeout_sec=0.02)

    def is_seen() -> bool:
        send()
        return len(node.get_publishers_info_by_topic(TOPIC)) == 2

    with rig_in(isolation.domain, tmp_path / "rig"):
        spin_until(node, is_seen)  # discovered, so it would be heard
        spin_until(node, lambda: is_seen() and len(heard) > 50)
    node.destroy_node()
    assert set(heard) == {"isolated"}
    assert "fed by" not in (tmp_path / "rig").read_text()


def test_a_demonstration_refuses_a_domain_in_use(
    isolation: Isolation, bag: Path, spawn: Callable[..., Any], demo_path: None, tmp_path: Path
) -> None:
    with rig_in(free := unclaimed(), tmp_path / "rig"):
        process = spawn("demo.demo", "--bag", str(bag), "--out", str(tmp_path / "out"), "--domain", str(free))
        assert process.end() == 1
    assert f"ROS domain {free} is in use" in process.said() and "Traceback" not in process.said()
    assert "/some_rig" in process.said() or "a node without a known name" in process.said()
    assert f"publishes /{TOPIC}" in process.said() or f"listens to /{TOPIC}" in process.said()
    assert not (tmp_path / "out").exists()


def unclaimed() -> int:
    """A domain that nobody has claimed a moment ago."""
    claimed, lock = module._claim(module._preferred())
    lock.close()
    return claimed
