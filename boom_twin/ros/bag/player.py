"""Player of a recorded session: publishes its topics and ``/clock`` at the pace of the log times."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import rclpy
from builtin_interfaces.msg import Time
from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock

from ...bag.advice import publishable
from ...bag.reader import Session, read_both
from ...errors import BagError
from ...types import NANO, SECOND
from ..runtime import qos_profile
from .subscriptions import installed_class

CLOCK = "/clock"
NAME = "boom_twin_player"
LOOK = 0.05  # polling period (s) of listeners
DELIVERY = 10.0  # timeout (s) for acknowledgements of reliable listeners at the end
SETTLE = 0.5  # time (s) from the match with the last listener to the first message
CATCH_UP = 4.0
"""Factor on the rate at which overdue messages are sent after a delay.

Best-effort listeners would lose a burst: in shared memory Fast DDS holds 512 messages for each listening program.
"""


class Player:
    """Player of the topics `names` of one session, by default of the twin's inputs. It needs an initialised rclpy.

    Log times are on ``/clock`` at `clock_rate` (Hz); None: they are not. BagError if a topic is not in the session, UsageError
    if its type is not installed.
    """

    def __init__(self, session: Session, names: Sequence[str] | None = None, clock_rate: float | None = None) -> None:
        self._session, self._clock_rate = session, clock_rate
        topics = publishable(session, names)
        self._types = {topic.name: topic.type for topic in topics}
        kinds = {topic.name: installed_class(topic.type) for topic in topics}
        self._node = rclpy.create_node(NAME)
        self._publishers = {
            topic.name: self._node.create_publisher(kinds[topic.name], topic.name, qos_profile(topic.qos)) for topic in topics
        }
        self._clock: Publisher[Any] | None = None
        if clock_rate is not None:
            self._clock = self._node.create_publisher(Clock, CLOCK, 10)
        self.sent: Counter[str] = Counter()  # messages sent by topic, in all calls of `play` so far
        self.latest = self.wall = 0.0  # largest delay of a message, wall time of all calls, s

    @property
    def topics(self) -> tuple[str, ...]:
        return tuple(self._types)

    def unmatched(self, listeners: int = 1) -> list[str]:
        """Return the topics that fewer than `listeners` subscriptions have matched."""
        return [name for name, each in self._publishers.items() if each.get_subscription_count() < listeners]

    def wait(self, timeout: float, listeners: int = 1) -> list[str]:
        """Wait until every topic has listeners; return the topics without.

        A short wait follows, because a publisher may discover a subscription a moment before the reverse.
        """
        end = time.monotonic() + timeout
        while (unmatched := self.unmatched(listeners)) and time.monotonic() < end:
            time.sleep(LOOK)
        if timeout > 0.0:
            time.sleep(SETTLE)
        return unmatched

    def length(self, start: float = 0.0, duration: float | None = None) -> float:
        """Return the length (s) of a part of the session; raise BagError if it starts after the end."""
        whole = (self._session.end - self._session.start) * NANO
        if start >= whole:
            raise BagError(f"{self._session.path}: nothing from {start:g} s on; the session lasts {whole:.1f} s.")
        return min(whole - start, whole if duration is None else duration)

    def play(self, rate: float = 1.0, start: float = 0.0, duration: float | None = None) -> Iterator[int]:
        """Publish a message at each step of the iterator, which yields the session time played (ns); update the attributes.

        `rate` is session time over wall time, `start` and `duration` (s) are the part. BagError if it cannot be read.
        """
        first = self._session.start + round(start / NANO)
        end = 2**64 if duration is None else first + round(duration / NANO)
        began = time.monotonic()
        sent, previous = began, 0.0
        try:
            for stamp, name, data in self._schedule(first, end, rate):
                due = (stamp - first) * NANO / rate
                time.sleep(max(0.0, max(began + due, sent + (due - previous) / CATCH_UP) - time.monotonic()))
                sent, previous = time.monotonic(), due
                self.latest = max(self.latest, sent - began - due)
                if name == CLOCK and self._clock is not None:
                    self._clock.publish(data)
                else:
                    self._publishers[name].publish(data)
                    self.sent[name] += 1
                yield stamp - first
        finally:
            self.wall += time.monotonic() - began

    def deliver(self, timeout: float = DELIVERY) -> list[str]:
        """Wait until all reliable listeners have received everything; return the topics not delivered.

        A lost packet is sent again only while its publisher lives. Destroying the publisher at once may lose seconds
        of messages.
        """
        end = time.monotonic() + timeout
        return [
            name
            for name, each in self._publishers.items()
            if not each.wait_for_all_acked(Duration(seconds=max(0.0, end - time.monotonic())))
        ]

    def close(self) -> None:
        self._node.destroy_node()

    def _schedule(self, first: int, end: int, rate: float) -> Iterator[tuple[int, str, bytes | Clock]]:
        """Yield log time (ns), topic and message (CDR, or Clock) of the span in order."""
        tick, period = first, round(rate / self._clock_rate / NANO) if self._clock_rate else 0
        for name, stamp, data, _ in read_both(self._session, self._types):
            if not first <= stamp < end:
                continue
            while period and tick <= stamp:
                yield tick, CLOCK, Clock(clock=Time(sec=tick // SECOND, nanosec=tick % SECOND))
                tick += period
            yield stamp, name, data
