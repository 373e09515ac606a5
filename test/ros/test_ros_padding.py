"""Raw publishers of rclpy: what they leave behind a message's end is understood live as a replay understands it."""

from __future__ import annotations

from array import array
from typing import Any

import pytest

pytest.importorskip("rclpy")

from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from boom_twin.messages.topic_table import TYPES
from boom_twin.messages.type_store import PADDING, decode, jazzy
from boom_twin.types import Stream

TYPE = TYPES[Stream.STROKES]
SECOND = 1_000_000_000
PERIOD = 5_000_000


def test_a_raw_publisher_is_understood_live_as_in_a_replay(node: Any, bench: Any, motion: dict[str, Any]) -> None:
    bench.until_matched()
    bench.until(lambda: bench.node.count_publishers("/boom_twin/tip/position") == 1 and bool(bench.diagnostics))
    names, values = [f"cylinder_{i}" for i in range(1, 5)], array("d", motion["strokes"][0])

    def raw(number: int) -> bytes:
        msg = JointState(name=names, position=values)
        msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(100 * SECOND + number * PERIOD, SECOND)
        return bytes(serialize_message(msg))

    def turned(data: bytes) -> bytes:
        return bytes(jazzy().serialize_cdr(decode(data, TYPE), TYPE, little_endian=False))

    first = raw(0)
    whole = len(turned(first))
    assert len(first) == whole + 8  # or there is nothing to test
    sent = [raw(k) for k in range(10)]
    sent += [turned(raw(k)) + b"\x01" * (k % (PADDING + 1)) for k in range(10, 30)]
    more = [raw(30)[:whole] + b"\0" * (PADDING + 1), turned(raw(30)) + b"\0" * (PADDING + 1)]
    for data in [*sent[:15], *more, *sent[15:]]:
        bench.strokes.publish(data)
    bench.until(lambda: len(bench.answers) >= len(sent))
    bench.until(lambda: bench.values("boom_twin: cylinder_strokes").get("messages") == str(len(sent)))
    assert bench.answers == [100 * SECOND + k * PERIOD for k in range(len(sent))]
    assert "stand behind its last field" in node.said()
    assert node.stop() == 0
