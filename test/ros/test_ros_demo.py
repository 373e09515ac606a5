"""The demonstration as processes of its own, which neither feed a rig on the same computer nor are fed by it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest

pytest.importorskip("rclpy")

import rclpy
from demo.isolation import Isolation
from eventually import eventually
from recordings import scan
from ros_rig import spin_until
from sensor_msgs.msg import JointState

PUMP = Path(__file__).parents[2] / "bags" / "pump_session"

pytestmark = pytest.mark.usefixtures("demo_path")


def test_a_short_demonstration(spawn: Callable[..., Any], tmp_path: Path) -> None:
    """Of the session that has every sensor."""
    demo = spawn("demo.demo", "--bag", str(PUMP), "--duration", "2", "--out", str(tmp_path / "out"))
    assert demo.end() == 0, demo.said()
    rows = dict(line.split("  ", 1) for line in demo.said().splitlines() if "  " in line)
    (position, acceleration), (place, motion) = (
        map(float, re.findall(r"[\d.]+(?= mm| m/s)", rows[f"tip error, {source}"])) for source in ("prediction", "estimate")
    )
    assert place <= position < 5.0 and motion < acceleration < 1.0
    assert " N rms" in rows["residual cylinder_force_4"] and " mrad rms" in rows["residual joint_1"]
    sent, arrived = int(rows["stroke samples sent"]), int(rows["predictions received"])
    assert 0 < arrived <= sent == pytest.approx(400, abs=1)  # a busy machine loses some
    assert (tmp_path / "out" / "replay" / "tip.png").stat().st_size > 10_000
    assert (tmp_path / "out" / "recorded" / "metadata.yaml").is_file()


def test_the_live_demonstration_shows_its_page_and_ends_in_order(spawn: Callable[..., Any], bag: Path, tmp_path: Path) -> None:
    demo = spawn("demo.demo_live", "--bag", str(bag), "--port", "0", "--out", str(tmp_path))
    url = demo.wait_for("in a browser").split("open ")[1].split()[0]
    assert b"boom twin" in urlopen(url).read()
    children = demo.children
    assert demo.stop(signal.SIGINT) == 0, demo.said()
    assert len(children) == 3 and not any(Path(f"/proc/{pid}").exists() for pid in children)
    assert "Traceback" not in demo.said() and scan(tmp_path / "recorded").topics


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
