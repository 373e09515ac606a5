"""The log of a node, in which nothing steers the terminal that shows it."""

from __future__ import annotations

from rclpy.node import Node

from ..system.terminal_text import printable


class Log:
    """Log of `node`, with all texts escaped.

    Names and texts in them come from files, messages and other nodes: all is escaped here, so that they neither steer a
    terminal nor make lines of their own.
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
