"""rclpy in a process: context, executor, message types and QoS."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from typing import Any

import rclpy
from rclpy.exceptions import ROSInterruptException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from ..errors import UsageError
from ..messages.topic_table import Qos
from .log import Log
from .node.receive_queue import ReceiveQueue

STOPPED = (KeyboardInterrupt, ExternalShutdownException, ROSInterruptException)
"""What ends a spinning process in order."""
NO_PROFILES = "SKIP_DEFAULT_XML_FILE"
"""Set to 1: Fast DDS does not take ``DEFAULT_FASTRTPS_PROFILES.xml``, which may name log files, from the working directory."""


@contextmanager
def ros(arguments: Sequence[str] | None = None) -> Iterator[None]:
    """rclpy, started with the process's or the given ROS arguments, and shut down at the end.

    rclpy's own signal handlers are left out: they close the context at once, and then a node can no longer say that it
    is going. What a signal does is up to Python, see `boom_twin.ros.startup`. Fast DDS takes its profiles from the file that
    ``FASTRTPS_DEFAULT_PROFILES_FILE`` names, and none from the working directory, which may be a received session's.

    Raises
    ------
    UsageError
        The arguments after ``--ros-args`` cannot be used.
    """
    os.environ.setdefault(NO_PROFILES, "1")
    try:
        rclpy.init(args=None if arguments is None else list(arguments), signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # rclpy raises types of its C++ part here
        raise UsageError(f"ROS arguments: {one_line(error)}. Check what follows --ros-args.") from error
    try:
        yield
    finally:
        rclpy.try_shutdown()


def one_line(error: BaseException) -> str:
    """The text of an error of rclpy without line breaks and what its C parts append."""
    return " ".join(re.split(r", at \.?/", str(error))[0].split()).rstrip(".") or type(error).__name__


WAKE = 0.2
"""Time (s) between looks at whether it is over."""
BUDGET = 0.01
"""Time (s) for messages that wait, between two turns of services and timers."""
INTAKE = 0.2
"""Most time (s) for taking messages over from the executor, before some of them are read."""


def spin(node: Node, queue: ReceiveQueue, is_over: Callable[[], bool]) -> None:
    """Do the node's work until `is_over`, in this one thread: messages are read in the order of their arrival.

    The events executor takes half the processor time, but it is experimental. Its ``spin`` does not return, with a finite wait
    neither as long as messages come, so every turn of it is ended from here; and where it is missing or fails, the
    single-threaded executor goes on.
    """
    try:
        _drive(_events_executor(), node, queue, is_over, _read_at_once)
    except STOPPED:
        raise
    except Exception as error:
        told = "events executor: %s; the single-threaded executor goes on, at twice the processor time"
        Log(node).warning(told % one_line(error))
        _drive(SingleThreadedExecutor(), node, queue, is_over, _call_back_once)


def _events_executor() -> Any:
    from rclpy.experimental import EventsExecutor

    return EventsExecutor()


Serve = Callable[[Any, ReceiveQueue], None]


def _drive(executor: Any, node: Node, queue: ReceiveQueue, is_over: Callable[[], bool], serve: Serve) -> None:
    executor.add_node(node)
    try:
        while not is_over():
            serve(executor, queue)
            _take_over(executor, queue)
            queue.work(BUDGET)
    finally:
        executor.remove_node(node)


def _call_back_once(executor: Any, queue: ReceiveQueue) -> None:
    executor.spin_once(timeout_sec=0.0 if queue else WAKE)


def _read_at_once(executor: Any, queue: ReceiveQueue) -> None:
    """Let the executor wait and call back for `WAKE`; messages are read as they come, which saves a turn for each.

    That ends as soon as one cannot be read at once: then more are to be taken over first.
    """
    if queue:
        _call_back_once(executor, queue)
        return
    turn, end = Future(), time.monotonic() + WAKE

    def read() -> None:
        if turn.done():
            return
        if not queue.is_behind:
            queue.work(BUDGET)
        if queue or time.monotonic() >= end:
            turn.set_result(None)

    queue.on_put = read
    try:
        executor.spin_until_future_complete(turn, timeout_sec=WAKE)
    finally:
        queue.on_put = None


def _take_over(executor: Any, queue: ReceiveQueue) -> None:
    """Let the executor put what has waited in its own row, if any has."""
    end, before = time.monotonic() + INTAKE, -1
    while queue.is_behind and queue.received != before and time.monotonic() < end:
        before = queue.received
        executor.spin_once(timeout_sec=0.0)


@cache
def message_class(type_name: str) -> Any:
    """The class of ``package/msg/Name``."""
    package, folder, name = type_name.split("/")
    return getattr(import_module(f"{package}.{folder}"), name)


def qos_profile(qos: Qos, depth: int | None = None) -> QoSProfile:
    """`qos` of ``topics.yaml``; with another depth, if one is given."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth or qos.depth,
        reliability=ReliabilityPolicy[qos.reliability.upper()],
        durability=DurabilityPolicy[qos.durability.upper()],
    )
