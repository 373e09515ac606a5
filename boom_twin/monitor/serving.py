"""Context in which a server listens for pages."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from errno import EADDRINUSE
from functools import partial

from aiohttp import web

from . import PORT
from .access_control import AccessControl, in_address
from .connections import Connections
from .server import Server

BACKLOG = 128  # connections that may wait to be accepted; the kernel refuses more


@asynccontextmanager
async def serving(server: Server, access: AccessControl, host: str, port: int | None) -> AsyncIterator[str]:
    """Serve pages within the context; provide their address.

    If `port` is None, it is `PORT`, or any free port if that is taken. 0 is any free port. Raise OSError if `port` is taken.
    """
    runner = web.AppRunner(server.application(), access_log=None, shutdown_timeout=1.0)
    await runner.setup()
    assert runner.server is not None
    try:
        listener = await _listen(Connections(runner.server), host, port)
        number = listener.sockets[0].getsockname()[1]
        yield f"http://{in_address(host)}:{number}/" + (f"?token={access.token}" if access.token else "")
        listener.close()
    finally:
        await runner.cleanup()


async def _listen(connections: Connections, host: str, port: int | None) -> asyncio.Server:
    listen = partial(asyncio.get_running_loop().create_server, connections, host, backlog=BACKLOG)
    try:
        return await listen(PORT if port is None else port)
    except OSError as error:
        if port is not None or error.errno != EADDRINUSE:
            raise
        return await listen(0)
