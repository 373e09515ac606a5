"""Alarms over DDS in the monitor's feed: from their topic, and let go of by the node."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

import rclpy
from rclpy.serialization import deserialize_message
from ros_messages import Output, encode_health, load_topics

from boom_twin.monitor.data.status import Severity
from boom_twin.monitor.viewer import ViewerActions
from boom_twin.ros.monitor_feed import TopicFeed
from boom_twin.ros.runtime import message_class, qos_profile
from boom_twin.types import Alarm, Health, Ranked

TOPICS = load_topics()
EPOCH = 1_700_000_000
BEGIN, END = EPOCH * 10**9 + 25_000_000, EPOCH * 10**9 + 75_000_000
CAUSES = (Ranked("joint_3.sensor", 0.9, ()), Ranked("cylinder_3.k", 0.1, ()))
ALARM = Alarm("joint_3", "residual", BEGIN, None, "joint_3.sensor", "joint_3.sensor jumped", CAUSES)


class Rig:
    """Publishers of what the node would tell of its health."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("beside")
        topics = {role: TOPICS.outputs[role] for role in (Output.HEALTH, Output.TIP_UNCERTAINTY)}
        self._kinds = {role: message_class(topic.type) for role, topic in topics.items()}
        self.publishers = {
            role: self.node.create_publisher(self._kinds[role], topic.absolute, qos_profile(topic.qos))
            for role, topic in topics.items()
        }

    def is_heard(self) -> bool:
        return all(publisher.get_subscription_count() for publisher in self.publishers.values())

    def send(self, role: Any, nanosec: int, fill: Callable[[Any], None]) -> None:
        message = self._kinds[role]()
        message.header.stamp.sec, message.header.stamp.nanosec = EPOCH, nanosec
        fill(message)
        self.publishers[role].publish(message)


def tell(end: int | None, message: Any) -> None:
    """One alarm, that has ended or lasts."""
    health = Health(ALARM.since, (replace(ALARM, until=end),), np.zeros(2))
    message.status = deserialize_message(encode_health(health), type(message)).status


def judged(feed: Any) -> Any:
    return next((alarm for alarm in feed.store.alarms.all if alarm.causes), None)


def until(feed: Any, condition: Callable[[], Any], rig: Rig | None = None) -> None:
    """Let the feed take messages, and the rig if there is one, until it holds."""
    end = time.monotonic() + 120.0
    while not condition():
        assert time.monotonic() < end
        feed.poll()
        if rig is not None:
            rclpy.spin_once(rig.node, timeout_sec=0.0)
        time.sleep(0.01)


@pytest.fixture(scope="module")
def pair(domain: None) -> Iterator[tuple[Any, Rig]]:
    feed, rig = TopicFeed(TOPICS), Rig()
    until(feed, rig.is_heard)
    yield feed, rig
    feed.close()
    rig.node.destroy_node()


def test_alarms_come_from_their_topic_and_are_acknowledged_again_when_they_end(pair: tuple[Any, Rig]) -> None:
    feed, rig = pair
    rig.send(Output.TIP_UNCERTAINTY, 5_000_000, lambda message: setattr(message.vector, "z", 0.002))
    until(feed, lambda: "uncertainty" in feed.store.tables)
    rig.send(Output.HEALTH, 60_000_000, partial(tell, None))
    until(feed, lambda: judged(feed))
    assert feed.store.tables["uncertainty"].rows(0, 1)[1].tolist() == [[0.0, pytest.approx(0.002)]]
    alarm = judged(feed)
    assert (alarm.name, alarm.level, alarm.reason, alarm.end) == ("joint_3", Severity.ERROR, ALARM.told, None)
    assert alarm.causes == (("joint_3.sensor", 0.9), ("cylinder_3.k", 0.1)) and alarm.begin == pytest.approx(0.02, abs=1e-3)

    actions, request = ViewerActions(feed, {"acknowledge"}), {"do": "acknowledge", "numbers": [alarm.number]}
    assert actions.act(request)["words"] == "acknowledged: joint_3" and judged(feed).is_acknowledged
    rig.send(Output.HEALTH, 80_000_000, partial(tell, END))
    until(feed, lambda: judged(feed).end is not None)
    assert not judged(feed).is_acknowledged
