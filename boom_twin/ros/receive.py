"""Reception of messages without growing queues in rclpy: turns of its executor, and a bounded queue of messages.

The executor puts messages into the queue within some microseconds. Between two of its turns, messages are read for a limited
time. rclpy's events executor calls back once for every arrived message, in one row with services and timers. So messages are
taken from it before they are read. If even that is too slow, `CallbackTurns` drops the executor's row.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from inspect import Parameter, Signature
from math import nan
from typing import Any, Self

from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from ..diagnostics.topic_status import Reception
from ..types import NANO
from .runtime import STOPPED, Log, one_line

WAKE = 0.2  # time (s) between looks at whether it is over
LATE = 0.5  # time (s) of work on messages, without a turn of the timers, after which the row of the events executor is too long
TURN = 10.0
"""Time (s) of a turn of the events executor: each leaves 32 bytes behind in rclpy 7.1, half a megabyte in an hour of `WAKE`."""


class CallbackTurns:
    """Turns in which the callbacks of `node` run: until `is_due`, which is asked every `WAKE` s, or until `end`.

    The events executor takes half the processor time, but it is experimental. Its ``spin`` does not return, with a finite wait
    neither as long as messages come, so a timer ends every turn. It keeps one row of events for messages, services and timers.
    In a flood of messages that row grows without limit. It is then dropped, see `_drop_row`. Where the events executor is
    missing or fails, the single-threaded executor goes on. Its turns are at most one callback long.
    """

    def __init__(self, node: Node, is_due: Callable[[], bool]) -> None:
        self._node, self._is_due = node, is_due
        self._turn, self._last = Future(), 0.0
        self._worked, self._newest = 0.0, time.monotonic()
        self._executors: list[Callable[[], Any]] = [
            lambda: import_module("rclpy.experimental").EventsExecutor(),
            SingleThreadedExecutor,
        ]
        self._executor: Any = None

    def __enter__(self) -> Self:
        self._timer = self._node.create_timer(WAKE, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        return self

    def __exit__(self, *_: object) -> None:
        self._release()
        self._node.destroy_timer(self._timer)

    def is_flooded(self) -> bool:
        """Return True if messages keep timers and services from their turn; ask at every message."""
        pause = 0.05  # most time (s) between two messages that counts as work on messages: one long callback makes no row
        now = time.monotonic()
        self._worked, self._newest = self._worked + min(now - self._newest, pause), now
        return self._worked > LATE

    def run(self) -> None:
        """Run one turn, of `TURN` s at most."""
        self._turn, self._last = Future(), time.monotonic() + TURN
        self._call_back(is_whole=True)

    def poll(self) -> None:
        """Run the next callback that waits, if one does."""
        self._call_back(is_whole=False)

    def end(self) -> None:
        """End the turn that runs."""
        if not self._turn.done():
            self._turn.set_result(None)

    def _look(self) -> None:
        self._worked = 0.0
        if self._is_due() or time.monotonic() >= self._last:
            self.end()

    def _call_back(self, is_whole: bool) -> None:
        try:
            if self.is_flooded() and len(self._executors) > 1:
                self._drop_row()
            if self._executor is None:
                self._executor = self._executors[0]()
                self._executor.add_node(self._node)
            if is_whole and len(self._executors) > 1:
                self._executor.spin_until_future_complete(self._turn, timeout_sec=TURN)
            else:
                self._executor.spin_once(timeout_sec=WAKE if is_whole else 0.0)
        except STOPPED:
            raise
        except Exception as error:
            if len(self._executors) == 1:
                raise
            told = f"events executor: {one_line(error)}; the single-threaded executor goes on, at twice the processor time"
            Log(self._node).warning(told)
            self._release()
            del self._executors[0]

    def _drop_row(self) -> None:
        """Give up the events executor and its row.

        A new one hears only of what arrives from now on. So the single-threaded executor takes all that waits before.
        """
        self._release()
        depths = [each.qos_profile.depth for each in self._node.subscriptions]
        interim, left = SingleThreadedExecutor(), sum(depths) + 2 * max(depths, default=0)  # twice for the timers between
        interim.add_node(self._node)
        while left > 0 and not self._is_due():
            interim.spin_once(timeout_sec=0.0)
            left -= 1
        interim.remove_node(self._node)
        self._worked = 0.0

    def _release(self) -> None:
        if self._executor is not None:
            self._executor.remove_node(self._node)
        self._executor = None


_BOTH = Signature([Parameter(name, Parameter.POSITIONAL_ONLY) for name in ("data", "info")])


def with_information(take: Callable[[bytes, Mapping[str, Any]], None]) -> Callable[..., None]:
    """Wrap `take` for ``create_subscription(.., raw=True)``, so that it gets a message's information too.

    rclpy tells by the signature that the information is wanted; its events executor (7.1) then gives the two as one argument.
    `take` is given the encoded message and its information: ``received_timestamp``, ``source_timestamp`` (ns) and
    ``publication_sequence_number``.
    """

    def put(*received: Any) -> None:
        data, info = received if len(received) == 2 else received[0]
        take(data, info)

    put.__signature__ = _BOTH  # type: ignore[attr-defined]
    return put


LARGEST = 1 << 18
"""Largest message that is read, bytes. A message of a thousand names (the most that are examined) is smaller."""
CATCH_UP = 0.5  # time limit (s) for reading messages before a request whose answer depends on them
BUDGET = 0.01  # time limit (s) for reading messages between two turns of the executor


class _Topic:
    """Waiting messages of one topic with arrival times (ns), and counts."""

    def __init__(self, depth: int, read: Callable[[bytes], None]) -> None:
        self.waiting: deque[tuple[int, bytes]] = deque()
        self.depth, self.read = depth, read
        self.received = self.lost = self.dropped = 0
        self.gone = 0  # dropped messages that are still in `ReceiveQueue._turns`
        self.wait = self.latency = nan
        self.number, self._missed, self._is_numbered = -1, 0, True

    def count(self, number: int | None) -> None:
        """Count a message by its sequence number. A number that does not increase is another publisher's."""
        self.received += 1
        if number is None:
            return
        if number <= self.number:
            self._is_numbered = False
        elif self.number >= 0:
            self._missed += number - self.number - 1
        self.number = number

    def look(self) -> Reception:
        """Return the reception since the last look and start a new interval."""
        self.lost += self._missed if self._is_numbered else 0
        counts = self.received, self.lost, self.dropped, len(self.waiting)
        found = Reception(*counts, self.wait, self.latency, self._is_numbered)
        self._missed, self._is_numbered, self.wait, self.latency = 0, True, nan, nan
        return found


