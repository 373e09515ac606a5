"""The live monitor as a process, beside a publisher of malformed messages: it shows the good ones and tells of the others."""

from __future__ import annotations

import asyncio
import json
import re
import time
from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("aiohttp")

import rclpy
from aiohttp import ClientSession, WSMsgType
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Vector3Stamped
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

EPOCH = 1_700_000_000
NAMES = [f"cylinder_{i}" for i in (1, 2, 3, 4)]
WANTED = {
    "/boom_twin/joint_states": "4 names, but 4 of position, 0 of effort",
    "/boom_twin/shape": "no lines of the boom",
    "/boom_twin/residuals": "not 'tip_imu_x'",
    "/boom_twin/tip/displacement": "a number is nan",
}
PATIENCE = 60.0


class Publishers:
    """Good displacements, and in each round one malformed message of each kind."""

    def __init__(self) -> None:
        self.node, self.rows = rclpy.create_node("hostile"), 0
        kinds = {"joint_states": JointState, "residuals": JointState, "shape": MarkerArray, "tip/displacement": Vector3Stamped}
        self._topics = {name: self.node.create_publisher(kind, f"/boom_twin/{name}", 10) for name, kind in kinds.items()}
        self._topics["/diagnostics"] = self.node.create_publisher(DiagnosticArray, "/diagnostics", 10)

    def are_heard(self) -> bool:
        return all(publisher.get_subscription_count() for publisher in self._topics.values())

    def send(self, name: str, message: Any) -> None:
        if hasattr(message, "header"):
            message.header.stamp.sec, message.header.stamp.nanosec = EPOCH, 5_000_000 * self.rows
        self._topics[name].publish(message)

    def round(self, scene: str) -> None:
        self.rows += 1
        self.send("tip/displacement", Vector3Stamped())
        self.send("joint_states", JointState(name=NAMES, position=[0.1] * 4))
        self.send("residuals", JointState(name=["tip_imu_x"], position=[0.1], velocity=[0.1], effort=[0.1]))
        self.send("shape", MarkerArray())
        broken = Vector3Stamped()
        broken.vector.x = float("nan")
        self.send("tip/displacement", broken)
        self._topics["shape"].publish(b"\x00\x01\x00\x00" + b"\xff" * 40)
        model = DiagnosticStatus(name="boom_twin: model", message="well", values=[KeyValue(key="scene", value=scene)])
        self.send("/diagnostics", DiagnosticArray(status=[model]))


async def told(url: str, others: Publishers, scene: str) -> dict[str, Any]:
    """The first state of the page in which all is told, once rows have come."""
    headers, rows = {"Origin": url.rstrip("/")}, 0
    async with (
        asyncio.timeout(PATIENCE),
        ClientSession() as session,
        session.ws_connect(f"{url}socket", headers=headers, max_msg_size=0) as link,
    ):
        while True:
            others.round(scene)
            message = await link.receive()
            if message.type is WSMsgType.BINARY:
                rows += 1
                continue
            assert message.type is WSMsgType.TEXT, message
            found = json.loads(message.data)
            if found["kind"] == "state" and rows > 3 and set(WANTED) <= {loss["topic"] for loss in found["dropped"]}:
                return dict(found)


def test_malformed_messages_are_told_on_the_page_and_the_good_ones_shown(
    domain: None, spawn: Callable[..., Any], tmp_path: Any
) -> None:
    monitor, others, scene = spawn("boom_twin.cli.main", "monitor", "--port", "0"), Publishers(), tmp_path / "scene.yaml"
    scene.write_text("never to be read")
    monitor.wait_for("open http")
    url = re.search(r"open (http\S+)", monitor.said())[1]
    end = time.monotonic() + PATIENCE
    while not others.are_heard():
        assert time.monotonic() < end
        time.sleep(0.05)
    state = asyncio.run(told(url, others, str(scene)))
    losses = {loss["topic"]: loss for loss in state["dropped"]}
    for topic, reason in WANTED.items():
        assert losses[topic]["count"] >= 1
        assert reason in losses[topic]["reason"] or topic.endswith("shape"), losses
    assert all(f"dropped message 1 of {topic}: " in monitor.said() for topic in WANTED)
    assert "Traceback" not in monitor.said() and len(monitor.said().splitlines()) < 50
    others.node.destroy_node()
    assert monitor.stop() == 0
