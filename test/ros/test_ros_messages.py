"""A node that hears hostile and malformed messages among good ones: every good one is answered, and no other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from ros_messages import PADDING

pytest.importorskip("rclpy")

from rclpy.serialization import serialize_message
from ros_messages import TYPES, decode, jazzy
from ros_rig import joint_state
from sensor_msgs.msg import Imu

from boom_twin import Stream
from boom_twin.types import SECOND

NAN, INF = float("nan"), float("inf")
NAMES = [f"cylinder_{i}" for i in (1, 2, 3, 4)]
LAST = 2**31 * SECOND - 1
TOLD = (
    "leap", "no stamp", "not finite", "absurd magnitude", "unequal arrays", "unknown names only", "too many names",
    "no usable value", "no measurement",
)  # fmt: skip


def hostile(values: list[float], stamp: int) -> list[Any]:
    return [
        joint_state(0, NAMES, values),
        joint_state(SECOND, NAMES, values),
        joint_state(-5 * SECOND, NAMES, values),
        joint_state(LAST, NAMES, values),
        joint_state(stamp, NAMES, [NAN] * 4),
        joint_state(stamp, NAMES, [1e308, -1e308, INF, NAN]),
        joint_state(stamp, NAMES, []),
        joint_state(stamp, [], values),
        joint_state(stamp, [], []),
        joint_state(stamp, ["elbow", "", "\u2603", "d"], values),
        joint_state(stamp, [f"n{i}" for i in range(5000)], values),
        b"\x00\x01\x00\x00" + b"\xff" * 40,
    ]


def raw(stamp: int, values: list[float], form: int) -> Any:
    """A good message as rclpy encodes it, with what it leaves behind its end; of the other endianness; or with more behind."""
    data = bytes(serialize_message(joint_state(stamp, NAMES, values)))
    kind = TYPES[Stream.STROKES]
    turned = bytes(jazzy().serialize_cdr(decode(data, kind), kind, little_endian=False))
    return [data, turned, turned + b"\x01" * PADDING][form % 3]


def test_every_good_sample_is_answered_and_no_other(
    spawn_node: Callable[..., Any], reliable: list[str], new_rig: Callable[..., Any], motion: dict[str, Any]
) -> None:
    node = spawn_node(*reliable)
    node.wait_for("active;")
    rig = new_rig()
    rig.until(lambda: bool(rig.answers), rig.send)
    rig.until(lambda: rig.answers[-1][0] == rig.stamp)
    rig.until(lambda: rig.publishers["tip_imu"].get_subscription_count() == 1)
    rig.answers.clear()
    strokes, stamps, values = rig.publishers["cylinder_strokes"], list[int](), list(rig.strokes)
    for number in range(100):
        stamps.append(rig.stamp + 5_000_000 * (number + 1))
        strokes.publish(joint_state(stamps[-1], NAMES, values) if number % 2 else raw(stamps[-1], values, number // 2))
        if number % 10 == 5:
            for message in hostile(values, stamps[-1] + 1_000_000):
                strokes.publish(message)
            strokes.publish(raw(stamps[-1] + 1_000_000, values, 1) + bytes(PADDING + 1))
            no_value = Imu(linear_acceleration_covariance=[-1.0, *[0.0] * 8])
            no_value.header.stamp = joint_state(stamps[-1], [], []).header.stamp
            rig.publishers["tip_imu"].publish(no_value)
    rig.until(lambda: len(rig.answers) >= len(stamps))
    assert [stamp for stamp, _ in rig.answers] == stamps

    def counted() -> bool:
        values = {name: int(value) for key, value in rig.values("model").items() if (name := key.partition(": ")[2])}
        return all(values.get(name, 0) >= 9 for name in TOLD)

    rig.until(counted)
    for name in TOLD:
        assert node.said().count(f"{name}:") == 1, name
    assert "too many names: more than 1000 in a message" in node.said() and "seen in a message" not in node.said()
    longer = raw(stamps[-1] + 1_000_000, values, 1) + bytes(PADDING + 1)  # sent again: a look tells only the newest failure
    rig.until(lambda: "stand behind its last field" in rig.words("model"), lambda: strokes.publish(longer))
    assert len(rig.answers) == len(stamps)
    assert node.stop() == 0
