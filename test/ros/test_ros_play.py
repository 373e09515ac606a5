"""`boom_twin play` as a process, heard from here."""

from __future__ import annotations

import os
import pty
import re
import signal
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from boom_twin.bag.advice import publishable
from boom_twin.bag.metadata import Recorded, offered_qos
from boom_twin.bag.reader import read_both, scan
from boom_twin.bag.writer import BagWriter, SessionWriter
from boom_twin.messages.mapping import load_mapping
from boom_twin.messages.sample_decoder import stamp_of
from boom_twin.messages.topic_table import Qos
from boom_twin.ros.bag.player import CATCH_UP, Player
from boom_twin.types import SECOND, Stream


def test_a_part_of_a_session_with_its_clock(spawn: Callable[..., Any], bag: Path, motion: dict[str, Any]) -> None:
    strokes: list[JointState] = []
    ticks: list[int] = []
    node = rclpy.create_node("listener")
    qos = QoSProfile(depth=2000, reliability=ReliabilityPolicy.BEST_EFFORT)
    node.create_subscription(JointState, "cylinder_strokes", strokes.append, qos)
    node.create_subscription(Clock, "/clock", lambda msg: ticks.append(msg.clock.sec * 10**9 + msg.clock.nanosec), qos)
    part = ["--start", "1", "--duration", "2", "--rate", "2", "--clock", "80"]
    play = spawn("boom_twin.cli.main", "play", str(bag), *part, "--wait", "5")
    end = time.monotonic() + 60.0
    while "sent in" not in play.said() and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.05)
    for _ in range(1000):  # what still waits
        rclpy.spin_once(node, timeout_sec=0.001)
    node.destroy_node()
    assert play.end() == 0, play.said()
    assert "nobody listens to joint_angles, tip_imu" in play.said()
    first = int(motion["stamps_ns"].min())
    assert 390 <= len(strokes) <= 401
    assert all(first + 10**9 <= stamp_of(msg) < first + 3 * 10**9 for msg in strokes)
    rows = {int(stamp): row for row, stamp in enumerate(motion["stamps_ns"])}
    for msg in strokes:
        assert list(msg.position) == motion["strokes"][rows[stamp_of(msg)]].tolist()
    assert 70 <= len(ticks) <= 81
    assert {after - before for before, after in pairwise(ticks)} == {25_000_000}


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
    spawn: Callable[..., Any], domain: None, bag: Path, tmp_path: Path
) -> None:
    """A recorder that stands still for a while misses nothing, for the player is still there when it goes on."""
    mapping, session, out = tmp_path / "mapping.yaml", tmp_path / "session", tmp_path / "out"
    mapping.write_text("inputs: {tip_imu: {qos: {reliability: reliable}}}\n")
    topic = load_mapping(mapping).inputs[Stream.IMU]
    with SessionWriter(session, {topic.absolute: topic}) as writer:
        for name, log, data, _ in read_both(scan(bag), {topic.absolute: topic.type}):
            writer.write_encoded(name, log, data)
    recorder = spawn("boom_twin.cli.main", "record", "--out", str(out), "--mapping", str(mapping))
    player = Player(scan(session), [topic.absolute])
    assert player.wait(60.0) == []
    recorder.send(signal.SIGSTOP)
    for _ in player.play(rate=8.0):
        pass
    assert player.deliver(0.5) == [topic.absolute]
    recorder.send(signal.SIGCONT)
    assert player.deliver(60.0) == []
    player.close()
    end, size = time.monotonic() + 60.0, -1
    while size != (size := sum(path.stat().st_size for path in out.iterdir())) and time.monotonic() < end:
        time.sleep(2.0)  # it writes what it has
    assert recorder.stop(signal.SIGINT) == 0
    found = scan(out).find(topic.absolute)
    assert found is not None and found.count == player.sent[topic.absolute] == 800


def test_nobody_listens(spawn: Callable[..., Any], bag: Path) -> None:
    play = spawn("boom_twin.cli.main", "play", str(bag), "--wait", "0.5")
    assert play.end() == 1
    assert "boom_twin play: nobody listened within 0.5 s" in play.said()


def test_no_such_part(spawn: Callable[..., Any], bag: Path) -> None:
    play = spawn("boom_twin.cli.main", "play", str(bag), "--wait", "0", "--start", "10")
    assert play.end() == 1
    assert "nothing from 10 s on; the session lasts 4.0 s" in play.said()


