"""Turns in which callbacks run: messages come with their information, a turn ends when it is due, by either executor."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
import rclpy.experimental
from std_msgs.msg import String

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
