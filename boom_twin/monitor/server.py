"""HTTP and WebSocket server of the live page: access by Host, Origin and token, handlers, start and end."""

from __future__ import annotations

import asyncio
import hmac
import logging
import re
import secrets
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from errno import EADDRINUSE
from functools import partial
from http import HTTPStatus
from ipaddress import ip_address
from pathlib import Path
from typing import Any

from aiohttp import web

from ..errors import UsageError
from ..system.terminal_text import printable
from ..texts import FILE as TEXTS
from . import PORT
from .data.analyst import Analyst
from .data.feed import Feed
from .data.store import is_logged
from .viewer import Viewer, ViewerActions

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


PAGE = Path(__file__).parent / "page"
MAX_VIEWERS = 16
MAX_REQUEST_BYTES = 4096  # largest request of a page, bytes

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Server:
    """Server of the live page for one feed."""

    def __init__(self, feed: Feed, actions: ViewerActions, access: AccessControl) -> None:
        self._feed, self._actions, self._access = feed, actions, access
        self._viewers: set[web.WebSocketResponse] = set()

    def application(self) -> web.Application:
        application = web.Application(middlewares=[self._guard], client_max_size=MAX_REQUEST_BYTES)
        routes = {"/": self._index, "/socket": self._connect, "/page/{name}": self._file}
        application.add_routes([web.get(path, handler) for path, handler in routes.items()])
        application.on_response_prepare.append(_add_policy)
        application.cleanup_ctx.append(self._run)
        application.on_shutdown.append(self._close_viewers)
        return application

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        self._access.check(request)
        return await handler(request)

    async def _index(self, request: web.Request) -> web.FileResponse:
        return web.FileResponse(PAGE / "index.html")

    async def _file(self, request: web.Request) -> web.FileResponse:
        """Return one of the page's own files. The requested name is only compared; no path is made of it."""
        file = next((file for file in (*PAGE.iterdir(), TEXTS) if file.name == request.match_info["name"]), None)
        if file is None:
            raise web.HTTPNotFound(text="there is no such file of the page")
        return web.FileResponse(file)

    async def _connect(self, request: web.Request) -> web.StreamResponse:
        heartbeat = 60.0  # seconds without an answer after which the connection is closed
        if len(self._viewers) >= MAX_VIEWERS:
            raise web.HTTPServiceUnavailable(text=f"{MAX_VIEWERS} pages are open already; close one")
        socket = web.WebSocketResponse(heartbeat=heartbeat, max_msg_size=MAX_REQUEST_BYTES, compress=False)
        self._viewers.add(socket)
        try:
            await socket.prepare(request)
            await Viewer(socket, self._feed, self._actions, self._analyst).serve()
        finally:
            self._viewers.discard(socket)
        return socket

    async def _run(self, application: web.Application) -> AsyncIterator[None]:
        self._analyst = Analyst(self._feed)
        task = asyncio.create_task(self._poll())
        task.add_done_callback(_stop_on_fault)
        yield
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task

    async def _poll(self) -> None:
        poll_period = 1.0 / 60.0  # seconds between two polls of the feed
        while True:
            self._feed.poll()
            await asyncio.sleep(poll_period)

    async def _close_viewers(self, application: web.Application) -> None:
        for socket in set(self._viewers):
            await socket.close()


async def _add_policy(request: web.Request, response: web.StreamResponse) -> None:
    response.headers.update(POLICY)


def _stop_on_fault(task: asyncio.Task[None]) -> None:
    """End the monitor if the feed has failed. A page without data and without a reason would be worse."""
    if not task.cancelled() and (error := task.exception()) is not None:
        asyncio.get_running_loop().call_exception_handler({"message": "the feed failed", "exception": error})
        raise web.GracefulExit


@asynccontextmanager
async def serving(server: Server, access: AccessControl, host: str, port: int | None) -> AsyncIterator[str]:
    """Serve pages within the context; provide their address.

    If `port` is None, it is `PORT`, or any free port if that is taken. 0 is any free port. Raise OSError if `port` is taken.
    """
    runner = web.AppRunner(server.application(), access_log=None, shutdown_timeout=1.0)
    await runner.setup()
    assert runner.server is not None
    try:
        listener = await _listen(partial(Connection, runner.server), host, port)
        number = listener.sockets[0].getsockname()[1]
        yield f"http://{in_address(host)}:{number}/" + (f"?token={access.token}" if access.token else "")
        listener.close()
    finally:
        await runner.cleanup()


async def _listen(connection: Callable[[], Connection], host: str, port: int | None) -> asyncio.Server:
    backlog = 128  # connections that may wait to be accepted; the kernel refuses more
    listen = partial(asyncio.get_running_loop().create_server, connection, host, backlog=backlog)
    try:
        return await listen(PORT if port is None else port)
    except OSError as error:
        if port is not None or error.errno != EADDRINUSE:
            raise
        return await listen(0)
