"""HTTP and WebSocket server of the live page, and the context in which it listens."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from errno import EADDRINUSE
from functools import partial
from pathlib import Path

from aiohttp import web

from ..texts import FILE as TEXTS
from . import PORT
from .access_control import POLICY, AccessControl, Connection, in_address
from .data.analyst import Analyst
from .data.feed import Feed
from .viewer import Viewer, ViewerActions

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
