"""What spins the node: rclpy's events executor where it works, else its single-threaded one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from .context import STOPPED, one_line

WAKE = 0.2
"""Time (s) between looks at whether it is over."""


def spin(node: Node, is_over: Callable[[], bool]) -> None:
    """Do the node's work until `is_over`, in this one thread: samples are taken in the order of their arrival.

    The events executor takes half the processor time, but it is experimental. Its ``spin`` does not return, so it is driven
    with a finite wait; and where it is missing or fails, the single-threaded executor goes on.
    """
    try:
        _drive(_events_executor(), node, is_over)
    except STOPPED:
        raise
    except Exception as error:
        told = "events executor: %s; the single-threaded executor goes on, at twice the processor time"
        node.get_logger().warning(told % one_line(error))
        _drive(SingleThreadedExecutor(), node, is_over)


def _events_executor() -> Any:
    from rclpy.experimental import EventsExecutor

    return EventsExecutor()


def _drive(executor: Any, node: Node, is_over: Callable[[], bool]) -> None:
    executor.add_node(node)
    never: Future[None] = Future()
    try:
        while not is_over():
            executor.spin_until_future_complete(never, timeout_sec=WAKE)
    finally:
        executor.remove_node(node)
