"""Turns in which callbacks run: messages come with their information, a turn ends when it is due, by either executor."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
import rclpy.experimental
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String, UInt8
from std_srvs.srv import Trigger

from boom_twin.ros import runtime


@pytest.mark.parametrize("is_missing", [False, True])
def test_messages_come_with_their_information_and_turns_end_when_due(
    domain: None, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], is_missing: bool
) -> None:
    if is_missing:
        monkeypatch.delattr(rclpy.experimental, "EventsExecutor")
    node, came = rclpy.create_node("turns"), list[Mapping[str, Any]]()
    node.create_subscription(String, "text", runtime.with_information(lambda data, info: came.append(info)), 10, raw=True)
    publisher, end, due, sent = node.create_publisher(String, "text", 10), time.monotonic() + 60.0, 0.0, 0
    with runtime.CallbackTurns(node, lambda: time.monotonic() >= due) as running:
        while len(came) < 3 and time.monotonic() < end:
            if publisher.get_subscription_count() and sent < 3:
                publisher.publish(String(data="x" * 100))
                sent += 1
            due = time.monotonic() + 0.3
            running.run()  # it ends though nothing more comes
    assert [info["publication_sequence_number"] for info in came] == [1, 2, 3]
    assert capfd.readouterr().err.count("events executor: ") == is_missing and not list(node.timers)
    node.destroy_node()


def test_nothing_is_lost_with_a_row_that_is_dropped(domain: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every turn drops the row of the one before; messages and requests stood in it."""
    monkeypatch.setattr(runtime, "LATE", -1.0)
    node, peer, came, end = rclpy.create_node("turns"), rclpy.create_node("peer"), list[int](), time.monotonic() + 60.0
    qos = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)
    node.create_subscription(UInt8, "number", lambda message: came.append(message.data), qos)
    node.create_service(Trigger, "ask", lambda request, response: Trigger.Response(success=True))
    publisher, client = peer.create_publisher(UInt8, "number", qos), peer.create_client(Trigger, "ask")
    while not (client.service_is_ready() and publisher.get_subscription_count()):
        assert time.monotonic() < end
        time.sleep(0.05)
    answers = []
    with runtime.CallbackTurns(node, lambda: False) as running:
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
