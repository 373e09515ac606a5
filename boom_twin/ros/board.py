"""Publishes states on ``/diagnostics`` (REP-107), and logs every change of level."""

from __future__ import annotations

from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.duration import Duration
from rclpy.node import Node

from ..io.topics import Topic
from ..printable import printable
from ..watch.status import Level, Status
from .log import Log
from .qos import qos_profile


class Board:
    """The states of one node.

    Parameters
    ----------
    node : Node
    topic : Topic
        Where they are published.
    """

    def __init__(self, node: Node, topic: Topic) -> None:
        self._node, self._logger = node, Log(node)
        self._name = node.get_fully_qualified_name().lstrip("/")
        self._publisher = node.create_publisher(DiagnosticArray, topic.name, qos_profile(topic.qos))
        self._levels: dict[str, Level] = {}

    def show(self, statuses: Sequence[Status]) -> None:
        """Publish all, and log in one line those whose level is another than before; a new one is taken to have been well."""
        before, self._levels = self._levels, {status.name: status.level for status in statuses}
        self._log([status for status in statuses if before.get(status.name, Level.OK) != status.level])
        message = DiagnosticArray(status=[self._message(status) for status in statuses])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def settle(self) -> None:
        """Wait until those that listen have got it, at most a second."""
        self._publisher.wait_for_all_acked(Duration(seconds=1))

    def _log(self, changed: Sequence[Status]) -> None:
        """Names of the same state together: the sensors of a topic fall silent as one."""
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
            values=[KeyValue(key=key, value=_text(value)) for key, value in status.values.items()],
        )


def _text(value: str | int | float) -> str:
    """As a program reads it: nine digits of a float; what files and other nodes put into a text is escaped, as in the log."""
    return f"{value:.9g}" if isinstance(value, float) else printable(str(value), keep="")