class ReceiveQueue:
    """Queue of messages of several topics, read in the order of their arrival.

    If a topic exceeds its `depth`, its oldest message is dropped. Other topics lose none.
    """

    def __init__(self) -> None:
        self._topics: dict[str, _Topic] = {}
        self._turns: deque[_Topic] = deque()  # topic of each message, by arrival; also of dropped ones
        self.received = 0  # queued messages of all topics
        self.is_behind = False  # the newest message had waited in the executor, so more may wait there
        self.oddities: Counter[str] = Counter()  # discarded messages of all topics, larger than `LARGEST`
        self._on_put: Callable[[], None] | None = None

    def __bool__(self) -> bool:
        """Return True if a message waits."""
        return bool(self._turns) and any(topic.waiting for topic in self._topics.values())

    def open(self, name: str, depth: int, read: Callable[[bytes], None]) -> Callable[..., None]:
        """Return the callback of a raw subscription."""
        fresh = 0.005  # age (s) of a message from the executor above which more are assumed to wait in the executor's queue
        self._topics[name] = topic = _Topic(depth, read)

        def put(data: bytes, info: Mapping[str, Any]) -> None:
            if self._topics.get(name) is not topic:  # closed while this message waited in the executor
                return
            now = time.time_ns()  # the middleware's clock of arrivals
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
            self.is_behind = (now - arrival) * NANO > fresh
            if self._on_put is not None:
                self._on_put()

        return with_information(put)

    def close(self) -> None:
        """Delete all topics and waiting messages."""
        self._topics.clear()
        self._turns.clear()
        self.is_behind = False

    def work(self, budget: float) -> None:
        """Read messages until none waits or `budget` (s) has passed. The last one may exceed it."""
        end = time.monotonic() + budget
        while self._turns:
            topic = self._turns.popleft()
            if topic.gone:  # turn of a dropped message
                topic.gone -= 1
                continue
            arrival, data = topic.waiting.popleft()
            wait = self._since(arrival)
            if not wait <= topic.wait:
                topic.wait = wait
            topic.read(data)
            latency = self._since(arrival)
            if not latency <= topic.latency:
                topic.latency = latency
            if time.monotonic() >= end:
                return

    def serve(self, turns: CallbackTurns) -> None:
        """Run callbacks for one turn and read messages as they arrive, in this thread and in order of arrival.

        The turn ends if a message cannot be read at once: more must be taken from the executor first. In a flood, reading gets
        as much time as taking, so predictions go on.
        """
        intake = 0.2  # time limit (s) for taking messages from the executor before some are read
        if not self:
            self._on_put = partial(self._read_at_once, turns)
            try:
                turns.run()
            finally:
                self._on_put = None
        start, before = time.monotonic(), -1
        if self:
            turns.poll()
        while self.is_behind and self.received != before and time.monotonic() < start + intake:
            before = self.received
            turns.poll()
        self.work(min(max(BUDGET, time.monotonic() - start), CATCH_UP))

    def _read_at_once(self, turns: CallbackTurns) -> None:
        if not self.is_behind:
            self.work(BUDGET)
        if self or turns.is_flooded():
            self._on_put = None
            turns.end()

    def _since(self, arrival: int) -> float:
        return max(0, time.time_ns() - arrival) * NANO

    def catch_up(self) -> None:
        """Read messages that arrived before the present request, for at most `CATCH_UP`."""
        self.work(CATCH_UP)

    def look(self) -> Mapping[str, Reception]:
        """Return the reception of every topic, by name, and start a new interval."""
        return {name: topic.look() for name, topic in self._topics.items()}
