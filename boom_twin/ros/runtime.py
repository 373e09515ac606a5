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
from rclpy.clock import Clock, ClockType
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
"""Exceptions that end a spinning process in order."""
NO_PROFILES = "SKIP_DEFAULT_XML_FILE"
"""Set to 1: Fast DDS does not take ``DEFAULT_FASTRTPS_PROFILES.xml``, which may name log files, from the working directory."""

REMEDIES = {
    "Couldn't parse": "Check what follows --ros-args.",
    "initialize logging": "Set HOME, or ROS_LOG_DIR, to a folder that can be written.",
}
"""Remedies by words of rclpy's errors; `OTHER_REMEDY` for those of its environment (domain, security, middleware)."""
OTHER_REMEDY = "Check the environment variables ROS_*."


@contextmanager
def ros(arguments: Sequence[str] | None = None) -> Iterator[None]:
    """Provide rclpy within a context, started with the process's or the given ROS arguments.

    rclpy's own signal handlers are left out: they close the context at once, and then a node can no longer say that it
    is going. What a signal does is up to Python, see `boom_twin.ros.startup`. Fast DDS takes its profiles from the file that
    ``FASTRTPS_DEFAULT_PROFILES_FILE`` names, and none from the working directory, which may be a received session's.

    Raises
    ------
    UsageError
        The arguments after ``--ros-args``, or what the environment says of ROS, cannot be used.
    """
    os.environ.setdefault(NO_PROFILES, "1")
    try:
        rclpy.init(args=None if arguments is None else list(arguments), signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # rclpy raises types of its C++ part here
        told = one_line(error)
        remedy = next((remedy for words, remedy in REMEDIES.items() if words in told), OTHER_REMEDY)
        raise UsageError(f"ROS cannot start: {told}. {remedy}") from error
    try:
        yield
    finally:
        rclpy.try_shutdown()


def one_line(error: BaseException) -> str:
    """Return the text of an error of rclpy without line breaks and without what its C parts append."""
    return " ".join(re.split(r", at \.?/", str(error))[0].split()).rstrip(".") or type(error).__name__


WAKE = 0.2
"""Time (s) between looks at whether it is over."""
TURN = 10.0
"""Time (s) of a turn of the events executor: each leaves 32 bytes behind in rclpy 7.1, half a megabyte in an hour of `WAKE`."""
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
    turns = _EventTurns(queue, is_over)
    timer = node.create_timer(WAKE, turns.look, clock=Clock(clock_type=ClockType.STEADY_TIME))
    try:
        _drive(_events_executor(), node, queue, is_over, turns.serve)
    except STOPPED:
        raise
    except Exception as error:
        _warn_of_events_executor(node, error)
        _drive(SingleThreadedExecutor(), node, queue, is_over, _call_back_once)
    finally:
        node.destroy_timer(timer)


@contextmanager
def callback_turns(node: Node, is_due: Callable[[], bool]) -> Iterator[Callable[[], None]]:
    """Provide a function that lets the callbacks of `node` run until `is_due`, which is asked every `WAKE` s, or sooner.

    The events executor runs them, whose turns a timer ends, see `spin`; the single-threaded one where that one is missing
    or fails.
    """
    turn, executors = Future(), [_events_executor, SingleThreadedExecutor]
    executor: Any = None

    def look() -> None:
        if is_due() and not turn.done():
            turn.set_result(None)

    def call_back() -> None:
        nonlocal turn, executor
        turn = Future()
        try:
            if executor is None:
                executor = executors[0]()
                executor.add_node(node)
            if len(executors) > 1:
                executor.spin_until_future_complete(turn, timeout_sec=TURN)
            else:
                executor.spin_once(timeout_sec=WAKE)
        except STOPPED:
            raise
        except Exception as error:
            if len(executors) == 1:
                raise
            _warn_of_events_executor(node, error)
            if executor is not None:
                executor.remove_node(node)
            executor = None
            del executors[0]

    timer = node.create_timer(WAKE, look, clock=Clock(clock_type=ClockType.STEADY_TIME))
    try:
        yield call_back
    finally:
        if executor is not None:
            executor.remove_node(node)
        node.destroy_timer(timer)


def _warn_of_events_executor(node: Node, error: Exception) -> None:
    told = "events executor: %s; the single-threaded executor goes on, at twice the processor time"
    Log(node).warning(told % one_line(error))


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


class _EventTurns:
    """Turns of the events executor, in which it waits and calls back; messages are read as they come.

    One ends as soon as a message cannot be read at once: then more are to be taken over first. `look`, which a timer calls,
    ends it when it is over, or has lasted for `TURN`.
    """

    def __init__(self, queue: ReceiveQueue, is_over: Callable[[], bool]) -> None:
        self._queue, self._is_over = queue, is_over
        self._turn, self._end = Future(), 0.0

    def serve(self, executor: Any, queue: ReceiveQueue) -> None:
        """Run one turn."""
        if queue:
            _call_back_once(executor, queue)
            return
        self._turn, self._end = Future(), time.monotonic() + TURN
        queue.on_put = self._read
        try:
            executor.spin_until_future_complete(self._turn, timeout_sec=TURN)
        finally:
            queue.on_put = None

    def look(self) -> None:
        """End the turn, if it is time."""
        if not self._turn.done() and (self._is_over() or time.monotonic() >= self._end):
            self._turn.set_result(None)

    def _read(self) -> None:
        if self._turn.done():
            return
        if not self._queue.is_behind:
            self._queue.work(BUDGET)
        if self._queue:
            self._turn.set_result(None)


def _take_over(executor: Any, queue: ReceiveQueue) -> None:
    """Let the executor queue the messages that have waited in its own row, if there are any."""
    end, before = time.monotonic() + INTAKE, -1
    while queue.is_behind and queue.received != before and time.monotonic() < end:
        before = queue.received
        executor.spin_once(timeout_sec=0.0)


@cache
def message_class(type_name: str) -> Any:
    """Return the class of ``package/msg/Name``."""
    package, folder, name = type_name.split("/")
    return getattr(import_module(f"{package}.{folder}"), name)


def qos_profile(qos: Qos, depth: int | None = None) -> QoSProfile:
    """Return the QoS profile of `qos` in ``topics.yaml``; with another depth, if one is given."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth or qos.depth,
        reliability=ReliabilityPolicy[qos.reliability.upper()],
        durability=DurabilityPolicy[qos.durability.upper()],
    )
