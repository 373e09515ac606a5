"""Bounded queue of received messages, so that a flood leaves time for services, timers and diagnostics.

The executor only puts messages here, which takes some microseconds; they are read between two turns of it, for a limited time.
rclpy's events executor calls back once for every message that ever arrived, in one row with services and timers. So messages
are taken over before they are read. Where even that is too slow, `boom_twin.ros.runtime.CallbackTurns` drops the row.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from functools import partial
from math import nan
from typing import Any

from ...diagnostics.topic_status import Reception
from ...types import NANO
from ..runtime import CallbackTurns, with_information

FRESH = 0.005
"""Age (s) of a message, at its receipt from the executor, above which more are taken to stand in the executor's own row."""
LARGEST = 1 << 18
"""Bytes of a message that is put: a thousand names, which are as many as are looked at, take a part of that."""
CATCH_UP = 0.5
"""Most time (s) for reading what arrived before a request, where the answer depends on it."""
BUDGET = 0.01
"""Time (s) for messages that wait, between two turns of services and timers."""
INTAKE = 0.2
"""Most time (s) for taking messages over from the executor, before some of them are read."""


class _Topic:
    """Waiting messages of one topic, with their arrival (ns), and its counts."""

    def __init__(self, depth: int, read: Callable[[bytes], None]) -> None:
        self.waiting: deque[tuple[int, bytes]] = deque()
        self.depth, self.read = depth, read
        self.received = self.lost = self.dropped = 0
        self.gone = 0  # turns of messages that gave way, see `ReceiveQueue._turns`
        self.wait = self.latency = nan
        self.number, self._missed, self._is_numbered = -1, 0, True

    def count(self, number: int | None) -> None:
        """Count a message by its sequence number. A number that is not above the last one is another publisher's."""
        self.received += 1
        if number is None:
            return
        if number <= self.number:
            self._is_numbered = False
        elif self.number >= 0:
            self._missed += number - self.number - 1
        self.number = number

    def look(self) -> Reception:
        """Return the reception of this topic and start a new interval."""
        self.lost += self._missed if self._is_numbered else 0
        counts = self.received, self.lost, self.dropped, len(self.waiting)
        found = Reception(*counts, self.wait, self.latency, self._is_numbered)
        self._missed, self._is_numbered, self.wait, self.latency = 0, True, nan, nan
        return found


class ReceiveQueue:
    """Queue of messages of several topics, read in the order of their arrival.

    Of a topic of which too many wait, the oldest gives way; others do not suffer from it.

    Parameters
    ----------
    clock : callable
        Time of the system, ns: the one by which the middleware notes arrivals.

    Attributes
    ----------
    received : int
        Messages of all topics that were put.
    oddities : Counter
        How many of all topics were left out at once as ``too large``, see `LARGEST`: reading them would take too long.
    share : float
        Messages that wait behind the one that is being read, or was last, of its topic; as a share of what may.
    is_behind : bool
        Whether the newest message had waited for the executor, so that there may be more.
    """

    def __init__(self, clock: Callable[[], int] = time.time_ns) -> None:
        self._clock = clock
        self._topics: dict[str, _Topic] = {}
        self._turns: deque[_Topic] = deque()  # of the topics, for each message that waits, and for those that gave way
        self.received, self.is_behind, self.share = 0, False, 0.0
        self.oddities: Counter[str] = Counter()
        self._on_put: Callable[[], None] | None = None

    def __bool__(self) -> bool:
        """Return True if a message waits."""
        return bool(self._turns) and any(topic.waiting for topic in self._topics.values())

    def open(self, name: str, depth: int, read: Callable[[bytes], None]) -> Callable[..., None]:
        """Return the callback of a raw subscription.

        Parameters
        ----------
        name : str
            Of the topic.
        depth : int
            Most messages that may wait.
        read : callable
            What is to be done with one; it must not raise.
        """
        self._topics[name] = topic = _Topic(depth, read)

        def put(data: bytes, info: Mapping[str, Any]) -> None:
            if self._topics.get(name) is not topic:  # closed while this message stood in the executor's row
                return
            now = self._clock()
            arrival = info["received_timestamp"] or now
            topic.count(info["publication_sequence_number"])
            if len(data) > LARGEST:
                self.oddities["too large"] += 1
                return
            topic.waiting.append((arrival, data))
            self._turns.append(topic)
            if len(topic.waiting) > topic.depth:
                topic.waiting.popleft()
                topic.dropped += 1
                topic.gone += 1
            self.received += 1
            self.is_behind = (now - arrival) * NANO > FRESH
            if self._on_put is not None:
                self._on_put()

        return with_information(put)

    def close(self) -> None:
        """Delete all topics and waiting messages."""
        self._topics.clear()
        self._turns.clear()
        self.is_behind = False

    def work(self, budget: float) -> None:
        """Read messages until none waits or `budget`, s, has passed; the last one may take longer."""
        end = time.monotonic() + budget
        while self._turns:
            topic = self._turns.popleft()
            if topic.gone:  # the oldest of its messages gave way, so that this turn is not another's
                topic.gone -= 1
                continue
            arrival, data = topic.waiting.popleft()
            self.share, wait = len(topic.waiting) / topic.depth, self._since(arrival)
            if not wait <= topic.wait:
                topic.wait = wait
            topic.read(data)
            latency = self._since(arrival)
            if not latency <= topic.latency:
                topic.latency = latency
            if time.monotonic() >= end:
                return

    def serve(self, turns: CallbackTurns) -> None:
        """Let callbacks run for a turn and read messages as they come, in this one thread and in the order of arrival.

        The turn ends as soon as a message cannot be read at once: then more are to be taken over first.
        """
        if self:
            turns.poll()
        else:
            self._on_put = partial(self._read_at_once, turns)
            try:
                turns.run()
            finally:
                self._on_put = None
        end, before = time.monotonic() + INTAKE, -1
        while self.is_behind and self.received != before and time.monotonic() < end:
            before = self.received
            turns.poll()
        self.work(BUDGET)

    def _read_at_once(self, turns: CallbackTurns) -> None:
        if not self.is_behind:
            self.work(BUDGET)
        if self or turns.is_flooded():
            self._on_put = None
            turns.end()

    def _since(self, arrival: int) -> float:
        return max(0, self._clock() - arrival) * NANO

    def catch_up(self) -> None:
        """Read what arrived before a request that is about to be answered, as far as there is time for it."""
        self.work(CATCH_UP)

    def look(self) -> Mapping[str, Reception]:
        """Return the reception of every topic, by name, and start a new interval."""
        return {name: topic.look() for name, topic in self._topics.items()}