def test_nothing_to_record(spawn: Callable[..., Any], tmp_path: Path) -> None:
    record = spawn("boom_twin.cli.main", "record", "--out", str(tmp_path / "bag"), "--duration", "0.5")
    assert record.end() == 1
    assert "nothing came" in record.said()
    assert (tmp_path / "bag" / "metadata.yaml").is_file()


def test_again_and_again_until_it_is_stopped(spawn: Callable[..., Any], bag: Path) -> None:
    play = spawn("boom_twin.cli.main", "play", str(bag), "--wait", "0", "--rate", "8", "--loop", "--topics", "/tip_imu")
    play.wait_for("playing 4.0 s")
    time.sleep(2.0)
    assert play.stop(signal.SIGINT) == 0
    match = re.search(r"sent in \d+\.\d s: /tip_imu (\d+);", play.said())
    assert match is not None and 850 < int(match[1]) < 8000, play.said()


def test_the_space_bar_pauses(spawn: Callable[..., Any], bag: Path) -> None:
    ours, theirs = pty.openpty()
    play = spawn("boom_twin.cli.main", "play", str(bag), "--wait", "0", "--rate", "2", stdin=theirs)
    play.wait_for("space: pause")
    play.wait_for("playing")
    os.write(ours, b"x ")
    play.wait_for("paused")
    time.sleep(2.0)
    os.write(ours, b" ")
    assert play.end() == 0, play.said()
    match = re.search(r"sent in (\d+\.\d) s: cylinder_strokes 800, joint_angles 800, tip_imu 800; at worst", play.said())
    assert match is not None and 3.8 < float(match[1]) < 15.0, play.said()
    os.close(ours)
    os.close(theirs)


def test_a_held_play_keeps_the_clock_and_its_pace(domain: None, bag: Path) -> None:
    ticks: list[int] = []
    node = rclpy.create_node("clock_listener")
    node.create_subscription(Clock, "/clock", lambda msg: ticks.append(msg.clock.sec * 10**9 + msg.clock.nanosec), 100)
    player = Player(scan(bag), ["/tip_imu"], 50.0)
    end = time.monotonic() + 20.0
    while player._clock.get_subscription_count() == 0 and time.monotonic() < end:  # type: ignore[union-attr]
        rclpy.spin_once(node, timeout_sec=0.05)
    holding = iter([False] * 5 + [True] * 20 + [False] * 10_000)
    began = time.monotonic()
    for _ in player.play(duration=1.0, is_held=lambda: next(holding)):
        rclpy.spin_once(node, timeout_sec=0.0)
    took = time.monotonic() - began
    for _ in range(200):
        rclpy.spin_once(node, timeout_sec=0.002)
    assert took > 1.35 and player.sent == {"/tip_imu": 200}
    assert ticks == sorted(ticks) and len(ticks) >= 60 and len(set(ticks)) in (49, 50, 51, 52)
    player.close()
    node.destroy_node()


@pytest.mark.parametrize("with_metadata", [True, False])
def test_quality_of_service_is_that_of_the_session(tmp_path: Path, with_metadata: bool) -> None:
    qos = Qos(reliability="reliable", durability="transient_local", depth=3)
    bag = BagWriter(tmp_path / "bag")
    offered = offered_qos(qos)
    text = "- reliability: 1\n  durability: 1\n  depth: 3\n  history: 1\n"  # as version 8 has it
    (key,) = bag.add(Recorded("/map", "std_msgs/msg/String", b"string data\n", {"offered_qos_profiles": text}, offered))
    bag.write(key, 1, b"\0\1\0\0\2\0\0\0a\0")
    bag.close()
    if not with_metadata:
        (tmp_path / "bag" / "metadata.yaml").unlink()
    assert [topic.qos for topic in publishable(scan(tmp_path / "bag"), ["map"])] == [qos]


def test_a_topic_that_is_not_there(bag: Path, capsys: pytest.CaptureFixture[str], domain: None) -> None:
    from boom_twin.cli.main import main

    rclpy.try_shutdown()
    assert main(["play", str(bag), "--wait", "0", "--topics", "tip_imo"]) == 1
    rclpy.init(args=[])
    assert "no topic tip_imo" in capsys.readouterr().err
