"""Tasks on Dask distributed: a cluster on this machine or a scheduler that runs elsewhere, and the rows as they come."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from logging import CRITICAL
from math import inf
from threading import Event, Thread
from typing import TYPE_CHECKING

from ..errors import BagError, UsageError
from .session_task import Row, SessionTask, failed

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster

REMEDY = 'Run `pip install "boom_twin[batch]"`.'
ALLOWED = 5
"""Workers that may end while they have a task, before it counts as a failed attempt."""
LOST = 5
"""Seconds without a word of a worker after which another one takes its place; also between counts of the workers."""
CONNECT = 20.0
"""Seconds for a scheduler to answer."""


@contextmanager
def connected(scheduler: str | None, workers: int | None) -> Iterator[Client]:
    """A client of the scheduler at an address, or of a cluster on this machine, which ends with the block.

    Parameters
    ----------
    scheduler : str, optional
        Address, as ``tcp://host:8786``.
    workers : int, optional
        Of a cluster on this machine, a process each; by default as many as it has cores.

    Raises
    ------
    UsageError
        Dask is not installed.
    BagError
        No scheduler answers there.
    """
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        raise UsageError(f"dask is not installed, and batch needs it. {REMEDY}") from None
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=CONNECT, set_as_default=False)
        except (TimeoutError, OSError, ValueError) as error:
            remedy = "Start `dask scheduler`, check host and port."
            raise BagError(f"--scheduler {scheduler}: no Dask scheduler answers ({type(error).__name__}). {remedy}") from None
        with client:
            yield client
        return
    settings = {
        "distributed.scheduler.allowed-failures": ALLOWED,
        "distributed.worker.daemon": False,  # a worker has children of its own
        "distributed.deploy.lost-worker-timeout": f"{LOST}s",
    }
    options = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "memory_limit": 0, "silence_logs": CRITICAL}
    with (
        dask.config.set(settings),
        LocalCluster(n_workers=workers or os.cpu_count(), threads_per_worker=1, processes=True, **options) as cluster,
        Client(cluster, set_as_default=False) as client,
        _kept_up(cluster),
    ):
        yield client


@contextmanager
def _kept_up(cluster: LocalCluster) -> Iterator[None]:
    """Replace workers that have gone for good: Dask restarts one that is killed, but not if that happens while it starts."""
    count, ended = len(cluster.worker_spec), Event()

    def watch() -> None:
        while not ended.wait(LOST):
            cluster.scale(count)

    thread = Thread(target=watch, name="workers", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def rows_of(client: Client, tasks: Sequence[SessionTask], work: Callable[[SessionTask], Row]) -> Iterator[Row]:
    """The rows of all tasks, as they are done.

    No more tasks are with the scheduler than its workers have threads: when a worker ends, Dask counts that against every task
    that waits there, not only against the one that it had at work.
    A task whose workers end (killed, out of memory, a machine that is lost) goes to others; when `ALLOWED` of them have,
    that counts as one of its attempts. What fails in any other way costs its own row only.
    """
    from distributed import as_completed

    waiting, running, attempts = deque(tasks), dict[str, SessionTask](), dict[str, int]()

    def submitted(task: SessionTask) -> Future:
        attempts[task.key] = attempts.get(task.key, 0) + 1
        future = client.submit(work, task, key=f"{task.key}-{attempts[task.key]}", pure=False, retries=0)
        running[future.key] = task
        return future

    done, most, looked = as_completed([], loop=client.loop), 1, -inf

    def fill() -> None:
        nonlocal most, looked
        if (now := time.monotonic()) > looked + LOST:
            most, looked = max(most, sum(client.nthreads().values())), now
        while waiting and len(running) < most:
            done.add(submitted(waiting.popleft()))

    fill()
    for future in done:
        task = running.pop(future.key)
        row, reason = _row_or_reason(future)
        if row is not None:
            yield row
        elif attempts[task.key] <= task.retries:
            done.add(submitted(task))
        else:
            yield failed(task, reason, attempts[task.key])
        future.release()
        fill()


def _row_or_reason(future: Future) -> tuple[Row | None, str]:
    """The row of a task that has ended; else why it has none.

    A worker that ends before its row was fetched takes the row with it: the task runs once more, and may then fail too.
    """
    from distributed import KilledWorker

    try:
        return future.result(), ""
    except KilledWorker:
        return None, f"{ALLOWED} workers that had it were ended from outside. Look for what ends them, as the system's memory."
    except CancelledError:
        return None, f"Dask gave it up ({future.status})"
    except Exception as error:
        return None, f"{type(error).__name__}: {error}"
