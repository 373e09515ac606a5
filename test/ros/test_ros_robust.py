"""What happens around a node that runs: publishers come and go, clocks jump, somebody turns a knob. It says so once."""

from __future__ import annotations

import re
import threading
import time
from array import array
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

import rclpy
from geometry_msgs.msg import PointStamped
from lifecycle_msgs.msg import Transition
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from boom_twin import load_scene, statics
from boom_twin.messages.sample_decoder import stamp_of

RATE = 100.0
SOON = 2.0  # s
BEGIN = 1_700_000_000.0


class Rig:
    """Sends a boom at rest at 200 Hz, with a clock that can be set, and hears what a node makes of it."""

    def __init__(self, namespace: str = "", posture: str = "arch") -> None:
        self.node = rclpy.create_node("rig", namespace=namespace)
        rest = statics(load_scene(), posture=posture, modes=0)
        self.strokes, self.tip, self.joints = rest.lengths, rest.tip, rest.joints
        self.shift = BEGIN - time.monotonic()
        self.answers: list[tuple[int, float]] = []
        self.residuals: list[float] = []
        self.node.create_subscription(PointStamped, "boom_twin/tip/position", self._hear, 1000)
        self.node.create_subscription(JointState, "boom_twin/residuals", self._hear_residual, 1000)
        self.publishers: dict[str, Any] = {}
        self.restart("cylinder_strokes")
        self.restart("joint_angles")
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._send)
        self._thread.start()
        end = time.monotonic() + 30.0
        while not self.residuals and time.monotonic() < end:  # until all have found each other
            self.spin(0.1)

    def restart(self, topic: str, pause: float = 0.0) -> None:
        """The publisher of a topic goes away and comes again; back as soon as the node has found it."""
        if (old := self.publishers.pop(topic, None)) is not None:
            self.node.destroy_publisher(old)
        time.sleep(pause)
        self.publishers[topic] = publisher = self.node.create_publisher(JointState, topic, 100)
        end = time.monotonic() + 30.0
        while publisher.get_subscription_count() == 0 and time.monotonic() < end:
            time.sleep(0.02)

    def now(self) -> float:
        return time.monotonic() + self.shift

    def joint_state(self, topic: str, stamp: float) -> JointState:
        kind, values = ("cylinder", self.strokes) if topic == "cylinder_strokes" else ("joint", self.joints)
        msg = JointState(name=[f"{kind}_{i}" for i in range(1, 5)], position=array("d", values))
        msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(round(stamp * 1e9), 10**9)
        return msg

    def goes_on(self) -> None:
        """Within two seconds from now the node answers with stamps of now, and rightly; and keeps doing so."""
        self.spin(SOON)
        good = [stamp for stamp, miss in self.answers if abs(stamp * 1e-9 - self.now()) < SOON and miss < 1e-3]
        self.answers.clear()
        self.residuals.clear()
        self.spin(0.5)
        assert len(good) > 10 and len(self.answers) > 10, (len(good), len(self.answers))
        assert max(abs(stamp * 1e-9 - self.now()) for stamp, _ in self.answers) < 2.0
        assert max(miss for _, miss in self.answers) < 1e-3
        assert len(self.residuals) > 10 and max(self.residuals) < 1e-3

    def spin(self, duration: float) -> None:
        end = time.monotonic() + duration
        while time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.02)

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        self.node.destroy_node()

    def _send(self) -> None:
        while not self._over.wait(1.0 / RATE):
            stamp = self.now()
            for topic, publisher in list(self.publishers.items()):
                publisher.publish(self.joint_state(topic, stamp))

    def _hear(self, msg: PointStamped) -> None:
        self.answers.append((stamp_of(msg), float(np.hypot(msg.point.x - self.tip[0], msg.point.z - self.tip[1]))))

    def _hear_residual(self, msg: JointState) -> None:
        self.residuals.append(max(map(abs, msg.position)))


@pytest.fixture(scope="module")
def node(spawn_node: Callable[..., Any]) -> Any:
    made = spawn_node()
    made.wait_for("active;")
    return made


@pytest.fixture(scope="module")
def rig(node: Any) -> Iterator[Rig]:
    made = Rig()
    made.goes_on()
    yield made
    made.close()


def lines_of(node: Any, before: str) -> list[str]:
    return str(node.said())[len(before) :].splitlines()


def told(node: Any, before: str) -> list[str]:
    """What was logged of changes since then, without times."""
    found = [re.search(r": at \d+\.\d+: (.*)", line) for line in lines_of(node, before)]
    return [match[1] for match in found if match]


def starts(node: Any, before: str) -> list[str]:
    return [line for line in lines_of(node, before) if "started from rest" in line]


@pytest.mark.parametrize("topic", ["cylinder_strokes", "joint_angles"])
@pytest.mark.parametrize("pause", [0.0, 0.5, 6.0])
def test_a_publisher_is_restarted(node: Any, rig: Rig, topic: str, pause: float) -> None:
    before = node.said()
    rig.restart(topic, pause)
    rig.goes_on()
    assert starts(node, before) == [], lines_of(node, before)
    expected = 1 if topic == "cylinder_strokes" and pause > 5.0 else 0
    assert len([line for line in told(node, before) if "clock set" in line]) == expected, lines_of(node, before)


