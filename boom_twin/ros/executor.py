"""What spins the node: rclpy's events executor where it works, else its single-threaded one."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from .context import STOPPED, one_line
from .log import Log
from .receive_queue import ReceiveQueue

WAKE = 0.2
"""Time (s) between looks at whether it is over."""
BUDGET = 0.01
"""Time (s) for messages that wait, between two turns of services and timers."""
INTAKE = 0.2
"""Most time (s) for taking messages over from the executor, before some of them are read."""


def spin(node: Node, queue: ReceiveQueue, is_over: Callable[[], bool]) -> None:
    """Do the node's work until `is_over`, in this one thread: messages are read in the order of their arrival.

    The events executor takes half the processor time, but it is experimental. Its ``spin`` does not return, with a finite wait
    neither as long as messages come, so it is driven callback by callback; and where it is missing or fails, the
    single-threaded executor goes on.
    """
    try:
        _drive(_events_executor(), node, queue, is_over)
    except STOPPED:
        raise
    except Exception as error:
        told = "events executor: %s; the single-threaded executor goes on, at twice the processor time"
        Log(node).warning(told % one_line(error))
        _drive(SingleThreadedExecutor(), node, queue, is_over)


def _events_executor() -> Any:
    from rclpy.experimental import EventsExecutor

    return EventsExecutor()


def _drive(executor: Any, node: Node, queue: ReceiveQueue, is_over: Callable[[], bool]) -> None:
    executor.add_node(node)
    try:
        while not is_over():
            executor.spin_once(timeout_sec=0.0 if queue else WAKE)
            _take_over(executor, queue)
            queue.work(BUDGET)
    finally:
        executor.remove_node(node)


def _take_over(executor: Any, queue: ReceiveQueue) -> None:
    """Let the executor put what has waited in its own row, if any has."""
    end, before = time.monotonic() + INTAKE, -1
    while queue.is_behind and queue.received != before and time.monotonic() < end:
        before = queue.received
        executor.spin_once(timeout_sec=0.0)
