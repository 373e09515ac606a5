"""Target ``page``: garbage over HTTP and WebSocket to a real monitor of a recorded session.

A case is a text with one connection a line, in JSON: ``http`` is sent as it stands, ``frames`` after an honest handshake (all
in Latin-1, ``PORT`` stands for the port). Its connections stay open while an honest page comes: that must be served.
"""

from __future__ import annotations

import atexit
import base64
import json
import os
import re
import socket
import struct
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, suppress
from functools import cache
from pathlib import Path
from typing import Any

from numpy.random import Generator

from .bags import base
from .mutate import damaged, pick
from .verdict import Kind, Verdict

SUFFIX = ".jsonl"
HOSTILE, HONEST = "127.0.0.9", "127.0.0.1"
REPLY = 0.1
"""Seconds in which a reply to garbage is looked for."""
PATIENCE = 30.0
"""Seconds in which an honest page is served, on a machine with other work."""
START = 240.0
GROWN = 2**28
"""Bytes that the server may take more than at first."""
PATHS = (
    *("/", "/socket", "/page/", "/page/main.js", "/page/../server.py", "/page/..%2f..%2fserver.py", "/page/%00"),
    *("/%ff", "//evil/..?token=", "/page/" + "x" * 300, "/" + "x" * 9000, "/?" + "a=b&" * 3000, "*", "http://evil/"),
    *("/page//etc/passwd", "/\r\nX: y", "/page/" + "../" * 40),
)
METHODS = ("GET", "HEAD", "POST", "PUT", "OPTIONS", "TRACE", "CONNECT", "get", "G\0T", "X" * 500)
HEADERS = (
    *("Cookie: boom_twin_monitor=\xff", "Cookie: " + "a=b;" * 1000, "Cookie: \x01=\x02", "Host: evil", "Host: [::1"),
    *("Host:", "Host: 127.0.0.1:x", "Origin: null", "Content-Length: -1", "Content-Length: 99999999999"),
    *("Content-Length: 5", "Transfer-Encoding: chunked", "Expect: 100-continue", "Range: bytes=0-0,5-9,3-"),
    *("Range: bytes=9-1", "Range: bytes=-99999999999999999999", "Range: x", "If-Range: x", "If-Modified-Since: never"),
    *("If-None-Match: *", "Accept-Encoding: gzip, br;q=x", "Upgrade: h2c", "Connection: upgrade, close, keep-alive"),
    *("Sec-WebSocket-Version: 99", "Sec-WebSocket-Key: x", "Upgrade: websocket", "X: " + "y" * 9000, "X y", ": x"),
    *("X:\0", " folded", "Content-Type: multipart/form-data"),
)
WORDS = ("seek", "speed", "hold", "mark", "acknowledge", "record", "format", None, [], {}, 1)
VALUES = (0, -1, 1, 1e308, -1e308, 10**400, "1", "nan", None, True, [], {}, "x" * 3000, 0.5, 2**63)
BODIES = (b"[" * 4000, b"\xff\xfe", b"", b"NaN", b'{"do": "seek", "value": NaN}', b"1" * 4000, b"x" * 70000)


@cache
def _server() -> tuple[subprocess.Popen[bytes], int, Path, int]:
    """A running monitor of the session, with its port, its log, and its memory at first."""
    log = Path(tempfile.mkdtemp(prefix="boom_twin_page_")) / "log"
    command = [sys.executable, "-m", "boom_twin.cli.main", "monitor", "--port", "0", "--bag", str(base())]
    with log.open("wb") as file:
        process = subprocess.Popen(command, stderr=file, stdout=file, stdin=subprocess.DEVNULL)
    atexit.register(process.kill)
    end = time.monotonic() + START
    while (found := re.search(r"open http://[^:]+:(\d+)", log.read_text())) is None:
        if process.poll() is not None or time.monotonic() > end:
            raise AssertionError(f"the monitor does not start: {log.read_text()}")
        time.sleep(0.1)
    fault = _honest(int(found[1]))
    assert not fault, fault
    return process, int(found[1]), log, _memory(process.pid)


def _memory(process: int) -> int:
    found = re.search(r"VmRSS:\s*(\d+)", Path(f"/proc/{process}/status").read_text())
    return int(found[1]) * 1024 if found else 0


@cache
def begin() -> None:
    """Start the monitor."""
    _server()


# -- making ---------------------------------------------------------------------------------------------------------------


def make(random: Generator, path: Path) -> Path:
    """Write some connections."""
    lines = [_connection(random) for _ in range(int(random.integers(1, 9)))]
    path = path.with_suffix(SUFFIX)
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path


