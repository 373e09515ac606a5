"""Publishes the input topics of a recorded session at the pace of its log times."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import rclpy
from rclpy.publisher import Publisher

from ..errors import BagError
from ..io.reader import Session, read
from ..io.topics import Topic, load_topics
from ..io.typestore import jazzy
from ..records import Stream
from .qos import qos_profile
from .types import message_class

NAME = "boom_twin_player"
CLOCK, CLOCK_TYPE = "/clock", "rosgraph_msgs/msg/Clock"
CLOCK_PERIOD = 25_000_000
"""ns of session time between two messages on ``/clock``: 40 Hz, as ``ros2 bag play --clock`` has it."""
LOOK = 0.05
"""Time (s) between looks for listeners."""
SETTLE = 0.5
"""Time (s) from the match with the last listener to the first message."""

NANO = 1e-9


@dataclass(frozen=True, slots=True)
class Played:
    """What was published: messages by topic, seconds that it took, and by how much a message was late at worst."""

    sent: dict[str, int]
    wall: float
    latest: float


class Player:
    """Plays one session; needs an initialised rclpy.

    Parameters
    ----------
    session : Session
    clock : bool
        Publish the log times on ``/clock`` too.
    """

    def __init__(self, session: Session, clock: bool = False) -> None:
        self._session, self._with_clock = session, clock
        self._topics = _inputs(session)
        self._node = rclpy.create_node(NAME)
        self._publishers = {
            name: self._node.create_publisher(message_class(topic.type), name, qos_profile(topic.qos))
            for name, topic in self._topics.items()
        }
        self._clock: Publisher[Any] | None = None
        if clock:
            self._clock = self._node.create_publisher(message_class(CLOCK_TYPE), CLOCK, 10)

    @property
    def topics(self) -> tuple[str, ...]:
        """The names of what is published."""
        return tuple(self._topics)

    def lonely(self, listeners: int = 1) -> list[str]:
        """The topics that fewer than so many subscriptions have matched."""
        return [name for name, each in self._publishers.items() if each.get_subscription_count() < listeners]

    def wait(self, timeout: float, listeners: int = 1, check: Callable[[], None] = lambda: None) -> list[str]:
        """Wait until every topic is listened to, calling `check` now and then; gives the topics that are not.

        A little longer still, because a subscription may know of its publisher a moment after the publisher of it.
        """
        end = time.monotonic() + timeout
        while (lonely := self.lonely(listeners)) and time.monotonic() < end:
            check()
            time.sleep(LOOK)
        if timeout > 0.0:
            time.sleep(SETTLE)
        return lonely

    def length(self, start: float = 0.0, duration: float | None = None) -> float:
        """Seconds of that part of the session; BagError if it starts after the end."""
        whole = (self._session.end - self._session.start) * NANO
        if start >= whole:
            raise BagError(f"{self._session.path}: nothing from {start:g} s on; the session lasts {whole:.1f} s.")
        return min(whole - start, whole if duration is None else duration)

    def play(self, rate: float = 1.0, start: float = 0.0, duration: float | None = None) -> Iterator[int]:
        """Publish, one message for every step of the iterator; `played` tells afterwards what was sent.

        Parameters
        ----------
        rate : float
            Session time over real time, > 0.
        start, duration : float
            Part of the session, s; all from `start` on without a duration.

        Returns
        -------
        iterator of int
            Nanoseconds of session time that have been played, after every message.

        Raises
        ------
        BagError
            The session cannot be read.
        """
        self._sent: Counter[str] = Counter()
        self._latest = 0.0
        first = self._session.start + round(start / NANO)
        end = self._session.end + 1 if duration is None else first + round(duration / NANO)
        began = time.monotonic()
        for stamp, name, data in self._schedule(first, end):
            due = began + (stamp - first) * NANO / rate
            now = time.monotonic()
            if due > now:
                time.sleep(due - now)
            else:
                self._latest = max(self._latest, now - due)
            self._publish(name, data)
            yield stamp - first
        self._wall = time.monotonic() - began

    @property
    def played(self) -> Played:
        """What the last call of `play` published."""
        return Played(dict(self._sent), self._wall, self._latest)

    def close(self) -> None:
        """Take the publishers away."""
        self._node.destroy_node()

    def _publish(self, name: str, data: bytes) -> None:
        if name == CLOCK:
            assert self._clock is not None
            self._clock.publish(data)
            return
        self._publishers[name].publish(data)
        self._sent[name] += 1

    def _schedule(self, first: int, end: int) -> Iterator[tuple[int, str, bytes]]:
        """Log time (ns), topic and CDR of every message of that span in order, those of the clock among them."""
        encode = jazzy().serialize_cdr
        tick = first
        for name, stamp, message in read(self._session, {name: topic.type for name, topic in self._topics.items()}):
            if not first <= stamp < end:
                continue
            while self._with_clock and tick <= stamp:
                yield tick, CLOCK, _clock(tick)
                tick += CLOCK_PERIOD
            yield stamp, name, bytes(encode(message, self._topics[name].type))


def _inputs(session: Session) -> dict[str, Topic]:
    """The session's input topics by name: strokes, and what else has messages."""
    inputs = load_topics().inputs
    there = {stream: session.find(topic.name) for stream, topic in inputs.items()}
    return {
        topic.name: topic
        for stream, topic in inputs.items()
        if stream is Stream.STROKES or ((info := there[stream]) is not None and info.count)
    }


def _clock(stamp: int) -> bytes:
    """A message for ``/clock`` in CDR."""
    types = jazzy().types
    time_class, clock_class = types["builtin_interfaces/msg/Time"], types[CLOCK_TYPE]
    now = time_class(sec=stamp // 1_000_000_000, nanosec=stamp % 1_000_000_000)
    return bytes(jazzy().serialize_cdr(clock_class(clock=now), CLOCK_TYPE))
