"""Who comes in, what they get, what they may do, and what a hostile one is worth."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from aiohttp import ClientSession, ClientWebSocketResponse, CookieJar, WSMsgType, WSServerHandshakeError
from aiohttp.test_utils import TestServer
from monitor.test_monitor_lamps import ERROR, OK, status
from ros_messages import load_topics

from boom_twin import load_scene
from boom_twin.monitor.data.feed import Feed
from boom_twin.monitor.data.store import Store
from boom_twin.monitor.server import AccessControl, Server
from boom_twin.monitor.viewer import ViewerActions

Talk = Callable[[ClientSession, str], Awaitable[None]]


class Made(Feed):
    """A live feed of made-up rows, 200 a second of two columns."""

    def __init__(self, end: float | None = None) -> None:
        super().__init__("made", Store(20_000, keeps_statuses=end is not None), load_topics(), load_scene(), end)
        self.published: list[str] = []
        self.rows(2000)
        self.tell(OK)

    def rows(self, count: int) -> None:
        table = self.store.tables.get("acceleration")
        first = table.count if table else 0
        for row in range(first, first + count):
            self.store.append("acceleration", ["x_m_s2", "z_m_s2"], 10**18 + row * 5_000_000, (row, -row))

    def tell(self, level: int) -> None:
        statuses = [status("boom_twin: model"), status("boom_twin: sensor joint_1", level, "frozen")]
        self.store.set_statuses(self.now(), self.store.statuses(self.now()).updated(self.now(), statuses, 0.0))

    def now(self) -> float:
        return self.store.newest if self.end is not None else 0.0

    def publish(self, words: str) -> None:
        self.published.append(words)


def serve(feed: Feed, talk: Talk, permitted: tuple[str, ...] = (), access: AccessControl | None = None) -> None:
    asyncio.run(_serve(Server(feed, ViewerActions(feed, frozenset(permitted)), access or AccessControl("127.0.0.1")), talk))


Story = Callable[[Made, ClientSession, str], Awaitable[None]]


def served(permitted: tuple[str, ...] = (), end: float | None = None) -> Callable[[Story], Callable[[], None]]:
    """Make a test of a story that is given a feed, a session and the address of the feed's server."""

    def test_of(story: Story) -> Callable[[], None]:
        def test() -> None:
            feed = Made(end)
            serve(feed, partial(story, feed), permitted)

        test.__doc__ = story.__doc__
        return test

    return test_of


async def _serve(server: Server, talk: Talk) -> None:
    async with TestServer(server.application()) as served, ClientSession(cookie_jar=CookieJar(unsafe=True)) as session:
        await asyncio.wait_for(talk(session, str(served.make_url("/"))), 60.0)


def connect(session: ClientSession, url: str, **more: Any) -> Any:
    headers = {"Origin": url.rstrip("/"), **more.pop("headers", {})}
    return session.ws_connect(f"{url}socket", headers=headers, max_msg_size=0, **more)


async def closed(socket: ClientWebSocketResponse) -> int | None:
    """Read until the server closes the socket; return its code."""
    while (await socket.receive()).type in (WSMsgType.TEXT, WSMsgType.BINARY):
        pass
    return socket.close_code


async def until(socket: ClientWebSocketResponse, kind: str, accept: Callable[[Any], bool] = lambda _: True) -> Any:
    """The next message of a kind; ``rows`` and ``density`` have head and times of their first block."""
    while True:
        message = await socket.receive()
        assert message.type in (WSMsgType.TEXT, WSMsgType.BINARY), message
        if message.type is WSMsgType.TEXT:
            found = json.loads(message.data)
        else:
            head = struct.unpack_from("<BBHI", message.data)
            times = np.frombuffer(message.data, "<f8", head[3], 8)
            found = {"kind": ("rows", "density", "past", "response")[head[0] - 1], "head": head, "times": times}
        if found["kind"] == kind and accept(found):
            return found


@served()
async def test_a_viewer_gets_layout_state_history_and_what_comes(feed: Made, session: ClientSession, url: str) -> None:
    async with connect(session, url) as socket:
        assert (await until(socket, "hello"))["end"] is None
        layout = await until(socket, "layout")
        assert layout["tables"] == [{"name": "acceleration", "columns": ["x_m_s2", "z_m_s2"]}]
        assert (await until(socket, "state"))["level"] == "OK"
        assert (await until(socket, "rows"))["head"] == (1, 0, 2, 2000)
        feed.rows(10)
        rows = await until(socket, "rows")
        assert rows["head"][3] == 10 and rows["times"][0] == pytest.approx(10.0)
        feed.store.clear()  # time was set back
        feed.rows(5)
        await until(socket, "reset")
        assert (await until(socket, "rows"))["head"][3] == 5


@served()
async def test_one_that_does_not_read_loses_rows_but_never_a_lamp(feed: Made, session: ClientSession, url: str) -> None:
    async with connect(session, url) as socket:
        await until(socket, "rows")
        transport = socket._response.connection.transport  # type: ignore[union-attr]
        transport.pause_reading()
        for _ in range(50):
            feed.rows(2000)
            await asyncio.sleep(0.01)
        feed.tell(ERROR)
        feed.rows(15_000)
        await asyncio.sleep(0.3)
        transport.resume_reading()
        assert (await until(socket, "alarms", lambda found: found["alarms"]))["alarms"][0]["level"] == "ERROR"
        assert (await until(socket, "state", lambda state: state["level"] == "ERROR"))["time"] == feed.store.newest
        feed.rows(1)
        rows = await until(socket, "rows", lambda rows: rows["times"][-1] == feed.store.newest)
        assert rows["head"][3] < 2000


