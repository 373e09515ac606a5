"""Hostile messages among good ones: every good one is answered at once, and no other."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
from geometry_msgs.msg import PointStamped
from sensor_msgs.msg import JointState

from boom_twin.messages.sample_decoder import stamp_of

NAMES = [f"cylinder_{i}" for i in (1, 2, 3, 4)]
NAN = float("nan")


def strokes(stamp: int, names: list[str], values: list[float]) -> JointState:
    msg = JointState(name=names, position=array("d", values))
    msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(stamp, 10**9)
    return msg


def hostile(values: list[float], stamp: int) -> list[JointState]:
    return [
        strokes(0, NAMES, values),
        strokes((2**31 - 1) * 10**9, NAMES, values),
        strokes(10**9, NAMES, values),
        strokes(stamp, NAMES, [NAN] * 4),
        strokes(stamp, NAMES, [1e308, -1e308, 1e308, NAN]),
        strokes(stamp, NAMES, []),
        strokes(stamp, [], values),
        strokes(stamp, ["a", "b", "c", "d"], values),
        strokes(stamp, [f"n{i}" for i in range(5000)], values),
    ]


def test_every_good_sample_is_answered_and_no_other(spawn_node: Callable[..., Any], motion: dict[str, Any]) -> None:
    node = spawn_node()
    node.wait_for("active;")
    bench = rclpy.create_node("bench")
    publisher = bench.create_publisher(JointState, "cylinder_strokes", 1000)
    answers: list[int] = []
    bench.create_subscription(PointStamped, "/boom_twin/tip/position", lambda msg: answers.append(stamp_of(msg)), 1000)
    end = time.monotonic() + 60.0
    while publisher.get_subscription_count() < 1 or bench.count_publishers("/boom_twin/tip/position") < 1:
        assert time.monotonic() < end
        rclpy.spin_once(bench, timeout_sec=0.05)
    settled = time.monotonic() + 2.0  # the node may know of the two ends a moment after they know of it
    while time.monotonic() < settled:
        rclpy.spin_once(bench, timeout_sec=0.05)
    end = time.monotonic() + 60.0
    stamps = motion["stamps_ns"][:100].tolist()
    for number, stamp in enumerate(stamps):
        values = motion["strokes"][number].tolist()
        publisher.publish(strokes(stamp, NAMES, values))
        if number % 10 == 5:
            for msg in hostile(values, stamp + 1_000_000):
                publisher.publish(msg)
        spent = time.monotonic() + 0.01
        while time.monotonic() < spent:
            rclpy.spin_once(bench, timeout_sec=0.002)
    while len(answers) < len(stamps) and time.monotonic() < end:
        rclpy.spin_once(bench, timeout_sec=0.05)
    bench.destroy_node()
    assert answers == stamps
    odd = ("leap", "no stamp", "not finite", "absurd magnitude", "unequal arrays", "unknown names only", "too many names")
    for name in odd:
        assert node.said().count(f"{name}:") == 1, name
    assert "too many names: more than 1000 in a message" in node.said() and "seen in a message" not in node.said()
    assert node.stop() == 0
