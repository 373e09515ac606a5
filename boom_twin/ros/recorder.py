"""Records topics as they come over DDS into a session bag, message bytes untouched."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor

from ..errors import BagError
from ..io.storage import Storage
from .wanted import Wanted, subscription_of

NAME = "boom_twin_recorder"
WAKE = 0.1
LOOK = 0.5
"""Seconds between looks for new topics, publishers and the disk."""
COMPLETE = "every required topic has a publisher"


@dataclass(slots=True)
class Count:
    """Messages of one topic.

    Attributes
    ----------
    topic : str
    received, written : int
    missed : int or None
        Published but never received, by the publisher's numbers; None where there were several publishers, or none.
    """

    topic: str
    received: int = 0
    written: int = 0
    missed: int | None = None


class _Channel:
    """One topic while it is recorded."""

    def __init__(self, wanted: Wanted, storage: Storage) -> None:
        self.wanted, self._storage = wanted, storage
        self.subscription: Any = None
        self.count = Count(wanted.name)
        self._key = -1
        self._number: int | None = None
        self._has_one = True

    def open(self, node: Any) -> None:
        """Subscribe, if the type is known by now."""
        if self.subscription is not None:
            return
        found = subscription_of(node, self.wanted)
        if found is not None:
            self._key = self._storage.add(found.recorded)
            self.subscription = node.create_subscription(found.kind, self.wanted.name, self._store, found.qos, raw=True)

    def look(self) -> int:
        """How many publishers there are; with more than one, their numbers tell nothing."""
        number: int = self.subscription.get_publisher_count() if self.subscription is not None else 0
        self._has_one = self._has_one and number <= 1
        return number

    def finish(self, written: Sequence[int]) -> Count:
        """The final count."""
        self.count.written = written[self._key] if self.subscription is not None else 0
        if not self._has_one or self._number is None:
            self.count.missed = None
        return self.count

    def _store(self, data: bytes, info: Mapping[str, Any]) -> None:
        received = info["received_timestamp"]
        number = info["publication_sequence_number"]
        self.count.received += 1
        if number is not None:
            if self._number is not None and number > self._number:
                self.count.missed = (self.count.missed or 0) + number - self._number - 1
            self._number, self.count.missed = number, self.count.missed or 0
        self._storage.put(self._key, received, data, max(info["source_timestamp"], 0), (number or self.count.received) % 2**32)


def record(storage: Storage, wanted: Sequence[Wanted], stopped: Callable[[], bool], tell: Callable[[str], None]) -> list[Count]:
    """Record until `stopped`; needs an initialised rclpy. Log times are those of the reception.

    Parameters
    ----------
    storage : Storage
        Completed at the end.
    wanted : sequence of Wanted
    stopped : callable
        Asked after every message, and ten times a second.
    tell : callable
        Told in words when recording begins, and once every required topic has a publisher (`COMPLETE`).

    Returns
    -------
    list of Count
        By topic.

    Raises
    ------
    BagError
        The bag cannot be written, or not all that was received was written.
    UsageError
        The type of a topic is not installed.
    """
    node = rclpy.create_node(NAME)
    channels = [_Channel(each, storage) for each in wanted]
    try:
        _spin(node, channels, storage, stopped, tell)
    finally:
        written = storage.close()
        node.destroy_node()
    counts = [channel.finish(written) for channel in channels]
    if wrong := [count for count in counts if count.written != count.received]:
        told = "; ".join(f"{count.topic}: {count.received} received, {count.written} written" for count in wrong)
        raise BagError(f"not all that was received was written ({told}). Report this fault.")
    return counts


def _spin(
    node: Any, channels: list[_Channel], storage: Storage, stopped: Callable[[], bool], tell: Callable[[str], None]
) -> None:
    """Receive until `stopped`."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    for channel in channels:
        channel.open(node)
    tell(f"recording {len(channels)} topics; Ctrl-C ends it")
    due, is_complete = 0.0, not any(channel.wanted.required for channel in channels)
    while not stopped():
        if time.monotonic() >= due:
            due = time.monotonic() + LOOK
            storage.check()
            for channel in channels:
                channel.open(node)
            numbers = [channel.look() for channel in channels]
            pairs = zip(channels, numbers, strict=True)
            if not is_complete and all(number for channel, number in pairs if channel.wanted.required):
                is_complete = True
                tell(COMPLETE)
        executor.spin_once(timeout_sec=WAKE)
