"""`boom_twin play` as a process, heard from here."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

import rclpy
from recordings import scan
from ros_messages import stamp_of
from ros_rig import all_stored, spin_until
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from boom_twin.bag.advice import publishable
from boom_twin.bag.metadata import Recorded, offered_qos
from boom_twin.bag.writer import BagWriter
from boom_twin.messages.topic_table import Qos
from boom_twin.ros.bag.player import CATCH_UP, Player
from boom_twin.types import SECOND

PLAY = ("boom_twin.cli.main", "play")


@pytest.fixture
def listener(domain: None) -> Iterator[Any]:
    node = rclpy.create_node("listener")
    yield node
    node.destroy_node()


def hear_clock(node: Any) -> list[int]:
    ticks: list[int] = []
    node.create_subscription(Clock, "/clock", lambda msg: ticks.append(msg.clock.sec * SECOND + msg.clock.nanosec), 1000)
    return ticks


def test_a_part_of_a_session_with_its_clock(
    spawn: Callable[..., Any], listener: Any, reliable_bag: Path, motion: dict[str, Any]
) -> None:
    strokes, ticks = list[JointState](), hear_clock(listener)
    listener.create_subscription(JointState, "cylinder_strokes", strokes.append, 1000)
    part = ["--start", "1", "--duration", "2", "--rate", "2", "--clock", "80", "--wait", "5"]
    play = spawn(*PLAY, str(reliable_bag), *part)
    first = int(motion["stamps_ns"].min()) + SECOND
    sent = np.flatnonzero((motion["stamps_ns"] >= first) & (motion["stamps_ns"] < first + 2 * SECOND))
    spin_until(listener, lambda: len(strokes) == len(sent))
    assert play.end() == 0, play.said()
    assert "nobody listens to joint_angles, tip_imu" in play.said()
    assert [stamp_of(msg) for msg in strokes] == motion["stamps_ns"][sent].tolist()
    assert np.array([msg.position for msg in strokes]).tolist() == motion["strokes"][sent].tolist()
    assert len(ticks) > 10 and {(after - before) % 25_000_000 for before, after in pairwise(ticks)} == {0}


def test_what_is_overdue_is_not_sent_in_a_flood(domain: None, bag: Path) -> None:
    """Listeners of best effort have room for some hundred messages, so that a second of them at once would be lost in part."""
    player, sent, awake = Player(scan(bag)), [], 0.0
    for offset in player.play(duration=2.0):
        sent.append((offset / SECOND, time.monotonic()))
        if len(sent) == 100:
            time.sleep(1.0)
            awake = time.monotonic()
    player.close()
    late = sent[100:]
    assert len(late) > 400
    assert all(at - awake >= (offset - late[0][0]) / CATCH_UP - 1e-6 for offset, at in late)


def test_it_ends_only_when_reliable_listeners_have_everything(
    spawn: Callable[..., Any], listener: Any, reliable_bag: Path, mapping: Path, tmp_path: Path
) -> None:
    """A recorder that stands still for a while misses nothing, for the player is still there when it goes on."""
    recorder = spawn("boom_twin.cli.main", "record", "--out", str(tmp_path / "out"), "--mapping", str(mapping))
    player = Player(scan(reliable_bag), ["/tip_imu"])
    assert player.wait(120.0) == []
    recorder.send(signal.SIGSTOP)
    for _ in player.play(rate=8.0):
        pass
    assert player.deliver(0.5) == ["/tip_imu"]
    recorder.send(signal.SIGCONT)
    assert player.deliver(120.0) == []
    player.close()
    all_stored(listener)
    assert recorder.stop(signal.SIGINT) == 0
    found = scan(tmp_path / "out").find("/tip_imu")
    assert found is not None and found.count == player.sent["/tip_imu"] == 800


def test_again_and_again_until_it_is_stopped(spawn: Callable[..., Any], listener: Any, reliable_bag: Path) -> None:
    came: list[Imu] = []
    listener.create_subscription(Imu, "tip_imu", came.append, 1000)
    play = spawn(*PLAY, str(reliable_bag), "--rate", "8", "--loop", "--topics", "/tip_imu")
    spin_until(listener, lambda: len(came) > 850)
    assert play.stop(signal.SIGINT) == 0
    assert "s: /tip_imu " in play.said() and "sent in" in play.said()


@pytest.mark.parametrize("with_metadata", [True, False])
def test_quality_of_service_is_that_of_the_session(tmp_path: Path, with_metadata: bool) -> None:
    qos = Qos(reliability="reliable", durability="transient_local", depth=3)
    bag = BagWriter(tmp_path / "bag")
    text = "- reliability: 1\n  durability: 1\n  depth: 3\n  history: 1\n"  # as version 8 has it
    (key,) = bag.add(
        Recorded("/map", "std_msgs/msg/String", b"string data\n", {"offered_qos_profiles": text}, offered_qos(qos))
    )
    bag.write(key, 1, b"\0\1\0\0\2\0\0\0a\0")
    bag.close()
    if not with_metadata:
        (tmp_path / "bag" / "metadata.yaml").unlink()
    assert [topic.qos for topic in publishable(scan(tmp_path / "bag"), ["map"])] == [qos]
