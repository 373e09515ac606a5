"""Records topics as they come over DDS into a session bag, message bytes untouched."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor

from ..io.topics import Topic
from ..io.writer import SessionWriter
from .qos import qos_profile
from .types import message_class

NAME = "boom_twin_recorder"
DEPTH = 4000
"""Messages that may wait for the recorder, for every topic: seconds of a session."""
WAKE = 0.1
FLUSH = 1.0
"""Seconds after which what was recorded is on the disk."""
COMPLETE = "every required topic has a publisher"


def record(
    out: Path,
    topics: Mapping[str, Topic],
    notes: Mapping[str, str],
    stopped: Callable[[], bool],
    tell: Callable[[str], None],
) -> Counter[str]:
    """Record until `stopped`; needs an initialised rclpy. Log times are those of the reception.

    Parameters
    ----------
    out : Path
        Directory of the bag, new or empty.
    topics : dict of str to Topic
        By any key; their absolute names are recorded.
    notes : dict of str to str
        Kept in the bag.
    stopped : callable
        Asked after every message, and ten times a second.
    tell : callable
        Told in words when recording begins, and once every required topic has a publisher (`COMPLETE`).

    Returns
    -------
    Counter
        Messages by key.

    Raises
    ------
    BagError
        The bag cannot be written there.
    """
    counts: Counter[str] = Counter()
    with SessionWriter(out, topics, notes) as bag:
        node = rclpy.create_node(NAME)

        def store(key: str, data: bytes, info: Mapping[str, int]) -> None:
            bag.write_encoded(key, info["received_timestamp"], data)
            counts[key] += 1

        awaited = []
        for key, topic in topics.items():
            kind, qos = message_class(topic.type), qos_profile(topic.qos, DEPTH)
            subscription = node.create_subscription(kind, topic.absolute, partial(store, key), qos, raw=True)
            if topic.required:
                awaited.append(subscription)
        tell(f"recording {len(topics)} topics into {out}; Ctrl-C ends it")
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        due = time.monotonic() + FLUSH
        while not stopped():
            executor.spin_once(timeout_sec=WAKE)
            if time.monotonic() >= due:
                bag.flush()
                if awaited and all(each.get_publisher_count() for each in awaited):
                    awaited.clear()
                    tell(COMPLETE)
                due = time.monotonic() + FLUSH
        node.destroy_node()
    return counts
