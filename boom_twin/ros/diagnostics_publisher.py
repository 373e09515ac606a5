"""Publish states on ``/diagnostics`` and log their changes, for any node of this package."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.duration import Duration
from rclpy.node import Node

from ..diagnostics.levels import Level, Status
from ..messages.topic_table import Topic
from ..system.terminal_text import printable
from .runtime import Log, qos_profile

MOST_LINES, LINES_SPAN = 4, 600.0
"""Changes of a component to a warning and back that are logged within so many seconds: on a busy computer they come and go."""


class DiagnosticsPublisher:
    """Publisher of the states of one node.

    Parameters
    ----------
    hardware_id : str
        What is diagnosed; empty: the node's name.
    """

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
        if max(status.level, self._levels.get(status.name, Level.OK)) > Level.WARN:
            return True
        now, times = time.monotonic(), self._logged.setdefault(status.name, deque(maxlen=MOST_LINES))
        if len(times) == MOST_LINES and now - times[0] < LINES_SPAN:
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
