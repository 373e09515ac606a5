"""Webhook for alarms: every change of an alarm is posted as JSON to an address, without delaying the page."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

from aiohttp import ClientError, ClientSession, ClientTimeout

from ..errors import UsageError

LOG = logging.getLogger("boom_twin.monitor.webhook")
MAX_WAITING = 100  # largest number of waiting messages; one more replaces the oldest
PAUSES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # pauses (s) before further attempts
POST_TIME = 10.0  # timeout (s) of one attempt
CLOSING_TIME = 2.0  # time (s) for waiting messages when the monitor ends
TRY_AGAIN = (HTTPStatus.REQUEST_TIMEOUT, HTTPStatus.TOO_EARLY, HTTPStatus.TOO_MANY_REQUESTS)
"""Status codes below 500 after which another attempt may succeed."""


class Webhook:
    """Poster of JSON objects to `url` (http or https, else UsageError), each with the name of this machine as ``host``.

    The log names the server only, because a path may hold a secret. Redirections are not followed.
    """

    def __init__(self, url: str) -> None:
        try:
            parts = urlsplit(url)
            self._server, is_right = parts.netloc.rpartition("@")[2], parts.scheme in ("http", "https") and bool(parts.hostname)
            is_right &= parts.port != 0
        except ValueError:
            is_right = False
        if not is_right:
            raise UsageError("--webhook: not an address of http or https. Give one as https://example.org/alarms.")
        self._url, self._host = url, socket.gethostname()
        self._waiting: asyncio.Queue[Mapping[str, Any]] = asyncio.Queue(MAX_WAITING)

    def put(self, message: Mapping[str, Any]) -> None:
        """Queue a message."""
        if self._waiting.full():
            self._give_up(self._waiting.get_nowait(), f"more than {MAX_WAITING} messages wait")
            self._waiting.task_done()
        self._waiting.put_nowait(message)

    @asynccontextmanager
    async def posting(self) -> AsyncIterator[None]:
        """Post messages within a context; at its end, waiting ones have `CLOSING_TIME`."""
        task = asyncio.create_task(self._post_all())
        try:
            yield
        finally:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._waiting.join(), CLOSING_TIME)
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task
            while not self._waiting.empty():
                self._give_up(self._waiting.get_nowait(), "the monitor ends")

    async def _post_all(self) -> None:
        async with ClientSession(timeout=ClientTimeout(total=POST_TIME)) as session:
            while True:
                message = await self._waiting.get()
                reason = "the monitor ends"
                try:
                    reason = await self._attempts(session, message)
                finally:
                    if reason:
                        self._give_up(message, reason)
                    self._waiting.task_done()

    async def _attempts(self, session: ClientSession, message: Mapping[str, Any]) -> str:
        for pause in (*PAUSES, None):
            reason, may_succeed = await self._post(session, message)
            if not reason or not may_succeed:
                return reason
            if pause is not None:
                await asyncio.sleep(pause)
        return f"{reason}; {len(PAUSES) + 1} attempts"

    async def _post(self, session: ClientSession, message: Mapping[str, Any]) -> tuple[str, bool]:
        """Make one attempt. Return the reason of failure or "", and True if another attempt may succeed."""
        try:
            async with session.post(self._url, json={"host": self._host, **message}, allow_redirects=False) as response:
                status = response.status
        except (ClientError, TimeoutError, OSError) as error:
            return f"no connection ({type(error).__name__})", True
        except ValueError as error:
            return f"not posted ({type(error).__name__})", False
        if HTTPStatus.OK <= status < HTTPStatus.MULTIPLE_CHOICES:
            return "", False
        return f"its answer is {status}", status >= HTTPStatus.INTERNAL_SERVER_ERROR or status in TRY_AGAIN

    def _give_up(self, message: Mapping[str, Any], reason: str) -> None:
        told = f"{message['event']} of alarm {message['channel']} ({message['kind']}) from {message['from']}"
        LOG.warning("webhook %s: gave up the message %s: %s", self._server, told, reason)