@pytest.mark.parametrize("jump", [-3.0, 3600.0, -3600.0, -20.0], ids=["a looped bag", "forth", "back", "back again"])
def test_the_clock_jumps(node: Any, rig: Rig, jump: float) -> None:
    before = node.said()
    rig.shift += jump
    rig.goes_on()
    assert starts(node, before) == [], "strokes went on where they were"
    assert any("clock set" in line for line in told(node, before)), lines_of(node, before)


def test_stamps_of_zero_among_others(node: Any, rig: Rig) -> None:
    for _ in range(3):
        rig.publishers["cylinder_strokes"].publish(rig.joint_state("cylinder_strokes", 0.0))
        rig.spin(0.1)
    rig.goes_on()


def test_a_limit_and_a_load_are_changed(node: Any, rig: Rig, remote: Any) -> None:
    before, tip = node.said(), rig.tip
    assert remote.set("gap", 0.3).successful
    rig.goes_on()
    assert told(node, before) == ["gap 0.3"]
    assert remote.set("payload", 60.0).successful
    with pytest.raises(AssertionError):
        rig.goes_on()
    rig.tip = tip
    assert remote.set("payload", -1.0).successful
    rig.goes_on()
    back = "started from rest (load); payload -1"
    assert told(node, before) == ["gap 0.3", "started from rest (load); payload 60", back]


def test_deactivated_and_activated(node: Any, rig: Rig, remote: Any) -> None:
    assert remote.change(Transition.TRANSITION_DEACTIVATE)
    refused = remote.trigger("reset")
    assert not refused.success and "not active" in refused.message
    before = node.said()
    assert remote.change(Transition.TRANSITION_ACTIVATE)
    rig.goes_on()
    assert len(starts(node, before)) == 1


def test_reset_and_rezero(node: Any, rig: Rig, remote: Any) -> None:
    before = node.said()
    assert remote.trigger("reset").success
    rig.goes_on()
    rig.joints = rig.joints + 0.02
    rig.spin(1.5)
    for i in range(1, 5):
        answer = remote.trigger(f"rezero/joint_{i}")
        assert answer.success and f"zero of joint_{i}: 0.02" in answer.message, answer
    rig.goes_on()
    refused = remote.trigger("rezero/tip_imu")
    assert not refused.success and "tip_imu_x: 0 residuals" in refused.message
    assert "".join(lines_of(node, before)).count("zero of joint_") == 4  # some at the same stroke
    assert remote.trigger("rezero/cylinder_2").success
    rig.goes_on()


def test_a_flood_of_resets_does_not_keep_the_node_busy(node: Any, rig: Rig, remote: Any) -> None:
    """Every start from rest takes as long as hundreds of steps; one a second is done, and the others are told."""
    answers = [remote.trigger("reset") for _ in range(20)]
    assert answers[0].success
    assert any("less than 1 s ago" in answer.message for answer in answers if not answer.success)
    rig.goes_on()


def test_two_nodes_in_two_namespaces(spawn_node: Callable[..., Any], domain: None) -> None:
    rigs: list[Rig] = []
    try:
        for namespace, posture in (("/left", "arch"), ("/right", "low")):
            spawn_node("-r", f"__ns:={namespace}").wait_for("active;")
            rigs.append(Rig(namespace, posture))
        for rig in rigs:
            rig.goes_on()
        rigs[0].shift += 3600.0
        rigs[1].answers.clear()
        rigs[0].goes_on()
        rigs[1].spin(0.5)
        assert max(miss for _, miss in rigs[1].answers) < 1e-3
    finally:
        for rig in rigs:
            rig.close()


def test_time_of_the_clock_topic_jumps(spawn_node: Callable[..., Any], domain: None) -> None:
    made = spawn_node("-p", "use_sim_time:=true", "-r", "__ns:=/sim")
    made.wait_for("active;")
    rig = Rig("/sim")
    clock = rig.node.create_publisher(Clock, "/clock", 10)
    try:
        for jump in (0.0, 100.0, -50.0):
            rig.shift += jump
            for _ in range(5):
                msg = Clock()
                msg.clock.sec = int(rig.now())
                clock.publish(msg)
                rig.spin(0.05)
            rig.goes_on()
    finally:
        rig.close()


def test_a_clock_topic_that_never_comes_is_told_and_nothing_waits_for_it(spawn_node: Callable[..., Any], domain: None) -> None:
    made = spawn_node("-p", "use_sim_time:=true", "-r", "__ns:=/still")
    made.wait_for("active;")
    rig = Rig("/still")
    try:
        rig.goes_on()
        made.wait_for("use_sim_time is set and no /clock came yet: play with --clock")
        rig.goes_on()
    finally:
        rig.close()
