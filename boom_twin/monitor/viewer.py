"""Viewer of the live page: messages sent to it, its requests, and what it may do.

No message is queued. The rows to send follow from the numbers of the rows already sent. Lamps and alarms are sent in their
present state. A slow page loses rows, but no state of the lamps.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Collection
from math import isfinite
from typing import Any
from unicodedata import category

from aiohttp import WSCloseCode, WSMsgType, web

from .data.analyst import Analyst
from .data.feed import Feed, Playback
from .data.status import MAX_ALARMS
from .data.store import Table
from .protocol import ROWS, alarms, dump, layout, pack, state

SPECTRUM_PERIOD = 1.0
CHUNK = 8000  # largest number of rows in a block
HISTORY = 600.0  # seconds of data that a page gets when it opens or seeks
NEWEST_ROW_ONLY = "shape"  # table of which only the newest row is sent


NO_TEXT = ("Cc", "Cs")  # unicode categories that cannot be published: control characters and surrogates


class ViewerActions:
    """Actions of viewers: those of `ACTS` that are permitted at start. A recording takes no marks."""

    def __init__(self, feed: Feed, permitted: Collection[str]) -> None:
        self._feed = feed
        self.permitted = frozenset(permitted) - (frozenset() if feed.end is None else {"mark"})
        self._acts = {"mark": self._mark, "acknowledge": self._acknowledge}

    def act(self, request: dict[str, Any]) -> dict[str, Any]:
        """Carry out a request and return the answer; raise ValueError if it is unknown."""
        name = request.get("do")
        if name not in self._acts:
            raise ValueError("unknown request")
        if name not in self.permitted:
            return {"kind": "answer", "do": name, "done": False, "words": "not permitted when the monitor was started"}
        return {"kind": "answer", "do": name, "done": True, "words": self._acts[name](request)}

    def _mark(self, request: dict[str, Any]) -> str:
        note_length = 500  # largest number of characters of a note
        note = request.get("note")
        if not isinstance(note, str) or len(note) > note_length or any(category(sign) in NO_TEXT for sign in note):
            raise ValueError(f"a note is a text of at most {note_length} characters, none of them a control character")
        self._feed.publish(f"mark: {note}")
        return f"marked: {note}"

    def _acknowledge(self, request: dict[str, Any]) -> str:
        known = (self._feed.store.alarms.acknowledge(int(number)) for number in request["numbers"][:MAX_ALARMS])
        found = [alarm for alarm in known if alarm is not None]
        for alarm in found if self._feed.end is None else []:
            self._feed.publish(f"acknowledged: {alarm.name}: {alarm.reason}")
        return f"acknowledged: {', '.join(alarm.name for alarm in found)}" if found else "that alarm is not kept any more"


class Viewer:
    """Viewer of one prepared WebSocket."""

    def __init__(self, socket: web.WebSocketResponse, feed: Feed, actions: ViewerActions, analyst: Analyst) -> None:
        self._socket, self._feed, self._actions, self._analyst = socket, feed, actions, analyst
        self._playback = None if feed.end is None else Playback(feed)
        self._sent: dict[str, int] = {}
        self._generation = -1
        self._tables = 0
        self._alarms = ""

    async def serve(self) -> None:
        """Send and receive until one task ends."""
        tasks = [asyncio.create_task(each()) for each in (self._send, self._send_spectra, self._receive)]
        _, others = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in others:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # -- out ----------------------------------------------------------------------------------------------------------

    async def _send(self) -> None:
        state_period = 0.5
        period = 1.0 / 30.0  # seconds between two messages of rows
        feed, told = self._feed, -state_period
        permitted = sorted(self._actions.permitted)
        await self._send_text(
            {"kind": "hello", "title": feed.title, "end": feed.end, "permitted": permitted, "history": HISTORY}
        )
        last = time.monotonic()
        statuses = None
        while not self._socket.closed:
            now = time.monotonic()
            if self._playback is not None:
                self._playback.advance(now - last)
            position = self._position
            last = now
            await self._restart_if_cleared()
            newest = feed.store.statuses(position)
            if newest is not statuses or now - told >= state_period:
                statuses, told = newest, now
                await self._send_state(position)
            await self._send_rows(position)
            await asyncio.sleep(max(0.0, period - (time.monotonic() - now)))

    async def _restart_if_cleared(self) -> None:
        store = self._feed.store
        if store.generation != self._generation:
            self._generation, self._tables, self._sent = store.generation, 0, {}
            await self._send_text({"kind": "reset"})
        if len(store.tables) != self._tables:
            self._tables = len(store.tables)
            await self._send_text(layout(store))

    async def _send_state(self, position: float) -> None:
        feed, play = self._feed, self._playback
        now = feed.now() if play is None else position
        message = state(feed.store, now, position, feed.topic_rows.dropped)
        if play is not None:
            message |= {"position": play.position, "speed": play.speed, "is_held": play.is_held}
            message |= {"end": feed.end, "read": feed.store.newest}
        message |= {"trouble": feed.trouble, "phase": feed.phase}
        await self._send_text(message)
        told = dump(alarms(feed.store.alarms.all))
        if told != self._alarms:
            self._alarms = told
            await self._socket.send_str(told)

    async def _send_rows(self, position: float) -> None:
        """Send all unsent rows, in messages of bounded size; rows that arrive meanwhile wait for the next turn."""
        tables = list(self._feed.store.tables.values())[: self._tables]
        unsent = {number: self._unsent(table, position) for number, table in enumerate(tables)}
        while unsent:
            blocks = []
            for number, (first, end) in list(unsent.items()):
                last = min(end, first + CHUNK)
                if last > first:
                    blocks.append(pack(ROWS, number, *tables[number].rows(first, last)))
                self._sent[tables[number].name] = last
                unsent[number] = (last, end)
                if last == end:
                    del unsent[number]
            if blocks:
                await self._socket.send_bytes(b"".join(blocks))

    def _unsent(self, table: Table, position: float) -> tuple[int, int]:
        behind = 5.0  # largest delay (s) of a page; beyond it, older rows are skipped
        end = table.count if self._playback is None else table.until(position)
        first = self._sent.get(table.name)
        if first is None:
            first = table.until(position - HISTORY)
        elif self._playback is None:
            first = max(first, table.until(position - behind))
        if table.name == NEWEST_ROW_ONLY:
            first = max(first, end - 1)
        return max(first, table.first), end

    async def _send_spectra(self) -> None:
        while not self._socket.closed:
            position = self._position
            found = await self._analyst.spectrum_at(position)
            if found is not None and self._tables:
                lines, block = found
                await self._send_text(lines)
                await self._socket.send_bytes(block)
            await asyncio.sleep(SPECTRUM_PERIOD)

    @property
    def _position(self) -> float:
        """Session time (s) shown: the page gets all data up to it."""
        return self._feed.store.newest if self._playback is None else self._playback.position

    async def _send_text(self, message: dict[str, Any]) -> None:
        await self._socket.send_str(dump(message))

    # -- in -----------------------------------------------------------------------------------------------------------

    async def _receive(self) -> None:
        max_requests = 40  # largest number of requests of a page in a second
        second, count = 0.0, 0
        async for message in self._socket:
            now = time.monotonic()
            second, count = (now, 1) if now - second > 1.0 else (second, count + 1)
            try:
                if count > max_requests or message.type is not WSMsgType.TEXT:
                    raise ValueError("too many requests, or not text")
                answer = self._do(json.loads(message.data))
            except (ValueError, TypeError, KeyError, RecursionError, OverflowError):
                await self._socket.close(code=WSCloseCode.POLICY_VIOLATION, message=b"not a request of this page")
                return
            if answer is not None:
                await self._send_text(answer)

    def _do(self, request: Any) -> dict[str, Any] | None:
        if not isinstance(request, dict):
            raise ValueError("not a request")
        if request.get("do") in ("seek", "speed", "hold"):
            self._control_playback(request["do"], float(request["value"]))
            return None
        return self._actions.act(request)

    def _control_playback(self, what: str, value: float) -> None:
        if (play := self._playback) is None or not isfinite(value):
            raise ValueError("not a recorded session, or not a number")
        before = play.position
        {"seek": play.seek, "speed": play.pace, "hold": play.hold}[what](value)
        if play.position != before:
            self._generation = -1
