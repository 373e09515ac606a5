"""rclpy in a process: context, executor, message types and QoS."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from inspect import Parameter, Signature
from typing import Any, Self

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
from ..system.terminal_text import printable

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


WAKE = 0.2  # time (s) between looks at whether it is over
LATE = 0.5  # time (s) of work on messages, without a turn of the timers, after which the row of the events executor is too long
PAUSE = 0.05  # most time (s) between two messages that counts as work on messages: one long callback makes no row
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
        now = time.monotonic()
        self._worked, self._newest = self._worked + min(now - self._newest, PAUSE), now
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

    Parameters
    ----------
    take : callable
        Is given the encoded message and its information: ``received_timestamp``, ``source_timestamp`` (ns) and
        ``publication_sequence_number``.
    """

    def put(*received: Any) -> None:
        data, info = received if len(received) == 2 else received[0]
        take(data, info)

    put.__signature__ = _BOTH  # type: ignore[attr-defined]
    return put


class Log:
    """Log of `node`. Names and texts in it come from files, messages and other nodes.

    All is escaped here, so that they neither steer a terminal nor make lines of their own.
    """

    def __init__(self, node: Node) -> None:
        self._logger = node.get_logger()

    def info(self, line: str) -> None:
        """Write a line on what goes as it should."""
        self._logger.info(printable(line, keep=""))

    def warning(self, line: str) -> None:
        """Write a line on what is not as it should be."""
        self._logger.warning(printable(line, keep=""))

    def fatal(self, text: str) -> None:
        """Write why the node cannot go on; line breaks stay."""
        self._logger.fatal(printable(text))


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


def node_name(endpoint: Any) -> str:
    """Return namespace and name of the node of a discovered publisher or subscriber."""
    if "UNKNOWN" in endpoint.node_name:  # so rmw calls a node that it has not heard of
        return "a node without a known name"
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"
