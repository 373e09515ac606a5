"""Live page of a twin that runs in this process, without ROS."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Collection, Mapping
from concurrent.futures import Future
from threading import Thread
from types import TracebackType
from typing import Any, Self

from ..errors import BoomTwinError
from ..messages.topic_table import Topics, load_topics
from ..twin.sample_check import merged
from ..twin.twin import Twin
from ..types import Report, Sample
from . import ACTS, PORT
from .data.bag_feed import TwinView
from .data.feed import Feed
from .data.status import Severity, text
from .data.store import Store
from .server import AccessControl, Server, serving
from .viewer import ViewerActions


class SourceFeed(Feed):
    """Feed from a twin in this process: another thread calls `put`, the server `poll`."""

    def __init__(self, twin: Twin, topics: Topics) -> None:
        most_waiting = 20_000  # largest number of waiting samples; beyond it the oldest are dropped
        super().__init__("live", Store(), topics, twin.scene)
        self._view = TwinView(self, topics, twin)
        self._waiting: deque[tuple[Sample, Report]] = deque(maxlen=most_waiting)

    def put(self, sample: Sample, report: Report) -> None:
        self._waiting.append((sample, report))

    def poll(self) -> None:
        most_at_once = 200  # largest number of samples in one poll, so that pages are served
        for _ in range(min(len(self._waiting), most_at_once)):
            self._view.took(*self._waiting.popleft())

    def now(self) -> float:
        return time.monotonic()

    def publish(self, words: str) -> None:
        self.store.alarms.add("event", Severity.OK, text(words), self.store.newest, self.store.newest)


class LivePage:
    """Context manager that serves the live page of a twin from a thread, see `boom_twin monitor`. It needs aiohttp.

    Call `update` of the page in place of the twin's. It takes about three times the computing time of the twin, in the same
    process. The context first compiles the model.

    Parameters
    ----------
    twin : Twin
    host : str
        Address to listen at. Unless it is 127.0.0.1, viewers need the token in `address`.
    port : int, optional
        0 is any free port. The default is 8420, or any free port if that is taken.
    allow : collection of str
        Permitted actions of viewers: ``mark``, ``acknowledge``.

    Attributes
    ----------
    address : str
        Address of the page within the context.

    Raises
    ------
    BoomTwinError
        The port is taken.
    """

    def __init__(self, twin: Twin, host: str = "127.0.0.1", port: int | None = None, allow: Collection[str] = ACTS) -> None:
        self._twin, self._host, self._port, self.address = twin, host, port, ""
        self._feed = SourceFeed(twin, load_topics().reading(twin.reads))
        self._actions = ViewerActions(self._feed, allow)
        self._begun: Future[str] = Future()
        self._thread = Thread(target=self._run, name="live page", daemon=True)

    def update(self, sample: Sample | Mapping[str, Any], stamp_ns: int | None = None) -> Report:
        """Update the twin as `Twin.update` does, and show the result."""
        reports = []
        for each in self._twin.samples(sample, stamp_ns) if isinstance(sample, Mapping) else [sample]:
            reports.append(self._twin.update(each))
            self._feed.put(each, reports[-1])
        return reports[0] if len(reports) == 1 else merged(reports)

    def __enter__(self) -> Self:
        self._twin.warm_up()
        self._thread.start()
        try:
            self.address = self._begun.result()
        except OSError as error:
            where = f"{self._host}:{PORT if self._port is None else self._port}"
            raise BoomTwinError(f"cannot listen on {where}: {error.strerror}. Choose another port.") from None
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._loop.call_soon_threadsafe(self._stopped.set)
        self._thread.join()

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except BaseException as error:
            if self._begun.done():
                raise
            self._begun.set_exception(error)

    async def _serve(self) -> None:
        self._loop, self._stopped = asyncio.get_running_loop(), asyncio.Event()
        access = AccessControl(self._host)
        async with serving(Server(self._feed, self._actions, access), access, self._host, self._port) as address:
            self._begun.set_result(address)
            await self._stopped.wait()