def _connection(random: Generator) -> dict[str, Any]:
    if random.random() < 0.5:
        return {"frames": "".join(_frame(random) for _ in range(int(pick(random, (1, 3, 60)))))}
    text = f"{pick(random, METHODS)} {pick(random, PATHS)} HTTP/{pick(random, ('1.1', '1.0', '0.9', '2', 'x'))}\r\n"
    if random.random() < 0.7:
        text += "Host: 127.0.0.1:PORT\r\n"
    text += "".join(f"{pick(random, HEADERS)}\r\n" for _ in range(int(random.integers(4))))
    text += "\r\n" + str(pick(random, ("", "", "5\r\nhello\r\n0\r\n\r\n", "ffffffffffffffff\r\n", "-1\r\n", "x" * 5000, text)))
    how = random.random()
    if how < 0.3:
        text = damaged(random, text.encode("latin-1")).decode("latin-1")
    elif how < 0.4:
        text = random.bytes(int(random.integers(2000))).decode("latin-1")
    return {"http": text}


def _frame(random: Generator) -> str:
    """One WebSocket frame, masked with zeros."""
    request = {"do": pick(random, WORDS), **{name: pick(random, VALUES) for name in ("value", "note", "number")}}
    body = json.dumps(request).encode()
    how = random.random()
    if how < 0.2:
        body = damaged(random, body)
    elif how < 0.3:
        body = pick(random, BODIES)
    first = int(pick(random, (0x81, 0x81, 0x81, 0x82, 0x01, 0x80, 0x88, 0x89, 0x8A, 0x83, 0xF1, 0x00)))
    frame = struct.pack(">BBH", first, 0x80 | 126, len(body) % 65536) + bytes(4) + body
    if random.random() < 0.15:
        frame = struct.pack(">BBQ", first, 0x80 | 127, int(pick(random, (2**63, 2**40, 5000, 0)))) + bytes(4) + body
    if random.random() < 0.1:
        frame = damaged(random, frame)
    return frame.decode("latin-1")


# -- judging --------------------------------------------------------------------------------------------------------------


def judge(path: Path) -> Verdict:
    """Send it; meanwhile an honest page comes."""
    process, port, log, memory = _server()
    known, replies = log.stat().st_size, b""
    with ExitStack() as stack:
        for line in path.read_text().splitlines():
            replies += _send(stack, port, json.loads(line))
        fault = _honest(port)
    if process.poll() is not None:
        _server.cache_clear()
        return Verdict(Kind.TRACEBACK, f"the monitor ended with {process.returncode}: {log.read_text()[-2000:]}")
    if fault:
        return Verdict(Kind.HANG, fault)
    said = log.read_bytes()[known:].decode(errors="replace")
    if re.search(rb"^HTTP/1\.\d 500", replies, re.MULTILINE) or "Traceback" in said:
        return Verdict(Kind.TRACEBACK, f"{said[-3000:]}\n{replies[:200]!r}")
    if (grown := _memory(process.pid) - memory) > GROWN:
        return Verdict(Kind.GROWTH, f"the monitor has grown by {grown >> 20} MiB")
    return Verdict(Kind.REFUSED, replies[:80].decode("latin-1")) if b"HTTP/1.1 4" in replies else Verdict(Kind.EQUAL)


def _send(stack: ExitStack, port: int, connection: dict[str, str]) -> bytes:
    """Send one connection's bytes, and leave it open; gives what came back at once."""
    with suppress(OSError):
        link = stack.enter_context(socket.create_connection((HONEST, port), timeout=5.0, source_address=(HOSTILE, 0)))
        if "frames" in connection:
            link.sendall(_handshake(port))
            _until(link, b"\r\n\r\n")
            link.sendall(connection["frames"].encode("latin-1"))
        else:
            link.sendall(connection["http"].replace("PORT", str(port)).encode("latin-1"))
        link.settimeout(REPLY)
        return link.recv(4096)
    return b""


def _handshake(port: int) -> bytes:
    key = base64.b64encode(os.urandom(16)).decode()
    lines = [f"GET /socket HTTP/1.1\r\nHost: {HONEST}:{port}\r\nOrigin: http://{HONEST}:{port}\r\nConnection: Upgrade"]
    lines += ["Upgrade: websocket", "Sec-WebSocket-Version: 13", f"Sec-WebSocket-Key: {key}", "\r\n"]
    return "\r\n".join(lines).encode()


def _until(link: socket.socket, end: bytes) -> bytes:
    got = b""
    while end not in got and (more := link.recv(65536)):
        got += more
    return got


def _honest(port: int) -> str:
    """What an honest page does not get; empty if it gets all."""
    try:
        with socket.create_connection((HONEST, port), timeout=PATIENCE) as link:
            link.sendall(f"GET / HTTP/1.1\r\nHost: {HONEST}:{port}\r\nConnection: close\r\n\r\n".encode())
            page = _until(link, b"</html>")
            if not page.startswith(b"HTTP/1.1 200") or b"Content-Security-Policy" not in page or b"</html>" not in page:
                return f"the page is not served: {page[:300]!r}"
        with socket.create_connection((HONEST, port), timeout=PATIENCE) as link:
            link.sendall(_handshake(port))
            got = _until(link, b'"hello"')
            return "" if b'"hello"' in got else f"the socket is not served: {got[:300]!r}"
    except OSError as error:
        return f"an honest page waits in vain: {error}"
