"""A real server process under odd connections and requests: an honest page gets in, and every answer has its headers."""

from __future__ import annotations

import asyncio
import json
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from aiohttp import ClientSession, WSMsgType
from monitor.conftest import MonitorProcess, monitoring

from boom_twin.monitor.server import POLICY

BUNDLED = Path(__file__).parents[2] / "bags" / "arch_session"
PATIENCE = 240.0
SHAKE = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + "A" * 22 + "=="


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MonitorProcess]:
    """Provide the page of the bundled session. At the end, nothing that was asked of it may have been a fault of the server."""
    log = tmp_path_factory.mktemp("served") / "log"
    with monitoring(log, "--bag", str(BUNDLED), "--host", "127.0.0.2") as process:
        yield process
        assert "Traceback" not in process.said() and process.process.poll() is None


def ask(server: MonitorProcess, request: str) -> bytes:
    """Return the answer to raw bytes, up to its end."""
    with socket.create_connection(server.address, PATIENCE) as link:
        link.sendall(request.encode("latin-1"))
        return b"".join(iter(lambda: link.recv(65536), b""))


def upgrade(server: MonitorProcess) -> bytes:
    return f"GET /socket HTTP/1.1\r\nHost: {server.host}\r\nOrigin: http://{server.host}\r\n{SHAKE}\r\n\r\n".encode()


async def visit(server: MonitorProcess) -> None:
    """As a page does: the document, its files, and the stream with rows."""
    async with asyncio.timeout(PATIENCE), ClientSession() as session:
        for path in ("", "page/main.js", "page/uplot.js", "page/style.css"):
            async with session.get(server.url + path) as answer:
                assert answer.status == 200 and await answer.read()
        origin = {"Origin": f"http://{server.host}"}
        async with session.ws_connect(f"{server.url}socket", headers=origin, max_msg_size=0) as link:
            kinds = set()
            while not {"hello", "state", "rows"} <= kinds:
                message = await link.receive()
                assert message.type in (WSMsgType.TEXT, WSMsgType.BINARY)
                kinds.add(json.loads(message.data)["kind"] if message.type is WSMsgType.TEXT else "rows")


def test_pages_that_reset_their_connection_leave_no_trace(server: MonitorProcess) -> None:
    """More of them than pages may be open, before they are answered and after."""
    for number in range(60):
        with socket.create_connection(server.address, PATIENCE) as link:
            link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closing it resets it
            link.sendall(upgrade(server))
            if number % 3 == 0:
                link.recv(15)
    asyncio.run(visit(server))


CLOSE = "Connection: close"
ODD = {
    "a name of 300": ("GET", "/page/" + "a" * 300, b"404"),
    "a path of 9000": ("GET", "/" + "a" * 9000, b"400"),
    "NUL": ("GET", "/page/%00", b"404"),
    "raw NUL": ("GET", "/page/\0", b"400"),
    "bad escapes": ("GET", "/page/%zz%c0%af%ff", b"404"),
    "up": ("GET", "/page/..%2f..%2fserver.py", b"404"),
    "two slashes": ("GET", "//evil.example/?token=x", b"404"),
    "absolute": ("GET", "http://evil.example/", b"400"),
    "HEAD": ("HEAD", "/", b"200"),
    "TRACE": ("TRACE", "/", b"405"),
    "POST": ("POST", "/", b"405"),
    "OPTIONS": ("OPTIONS", "*", b"404"),
    "CONNECT": ("CONNECT", "evil.example:80", b"400"),
    "no origin": ("GET", "/socket", b"403"),
    "no HTTP": ("\x16\x03\x01", "/", b"400"),
}
HEADERS = {
    "Cookie: boom_twin_monitor=\xff": b"200",
    "Host: evil.example": b"400",
    "X: " + "y" * 20_000: b"400",
    "\r\n".join(f"X{number}: y" for number in range(3000)): b"400",
    "Expect: x\r\nContent-Length: 1": b"417",
    "Range: bytes=99999999-": b"416",
    "Content-Length: 99999999999": b"200",
    "Transfer-Encoding: chunked\r\n\r\nzz": b"400",
}
HOSTS = {"evil.example": b"403", "localhost": b"200", "127.0.0.2": b"200", "127.0.0.3": b"403", "\xff": b"403", "": b"403"}


def test_every_answer_has_the_policy_whatever_is_asked_for(server: MonitorProcess) -> None:
    requests = [
        (f"{method} {path} HTTP/1.1\r\nHost: {server.host}\r\n{CLOSE}", status) for method, path, status in ODD.values()
    ]
    requests += [
        (f"GET / HTTP/1.1\r\nHost: {server.host}\r\n{CLOSE}\r\n{header}", status) for header, status in HEADERS.items()
    ]
    requests += [(f"GET / HTTP/1.1\r\nHost: {host}:80\r\n{CLOSE}", status) for host, status in HOSTS.items()]
    requests += [("GET / HTTP/1.0", b"400")]
    for request, status in requests:
        head, _, body = ask(server, f"{request}\r\n\r\n").partition(b"\r\n\r\n")
        assert head.split(b" ")[1] == status, (request[:200], head)
        for name, value in POLICY.items():
            assert f"\r\n{name}: {value}".encode() in head, request[:200]
        assert b"Traceback" not in body


FRAMES = {
    "not UTF-8": (b"\x81\x82", b"\xff\xff"),
    "compressed": (b"\xc1\x82", b"\x4b\x04"),
    "huge": (b"\x81\xff" + b"\x7f" * 8, b""),
    "of JSON": (b"\x81\xfe\x0f\xa0", b"[" * 4000),
    "of half a character": (b"\x81\xa5", rb'{"do": "mark", "note": "\ud800 \u0000"}'),
}


@pytest.mark.parametrize("name", FRAMES)
def test_a_frame_that_is_none_closes_its_viewer_only(server: MonitorProcess, name: str) -> None:
    head, body = FRAMES[name]
    with socket.create_connection(server.address, PATIENCE) as link:
        link.sendall(upgrade(server))
        link.sendall(head + bytes(4) + body)
        found = b""
        with suppress(ConnectionError):
            while data := link.recv(65536):  # until it is closed
                found = found or data
        assert found.startswith(b"HTTP/1.1 101")
    asyncio.run(visit(server))
