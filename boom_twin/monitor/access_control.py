"""Access to the live page: checks of Host, Origin and token; answers to invalid requests."""

from __future__ import annotations

import asyncio
import hmac
import logging
import re
import secrets
from http import HTTPStatus
from ipaddress import ip_address
from pathlib import Path
from typing import Any

from aiohttp import web

from ..errors import UsageError
from ..system.terminal_text import printable
from .data.store import is_logged

LOG = logging.getLogger("boom_twin.monitor.connections")

COOKIE = "boom_twin_monitor"
SOURCES = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; frame-ancestors 'none'"
POLICY = {
    "Content-Security-Policy": SOURCES,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
LOCAL = frozenset({"localhost", "127.0.0.1", "[::1]"})


def is_loopback(host: str) -> bool:
    """Return True if only programs on this machine can reach `host`."""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def in_address(host: str) -> str:
    """Return `host` as written in the address of a page (an IPv6 address in brackets)."""
    return f"[{host}]" if ":" in host else host


TOKEN = re.compile(r"[A-Za-z0-9_.~-]{24,200}")
"""Valid token in a file: characters of addresses and cookies, too long to be guessed."""


def token_of(path: Path) -> str:
    """Return the token in a file; raise UsageError if it is unreadable or holds no valid token."""
    try:
        with path.open(encoding="ascii") as file:
            found = file.read(1000).strip()
    except (OSError, ValueError) as error:
        raise UsageError(f"--token-file {path}: cannot be read ({error}). Give a file with a token.") from None
    if not TOKEN.fullmatch(found):
        bound = "it holds no token of 24 to 200 letters, digits, or signs -_.~"
        raise UsageError(f"--token-file {path}: {bound}. Make one: openssl rand -hex 24 > {path}")
    return found


class AccessControl:
    """Access control of the page: checks Host, Origin and token of every request.

    Without a `token` on loopback, ``Host`` must be `host` or a usual name of this machine. So a page of another name that
    resolves to this machine is refused. Elsewhere, a missing `token` is generated at each start. If there is a token, browsers
    send it once in the address (``/?token=..``), then in a cookie. A WebSocket must come from a page of this server
    (``Origin``).
    """

    def __init__(self, host: str, token: str = "") -> None:
        self.token = token or ("" if is_loopback(host) else secrets.token_urlsafe(24))
        self._names = LOCAL | {in_address(host)}

    def check(self, request: web.Request) -> None:
        """Raise HTTPForbidden or HTTPBadRequest, or HTTPFound to store the token in a cookie."""
        hosts = request.headers.getall("Host", [])
        if len(hosts) != 1 or request.raw_path[:1] not in ("/", "*"):
            raise web.HTTPBadRequest(text="a request names its host once, and its path alone")
        if self.token:
            self._check_token(request)
        elif re.sub(r":[0-9]*$", "", hosts[0]) not in self._names:
            raise web.HTTPForbidden(text="this monitor answers to localhost only")
        if request.path == "/socket" and request.headers.getall("Origin", []) != [f"{request.scheme}://{hosts[0]}"]:
            raise web.HTTPForbidden(text="only a page of this monitor may connect")

    def _check_token(self, request: web.Request) -> None:
        if self._fits(request.cookies.get(COOKIE, "")):
            return
        if not self._fits(request.query.get("token", "")):
            raise web.HTTPForbidden(text="open the address that the monitor printed; it holds the token")
        found = web.HTTPFound("/")  # never redirect to an address that the request names
        found.set_cookie(COOKIE, self.token, httponly=True, samesite="Strict")
        raise found

    def _fits(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(errors="replace"), self.token.encode())


class Connection(web.RequestHandler):
    """Connection whose requests aiohttp reads. Every answer has the headers of `POLICY`, even if the request is invalid."""

    _invalid = 0  # requests of all connections

    def __init__(self, server: web.Server) -> None:
        how: dict[str, Any] = {"keepalive_timeout": 5.0, "lingering_time": 0.0, "auto_decompress": False}  # s, s
        super().__init__(server, loop=asyncio.get_running_loop(), access_log=None, **how)  # type: ignore[arg-type]

    def handle_error(
        self, request: web.BaseRequest, status: int = 500, exc: BaseException | None = None, message: str | None = None
    ) -> web.StreamResponse:
        """Return the answer to an invalid request or a failing handler.

        Invalid requests are logged in a line each, see `is_logged`, disconnected peers are not.
        """
        logged_length = 200  # largest length of a logged error message
        if isinstance(exc, ConnectionError):
            return web.Response(status=status)
        if status == HTTPStatus.BAD_REQUEST:
            Connection._invalid += 1
            if is_logged(Connection._invalid):
                LOG.warning("no request from %s: %s", request.remote, printable(str(message)[:logged_length], keep=""))
            response: web.StreamResponse = web.Response(status=status, text=message)
            response.force_close()
        else:
            response = super().handle_error(request, status, exc, message)
        response.headers.update(POLICY)
        return response