@served(permitted=("mark",))
async def test_a_flood_of_requests_is_shown_out(feed: Made, session: ClientSession, url: str) -> None:
    async with connect(session, url) as socket:
        for _ in range(200):
            await socket.send_str('{"do": "mark", "note": "x"}')
        assert await closed(socket) == 1008 and len(feed.published) <= 50


@served()
async def test_only_a_page_of_this_server_connects_and_only_it_is_served(feed: Made, session: ClientSession, url: str) -> None:
    for origin in ("http://evil.example", "null", "", "http://127.0.0.1"):
        with pytest.raises(WSServerHandshakeError) as caught:
            await connect(session, url, headers={"Origin": origin})
        assert caught.value.status == 403
    for host, expected in (("evil.example:80", 403), ("localhost:80", 200), ("[::1]:80", 200)):
        async with session.get(url, headers={"Host": host}) as response:
            assert response.status == expected, host
    response = await session.get(url)
    assert "default-src 'self'" in response.headers["Content-Security-Policy"] and "http" not in await response.text()
    for path in ("page/../server.py", "page/%2e%2e/server.py", "server.py", "page/"):
        assert (await session.get(url + path)).status in (403, 404), path
    assert (await session.post(url)).status == 405


def test_elsewhere_than_on_loopback_a_token_is_needed_that_leads_to_the_page_and_nowhere_else() -> None:
    assert not AccessControl("127.0.0.1").token and not AccessControl("::1").token and AccessControl("rig.local").token
    access = AccessControl("0.0.0.0")
    assert len(access.token) >= 32

    async def talk(session: ClientSession, url: str) -> None:
        for path in ("", "page/main.js", "?token=wrong"):
            assert (await session.get(url + path)).status == 403, path
        with pytest.raises(WSServerHandshakeError):
            await connect(session, url)
        opened = await session.get(f"{url}?token={access.token}")
        assert opened.status == 200 and "token" not in str(opened.url)
        async with connect(session, url) as socket:
            await until(socket, "hello")
        for path in ("/", "//evil.example/path", "/%5cevil.example/", "/page/x"):
            head = await ask(url, f"{path}?token={access.token}")
            assert " 302 " in head and "\r\nLocation: /\r\n" in head and "Content-Security-Policy" in head
        head = await ask(url, "/", "Cookie: boom_twin_monitor=\xff")
        assert " 403 " in head and "Content-Security-Policy" in head

    serve(Made(), talk, access=access)


async def ask(url: str, path: str, header: str = "X: y") -> str:
    """Return the head of the answer to a request, which is sent byte by byte as it is."""
    reader, writer = await asyncio.open_connection("127.0.0.1", urlsplit(url).port)
    writer.write(f"GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{header}\r\n\r\n".encode("latin-1"))
    answer = await asyncio.wait_for(reader.read(), 60.0)
    writer.close()
    return answer.partition(b"\r\n\r\n")[0].decode("latin-1") + "\r\n"


@served()
async def test_nothing_is_done_that_was_not_permitted(feed: Made, session: ClientSession, url: str) -> None:
    async with connect(session, url) as socket:
        assert (await until(socket, "hello"))["permitted"] == []
        for request in ({"do": "mark", "note": "x"}, {"do": "acknowledge", "numbers": [1]}):
            await socket.send_json(request)
            assert not (await until(socket, "answer"))["done"]
    assert feed.published == []


@served(permitted=("mark", "acknowledge"))
async def test_a_mark_and_an_acknowledgement_are_published(feed: Made, session: ClientSession, url: str) -> None:
    feed.tell(ERROR)
    async with connect(session, url) as socket:
        number = (await until(socket, "alarms", lambda found: found["alarms"]))["alarms"][0]["number"]
        await socket.send_json({"do": "mark", "note": "hose moved"})
        assert (await until(socket, "answer"))["done"]
        await socket.send_json({"do": "acknowledge", "numbers": [number]})
        assert await until(socket, "alarms", lambda found: found["alarms"][0]["is_acknowledged"])
    assert feed.published == ["mark: hose moved", "acknowledged: sensor joint_1: frozen"]


@served(end=9.0)
async def test_a_recorded_session_is_steered_by_each_viewer_alone(feed: Made, session: ClientSession, url: str) -> None:
    async with connect(session, url) as one, connect(session, url) as other:
        await one.send_json({"do": "hold", "value": 1})
        await one.send_json({"do": "seek", "value": 5.0})
        state = await until(one, "state", lambda state: state["position"] == 5.0)
        assert state["is_held"]
        assert (await until(other, "state", lambda state: state["position"] > 0.4))["position"] < 4.0
        await one.send_json({"do": "seek", "value": 2.0})
        await until(one, "reset")
        rows = await until(one, "rows")
        assert rows["times"][-1] == pytest.approx(2.0)
        await other.send_json({"do": "speed", "value": 10.0})
        assert (await until(other, "state", lambda state: state["position"] == 9.0))["is_held"]
