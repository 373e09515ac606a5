"""Feed of the live page from the twin's ROS topics."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import rclpy
from rcl_interfaces.msg import Log
from rclpy.qos import ReliabilityPolicy
from rclpy.subscription import Subscription

from ..messages.topic_table import Output, Topics
from ..monitor.data.feed import Feed
from ..monitor.data.store import Store
from ..scene.schema import Scene
from ..types import SECOND, Stream
from .bag.subscriptions import resolved_topic
from .runtime import message_class, qos_profile

NAME = "boom_twin_monitor"
MOST = 400  # messages of one topic taken in one look, so that a flood of them leaves time for the pages
RARE = (Output.HEALTH, Output.TIP_UNCERTAINTY, Output.DIAGNOSTICS)  # outputs of which none may be missed
MOST_BYTES = 4_000_000  # bytes of one topic after which no more of its messages are taken in one look


class TopicFeed(Feed):
    """Feed from the topics of a live twin. It needs an initialised rclpy.

    Messages are taken by `poll`, not by an executor, which would wake up for each of a thousand in a second.
    Rows are heard as best effort, so the node never keeps or repeats one for it; states and events are heard reliably.
    """

    def __init__(self, topics: Topics, scene: Scene | None = None) -> None:
        depth = 1000  # messages that may wait for the next look, for every topic: seconds of a session
        self._node = rclpy.create_node(NAME)
        topics = topics.renamed(lambda topic: resolved_topic(topic, self._node).name)
        super().__init__("live", Store(), topics, scene)
        shown = [topics.inputs[Stream.IMU], *topics.outputs.values(), topics.events]
        self._heard: list[tuple[Subscription[Any], str]] = []
        for topic in shown:
            if topic.absolute in self.topic_rows.names:
                kind, qos = message_class(topic.type), qos_profile(topic.qos, depth)
                if topic not in (*(topics.outputs[role] for role in RARE), topics.events):
                    qos.reliability = ReliabilityPolicy.BEST_EFFORT
                heard = self._node.create_subscription(kind, topic.absolute, lambda _: None, qos, raw=True)
                self._heard.append((heard, topic.absolute))
        events = topics.events
        self._events = self._node.create_publisher(Log, events.absolute, qos_profile(events.qos))

    def poll(self) -> None:
        """Take the messages that have arrived."""
        now = time.monotonic()
        for subscription, name in self._heard:
            with subscription.handle:
                receive = partial(subscription.handle.take_message, subscription.msg_type, True)
                for data in _taken(receive):
                    self.topic_rows.take_encoded(name, data, now)

    def now(self) -> float:
        """Return the time (s) of a clock that only goes forward."""
        return time.monotonic()

    def publish(self, words: str) -> None:
        """Publish an event with the stamp of the newest sample."""
        store = self.store
        message = Log(level=Log.INFO, name=NAME, msg=words)
        stamp = store.epoch + round(store.newest * SECOND)
        message.stamp.sec, message.stamp.nanosec = divmod(stamp, SECOND)
        self._events.publish(message)

    def close(self) -> None:
        """Stop listening."""
        self._node.destroy_node()


def _taken(receive: Callable[[], tuple[bytes, Any] | None]) -> Iterator[bytes]:
    """Yield the messages that `receive` returns, at most `MOST` of them and little more than `MOST_BYTES`."""
    count = size = 0
    while count < MOST and size < MOST_BYTES and (found := receive()) is not None:
        count, size = count + 1, size + len(found[0])
        yield found[0]
