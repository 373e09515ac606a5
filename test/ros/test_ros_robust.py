"""What happens around a node that runs: publishers come and go, clocks jump, somebody turns a knob. It says so once."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip("rclpy")

from lifecycle_msgs.msg import Transition
from ros_rig import PERIOD, Rig, joint_state
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from boom_twin.types import SECOND


@pytest.fixture(scope="module")
def node(spawn_node: Callable[..., Any], reliable: list[str]) -> Any:
    made = spawn_node(*reliable)
    made.wait_for("active;")
    return made


@pytest.fixture(scope="module")
def rig(node: Any, new_rig: Callable[..., Rig]) -> Rig:
    made = new_rig()
    made.until_right()
    return made


def told(node: Any, before: str) -> list[str]:
    """What was logged of changes since then, without times."""
    found = [re.search(r": at \d+\.\d+: (.*)", line) for line in str(node.said())[len(before) :].splitlines()]
    return [match[1] for match in found if match]


def test_publishers_are_restarted_and_clocks_jump(node: Any, rig: Rig) -> None:
    """A pause is bridged; a longer one, or time that was set, starts the model from rest, and is told."""
    before = node.said()
    for topic, pause in itertools.product(["cylinder_strokes", "joint_angles"], [0, SECOND // 2, 6 * SECOND]):
        rig.node.destroy_publisher(rig.publishers.pop(topic))
        for _ in range(pause // PERIOD if topic == "joint_angles" else 0):
            rig.send()
        rig.stamp += pause if topic == "cylinder_strokes" else 0
        rig.publishers[topic] = publisher = rig.node.create_publisher(JointState, topic, 1000)
        rig.until(lambda publisher=publisher: publisher.get_subscription_count() == 1)
        rig.until_right()
    for jump in (-3, 3600, -3600, -20):  # the first one as of a looped bag
        rig.stamp += jump * SECOND
        rig.until_right()
    assert set(told(node, before)) == {"started from rest (restart)", "started from rest (jump back)"}


def test_settings_and_services(node: Any, rig: Rig, remote: Any) -> None:
    before, rest = node.said(), "started from rest"
    assert remote.set("gap", 0.3).successful
    rig.until_right()
    assert remote.set("payload", 60.0).successful
    rig.until(lambda: rig.answers[-1][1] > 1e-3, rig.send)
    assert remote.set("payload", -1.0).successful
    rig.until(lambda: f"{rest} (load); payload -1" in node.said(), rig.send)
    rig.until_right()
    assert told(node, before) == ["gap 0.3", f"{rest} (load); payload 60", f"{rest} (load); payload -1"]

    before = node.said()
    assert remote.trigger("reset").success
    rig.until_right()
    rig.joints = rig.joints + 0.02
    first = rig.stamp
    rig.until(lambda: rig.answers[-1][0] > first + 2 * SECOND, rig.send)
    for i in range(1, 5):
        answer = remote.trigger(f"rezero/joint_{i}")
        assert answer.success and f"zero of joint_{i}: 0.02" in answer.message, answer
    rig.until_right()
    refused = remote.trigger("rezero/tip_imu")
    assert not refused.success and "tip_imu_x: 0 residuals" in refused.message
    assert "".join(told(node, before)).count("zero of joint_") == 4  # some at the same stroke
    assert remote.trigger("rezero/cylinder_2").success
    rig.until_right()

    answers = [remote.trigger("reset") for _ in range(3)]  # a start from rest takes as long as hundreds of steps
    assert answers[0].success
    assert all("less than 1 s ago" in answer.message for answer in answers if not answer.success)

    assert remote.change(Transition.TRANSITION_DEACTIVATE)
    refused = remote.trigger("reset")
    assert not refused.success and "not active" in refused.message
    before = node.said()
    assert remote.change(Transition.TRANSITION_ACTIVATE)
    rig.until_right()
    assert [line.partition(" (")[0] for line in told(node, before)] == [rest]


def test_nothing_waits_for_the_clock_topic_and_it_may_jump(spawn_node: Callable[..., Any], new_rig: Callable[..., Rig]) -> None:
    made = spawn_node("-p", "use_sim_time:=true", "-r", "__ns:=/sim")
    made.wait_for("active;")
    rig = new_rig("/sim")
    rig.until_right()
    rig.until(lambda: "use_sim_time is set and no /clock came yet: play with --clock" in made.said(), rig.send)
    clock = rig.node.create_publisher(Clock, "/clock", 10)
    rig.until(lambda: clock.get_subscription_count() == 1)
    for jump in (0, 100, -50):
        rig.stamp += jump * SECOND
        clock.publish(Clock(clock=joint_state(rig.stamp, [], []).header.stamp))
        rig.until_right()
    assert made.stop() == 0
