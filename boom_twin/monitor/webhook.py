"""Changes of the alarms about the rig, and the webhook that posts each as JSON to an address without delaying the page."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections import Counter
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from datetime import UTC, datetime, timedelta
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

from aiohttp import ClientError, ClientSession, ClientTimeout

from ..errors import UsageError
from ..types import SECOND
from .data.feed import Feed
from .data.status import ListedAlarm

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


BEGIN, CAUSE, END = "begin", "cause", "end"  # kinds of changes


class AlarmWatch:
    """Watch of one feed's alarms with channel and kind: alarms of the rig's health, and gaps."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self._known: dict[int, tuple[str | None, bool]] = {}  # (cause, has ended) by number of the alarm
        self.begun: Counter[tuple[str, str]] = Counter()  # alarms so far, by channel and kind

    def active(self) -> list[ListedAlarm]:
        """Return the active alarms."""
        return [alarm for alarm in self._feed.store.alarms.all if alarm.fault and alarm.end is None]

    def changes(self) -> list[dict[str, Any]]:
        """Return the changes since the last call, as plain values for JSON, oldest alarm first.

        After a clock was set back, changes wait until the origin of times is known.
        """
        if not self._feed.store.epoch:
            return []
        found: list[dict[str, Any]] = []
        known, self._known = self._known, {}
        for alarm in self._feed.store.alarms.all:
            if not alarm.fault:
                continue
            cause, has_ended = self._known[alarm.number] = alarm.cause, alarm.end is not None
            if alarm.number not in known:
                self.begun[alarm.name, alarm.fault] += 1
                kinds = [BEGIN, END] if has_ended else [BEGIN]
            else:
                before, had_ended = known[alarm.number]
                kinds = [kind for kind, is_new in ((CAUSE, cause != before), (END, has_ended and not had_ended)) if is_new]
            found += [self._change(kind, alarm) for kind in kinds]
        return found

    def _change(self, kind: str, alarm: ListedAlarm) -> dict[str, Any]:
        return {
            "event": kind,
            "boom": self._feed.boom,
            "source": self._feed.title,
            "channel": alarm.name,
            "kind": alarm.fault,
            "cause": alarm.cause,
            "text": alarm.reason,
            "evidence": alarm.evidence,
            "stop": alarm.stops,
            "from": self._date(alarm.begin),
            "to": self._date(alarm.end) if kind == END and alarm.end is not None else None,
        }

    def _date(self, time: float) -> str:
        stamp = self._feed.store.epoch + round(time * SECOND)
        date = datetime.fromtimestamp(stamp // SECOND, UTC) + timedelta(microseconds=stamp % SECOND // 1000)
        return date.isoformat(timespec="microseconds").replace("+00:00", "Z")
