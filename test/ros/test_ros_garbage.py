"""The node lives through whatever a message holds, counts it, and goes on."""

from __future__ import annotations

from array import array
from typing import Any

import pytest

pytest.importorskip("rclpy")

from sensor_msgs.msg import Imu, JointState

NAN, INF = float("nan"), float("inf")
NAMES = ["cylinder_1", "cylinder_2", "cylinder_3", "cylinder_4"]
LAST = 2**31 - 1


def _strokes(stamp: tuple[int, int], names: list[str], values: list[float]) -> JointState:
    msg = JointState(name=names, position=array("d", values))
    msg.header.stamp.sec, msg.header.stamp.nanosec = stamp
    return msg


def test_garbage_is_counted_and_survived(node: Any, bench: Any, motion: dict[str, Any]) -> None:
    bench.until_matched()
    bench.until(lambda: bench.imu.get_subscription_count() == 1)
    bench.until(lambda: bench.node.count_publishers("/boom_twin/tip/position") == 1 and bool(bench.diagnostics))
    start = [float(value) for value in motion["strokes"][0]]
    garbage = [
        _strokes((10, 0), [], []),
        _strokes((10, 0), ["elbow", "", "\u2603"], [1.0, 2.0, 3.0]),
        _strokes((10, 0), NAMES, [NAN] * 4),
        _strokes((10, 0), NAMES, [INF, -INF, 1e300, -1e300]),
        _strokes((10, 0), NAMES, start[:2]),
        _strokes((10, 0), NAMES[:1], start),
        _strokes((10, 0), NAMES, [50.0, -50.0, 50.0, -50.0]),
        _strokes((LAST, 4_294_967_295), NAMES, start),
        _strokes((-5, 0), NAMES, start),
        Imu(linear_acceleration_covariance=[-1.0, *[0.0] * 8]),
    ]
    garbage[-1].header.stamp.sec = 10
    for msg in garbage:
        (bench.imu if isinstance(msg, Imu) else bench.strokes).publish(msg)
    bench.strokes.publish(b"\x00\x01\x00\x00" + b"\xff" * 40)
    bench.until(
        lambda: bench.values("boom_twin: cylinder_strokes").get("messages") == str(len(garbage) - 2)
    )  # a sign of life is none
    bench.answers.clear()
    for k in range(20):
        bench.strokes.publish(_strokes((100, k * 5_000_000), NAMES, start))
    bench.until(lambda: len(bench.answers) >= 20)
    assert bench.answers == [100_000_000_000 + k * 5_000_000 for k in range(20)]

    bench.until(lambda: bench.values("boom_twin: cylinder_strokes").get("messages") == str(len(garbage) + 18))
    values = bench.values("boom_twin: model")
    for name, count in [
        ("messages: unknown names only", 1),
        ("messages: no usable value", 2),
        ("messages: absurd magnitude", 2),
        ("messages: not finite", 6),
        ("messages: unequal arrays", 2),
        ("messages: no measurement", 1),
    ]:
        assert values.get(name) == str(count), (name, values)
    assert int(values["samples: model"]) >= 1
    assert node.said().count("unequal arrays:") == 1
    assert node.stop() == 0
