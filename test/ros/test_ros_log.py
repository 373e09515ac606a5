"""Words of others in the log and on /diagnostics, and the turns in which callbacks run."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

pytest.importorskip("rclpy")

import rclpy
import rclpy.experimental
from rclpy.qos import QoSProfile, ReliabilityPolicy
from ros_messages import Output, load_topics
from ros_rig import Rig
from std_msgs.msg import UInt8
from std_srvs.srv import Trigger

from boom_twin.diagnostics.levels import Level, Status
from boom_twin.ros import receive
from boom_twin.ros.runtime import DiagnosticsPublisher

HOSTILE = "/rig\x1b[2J\n[INFO] [boom_twin]: all is well\u202e\x9b31m"
ESCAPED = r"/rig\x1b[2J\n[INFO] [boom_twin]: all is well\u202e\x9b31m"


def test_states_with_foreign_names_are_escaped(new_rig: Callable[..., Rig], capfd: pytest.CaptureFixture[str]) -> None:
    rig = new_rig()
    board = DiagnosticsPublisher(rig.node, load_topics().outputs[Output.DIAGNOSTICS])
    state = Status("publishers", Level.WARN, f"followed: {HOSTILE}", {"names": HOSTILE, "count": 2})
    rig.until(lambda: bool(rig.diagnostics), lambda: board.show([state]))
    (heard,) = rig.diagnostics[-1].status
    assert heard.message == f"followed: {ESCAPED}"
    assert {pair.key: pair.value for pair in heard.values} == {"names": ESCAPED, "count": "2"}
    logged = "".join(capfd.readouterr())
    assert logged.count(f"publishers: followed: {ESCAPED}") == 1 and HOSTILE not in logged


def test_nothing_is_lost_with_a_row_that_is_dropped(domain: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every turn drops the row of the one before; messages and requests stood in it."""
    monkeypatch.setattr(receive, "LATE", -1.0)
    node, peer, came, end = rclpy.create_node("turns"), rclpy.create_node("peer"), list[int](), time.monotonic() + 60.0
    qos = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)
    node.create_subscription(UInt8, "number", lambda message: came.append(message.data), qos)
    node.create_service(Trigger, "ask", lambda request, response: Trigger.Response(success=True))
    publisher, client = peer.create_publisher(UInt8, "number", qos), peer.create_client(Trigger, "ask")
    while not (client.service_is_ready() and publisher.get_subscription_count()):
        assert time.monotonic() < end
        time.sleep(0.05)
    answers = []
    with receive.CallbackTurns(node, lambda: False) as running:
        running.poll()
        for number in range(60):
            publisher.publish(UInt8(data=number))
            if number % 20 == 0:
                answers.append(client.call_async(Trigger.Request()))
                running.poll()
        while not (len(came) == 60 and all(answer.done() for answer in answers)):
            assert time.monotonic() < end, (came, answers)
            running.poll()
            rclpy.spin_once(peer, timeout_sec=0.01)
    assert came == list(range(60))
    node.destroy_node()
    peer.destroy_node()
