"""Access control of the live page: Host, Origin and token checks."""

from __future__ import annotations

import hmac
import re
import secrets
from ipaddress import ip_address

from aiohttp import web

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


class AccessControl:
    """Access control of the page: checks Host, Origin and token of every request.

    On loopback the `token` is empty, and the ``Host`` must be `host` or a usual name of this machine. So a page of another
    name that resolves to this machine is refused. Elsewhere the token is needed, once in the address (``/?token=..``), from
    then on in a cookie. A WebSocket must come from a page of this server (``Origin``).
    """

    def __init__(self, host: str) -> None:
        self.token = "" if is_loopback(host) else secrets.token_urlsafe(24)
        self._names = LOCAL | {in_address(host)}

    def check(self, request: web.Request) -> None:
        """Raise HTTPForbidden, or HTTPFound where a token is to be put into a cookie."""
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
        found = web.HTTPFound("/")  # whatever was asked for: no address that a request names is gone to
        found.set_cookie(COOKIE, self.token, httponly=True, samesite="Strict")
        raise found

    def _fits(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(errors="replace"), self.token.encode())
