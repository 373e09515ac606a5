"""rclpy in a process: context, executor, message types and QoS."""

from __future__ import annotations

import os
import re
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.duration import Duration
from rclpy.exceptions import ROSInterruptException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from ..diagnostics.levels import Level, Status
from ..errors import UsageError
from ..messages.topic_table import Qos, Topic
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

    rclpy's own signal handlers are left out: they close the context at once, and then a node can no longer say that it is
    going. What a signal does is up to Python, see `boom_twin.ros.startup`. Fast DDS takes its profiles from the file that
    ``FASTRTPS_DEFAULT_PROFILES_FILE`` names, and none from the working directory, which may be a received session's. Raise
    UsageError if the arguments after ``--ros-args``, or what the environment says of ROS, cannot be used.
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
    """Return the text of an error of rclpy without line breaks and without the source place that its C parts append."""
    return " ".join(re.split(r", at \.?/", str(error))[0].split()).rstrip(".") or type(error).__name__


class Log:
    """Log of `node`. Names and texts in it come from files, messages and other nodes.

    All is escaped here, so that they neither steer a terminal nor make lines of their own.
    """

    def __init__(self, node: Node) -> None:
        self._logger = node.get_logger()

    def info(self, line: str) -> None:
        """Log a line at level INFO."""
        self._logger.info(printable(line, keep=""))

    def warning(self, line: str) -> None:
        """Log a line at level WARN."""
        self._logger.warning(printable(line, keep=""))

    def fatal(self, text: str) -> None:
        """Log the reason for the end of the node at level FATAL; line breaks stay."""
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


class DiagnosticsPublisher:
    """Publisher of the statuses of one node. `hardware_id` names the diagnosed machine; empty: the node's name."""

    def __init__(self, node: Node, topic: Topic, hardware_id: str = "") -> None:
        self._node, self._logger = node, Log(node)
        self._name = node.get_fully_qualified_name().lstrip("/")
        self._hardware_id = hardware_id or self._name
        self._publisher = node.create_publisher(DiagnosticArray, topic.name, qos_profile(topic.qos))
        self._levels: dict[str, Level] = {}
        self._logged: dict[str, deque[float]] = {}

    def show(self, statuses: Sequence[Status]) -> None:
        """Publish all statuses; log in one line those whose level differs from the logged one, which is OK for a new status."""
        before = {status.name: self._levels.get(status.name, Level.OK) for status in statuses}
        changed = [status for status in statuses if before[status.name] != status.level and self._is_due(status)]
        self._levels = before | {status.name: status.level for status in changed}
        self._log(changed)
        message = DiagnosticArray(status=[self._message(status) for status in statuses])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def settle(self) -> None:
        """Wait until subscribers have received everything, at most a second."""
        self._publisher.wait_for_all_acked(Duration(seconds=1))

    def _is_due(self, status: Status) -> bool:
        """Return True if a change of level is logged now.

        An error and its end are always logged. Other changes of a component are limited in rate.
        """
        most_lines, lines_span = 4, 600.0  # logged changes of a component, in so many seconds
        if max(status.level, self._levels.get(status.name, Level.OK)) > Level.WARN:
            return True
        now, times = time.monotonic(), self._logged.setdefault(status.name, deque(maxlen=most_lines))
        if len(times) == most_lines and now - times[0] < lines_span:
            return False
        times.append(now)
        return True

    def _log(self, changed: Sequence[Status]) -> None:
        """Log the changed statuses, those with one message together: the sensors of a topic fall silent as one."""
        groups: dict[str, list[str]] = {}
        for status in changed:
            groups.setdefault(status.message, []).append(status.name)
        text = "; ".join(f"{', '.join(names)}: {message}" for message, names in groups.items())
        if any(status.level != Level.OK for status in changed):
            self._logger.warning(text)
        elif changed:
            self._logger.info(text)

    def _message(self, status: Status) -> DiagnosticStatus:
        return DiagnosticStatus(
            name=f"{self._name}: {status.name}",
            level=bytes([status.level]),
            message=_text(status.message),
            hardware_id=self._hardware_id,
            values=[KeyValue(key=key, value=_text(value)) for key, value in status.values.items()],
        )


def _text(value: str | int | float) -> str:
    """Return a value as text for a program: a float with nine digits, a text with control characters escaped, as in the log."""
    return f"{value:.9g}" if isinstance(value, float) else printable(str(value), keep="")
