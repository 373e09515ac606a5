"""Limits on peers: idle time of a connection, number of connections of an address, lines of the log.

A silent connection (no complete request yet) is closed after a timeout. If there are too many, a new one replaces the
oldest. A page sends its request at once, so a thousand silent connections do not keep it out. Accepted connections are counted
separately. Viewers' WebSockets are not counted here, see `boom_twin.monitor.server.MAX_VIEWERS`.
"""

from __future__ import annotations

import asyncio
import logging
import sys
import time
from http import HTTPStatus
from typing import Any

from aiohttp import web

from ..system.terminal_text import printable
from .access_control import POLICY

LOG = logging.getLogger("boom_twin.monitor.connections")
REQUEST_TIME = 5.0  # timeout (s) of a connection's first complete request, and of each further one
LATE = f"it sent no request within {REQUEST_TIME:g} s"
LOGGED_LENGTH = 200  # largest length of a logged error message
MAX_CONNECTIONS, MAX_OF_ADDRESS = 256, 64  # largest number of silent or accepted connections: in total, and of one address


class Connections:
    """Connections to one server: silent ones, and those of which a request was accepted."""

    def __init__(self, server: web.Server) -> None:
        self._server = server
        self._all: dict[Connection, bool] = {}  # True if accepted; in order of last use

    def __call__(self) -> Connection:
        """Return a new connection, as `asyncio.loop.create_server` requires."""
        return Connection(self._server, self)

    def count(self, connection: Connection, is_accepted: bool) -> None:
        """Count a connection as the newest of its kind; cut off the oldest one if there are too many."""
        self.end(connection)
        kind = [each for each, accepted in self._all.items() if accepted is is_accepted]
        same = [each for each in kind if each.address == connection.address]
        if len(same) >= MAX_OF_ADDRESS or len(kind) >= MAX_CONNECTIONS:
            self.cut_off(same[0] if len(same) >= MAX_OF_ADDRESS else kind[0], "a newer one")
        self._all[connection] = is_accepted

    def end(self, connection: Connection) -> None:
        """Stop counting a connection that is closed or became a viewer's."""
        self._all.pop(connection, None)

    def cut_off(self, connection: Connection, reason: str) -> None:
        """Close a connection without an answer."""
        self.end(connection)
        LOG.warning("cut off a connection of %s: %s", connection.address, reason)
        connection.abort()


class Connection(web.RequestHandler):
    """Connection whose requests aiohttp reads. Every answer has the headers of `POLICY`, even if the request is invalid."""

    __slots__ = ("_all", "_deadline", "address")

    def __init__(self, server: web.Server, everyone: Connections) -> None:
        loop = asyncio.get_running_loop()
        how: dict[str, Any] = {"keepalive_timeout": REQUEST_TIME, "lingering_time": 0.0, "auto_decompress": False}
        super().__init__(server, loop=loop, access_log=None, **how)  # type: ignore[arg-type]
        self._all, self.address = everyone, ""
        self._deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start waiting for a request."""
        super().connection_made(transport)
        self.address = str((transport.get_extra_info("peername") or [""])[0])
        self._deadline = asyncio.get_running_loop().call_later(REQUEST_TIME, self._all.cut_off, self, LATE)
        self._all.count(self, is_accepted=False)

    def connection_lost(self, exc: BaseException | None) -> None:
        """Stop counting the closed connection."""
        self._cancel_deadline()
        self._all.end(self)
        super().connection_lost(exc)

    def accept(self) -> None:
        """Count the connection as accepted."""
        self._cancel_deadline()
        self._all.count(self, is_accepted=True)

    def become_viewer(self) -> None:
        """Stop counting the connection, because it is now a WebSocket."""
        self._all.end(self)

    def abort(self) -> None:
        """Close the connection without an answer."""
        self._cancel_deadline()
        if self.transport is not None:
            self.transport.abort()

    def handle_error(
        self, request: web.BaseRequest, status: int = 500, exc: BaseException | None = None, message: str | None = None
    ) -> web.StreamResponse:
        """Return the answer to an invalid request or a failing handler.

        An invalid request is logged in one line, a disconnected peer is not.
        """
        if isinstance(exc, ConnectionError):
            return web.Response(status=status)
        if status == HTTPStatus.BAD_REQUEST:
            LOG.warning("no request from %s: %s", self.address, printable(str(message)[:LOGGED_LENGTH], keep=""))
            response: web.StreamResponse = web.Response(status=status, text=message)
            response.force_close()
        else:
            response = super().handle_error(request, status, exc, message)
        response.headers.update(POLICY)
        return response

    def _cancel_deadline(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


LOG_PERIOD = 10.0  # period (s) of the log's rate limit
MAX_LOG_LINES = 3  # largest number of records of one logger in a `LOG_PERIOD`


class LogRateLimit(logging.Filter):
    """Filter that passes `MAX_LOG_LINES` records of each logger in a `LOG_PERIOD`.

    The first record after the period states how many were left out.
    """

    def __init__(self) -> None:
        super().__init__()
        self._periods: dict[str, tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Return True if the record is to be written."""
        now = time.monotonic()
        begin, count = self._periods.get(record.name, (now, 0))
        if now - begin >= LOG_PERIOD:
            if count > MAX_LOG_LINES:
                left_out = f"({count - MAX_LOG_LINES} lines before this were left out)"
                record.msg, record.args = f"{record.getMessage()} {left_out}", None
            begin, count = now, 0
        self._periods[record.name] = begin, count + 1
        return count < MAX_LOG_LINES


def write_log() -> None:
    """Write warnings of all loggers of this process to standard error, limited by `LogRateLimit`."""
    handler = logging.StreamHandler(sys.stderr)
    handler.addFilter(LogRateLimit())
    logging.basicConfig(level=logging.WARNING, format="%(message)s", handlers=[handler])
