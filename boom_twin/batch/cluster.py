"""Sessions in parallel: threads of this process, each of which waits for a session's process, here or on a Dask worker."""

from __future__ import annotations

import json
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING

from ..errors import BagError, UsageError
from .session_task import Row, SessionTask, failed, run_task

if TYPE_CHECKING:
    from distributed import Client

REMEDY = 'Run `pip install "boom_twin[batch]"`.'
KILLED = "the workers that had it were ended from outside. Look for what ends them, as the system's memory."
COUNT_PERIOD = 5  # seconds between two counts of a cluster's workers
CONNECT_TIMEOUT = 20.0  # seconds for a scheduler to answer


@dataclass(frozen=True, slots=True)
class Workers:
    """Workers of a batch: `work` returns the row of one session, `capacity` the number of sessions that may run at once."""

    work: Callable[[SessionTask], Row]
    capacity: Callable[[], int]
    dashboard: str = ""


@contextmanager
def connected(scheduler: str | None, workers: int | None) -> Iterator[Workers]:
    """Yield the workers of the scheduler at an address (``tcp://host:8786``), or those of this process, which opens no port.

    `workers` is the number of sessions at once on this machine, by default that of its cores. UsageError if Dask is not
    installed, BagError if no scheduler answers there.
    """
    if scheduler is None:
        count = workers or os.cpu_count() or 1
        yield Workers(run_task, lambda: count)
        return
    try:
        from distributed import Client
    except ImportError:
        raise UsageError(f"dask is not installed, and --scheduler needs it. {REMEDY}") from None
    try:
        client = Client(scheduler, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (TimeoutError, OSError, ValueError) as error:
        remedy = "Start `dask scheduler`, check host and port."
        raise BagError(f"--scheduler {scheduler}: no Dask scheduler answers ({type(error).__name__}). {remedy}") from None
    with client:
        yield on_dask(client, run_task)


def on_dask(client: Client, work: Callable[[SessionTask], Row]) -> Workers:
    """Return workers that pass `work` to those of a Dask cluster.

    A task whose worker ends (killed, out of memory, a lost machine) goes to another worker. When Dask gives the task up, that
    counts as one of its attempts.
    """
    from distributed import KilledWorker

    def row_of(task: SessionTask) -> Row:
        for attempt in range(1, task.retries + 2):
            future = client.submit(work, task, key=f"{task.key}-{attempt}", pure=False, retries=0)
            try:
                return dict(future.result())
            except KilledWorker:
                reason = KILLED
            except CancelledError:  # as of a row that was lost with its worker
                reason = f"Dask gave it up ({future.status})"
            except Exception as error:
                reason = f"{type(error).__name__}: {error}"
        return failed(task, reason, attempt)

    return Workers(row_of, lambda: sum(client.nthreads().values()), client.dashboard_link)


def rows_of(workers: Workers, tasks: Sequence[SessionTask]) -> Iterator[Row]:
    """Yield the rows of all tasks as they finish. A failed task does not affect other rows.

    A scheduler gets no more tasks than its workers have threads. When a worker ends, Dask counts that against every task
    that waits there, not only against the running one. Workers that join later are used, too.
    """
    waiting, rows, threads = deque(tasks), SimpleQueue[Row](), list[Thread]()

    def go() -> None:
        while waiting:
            task = waiting.popleft()
            try:
                row = workers.work(task)
            except Exception as error:
                row = failed(task, f"{type(error).__name__}: {error}", 1)
            rows.put(json.loads(json.dumps(row, ensure_ascii=False).encode(errors="replace")))  # names that are not UTF-8

    try:
        for _ in tasks:
            row = None
            while row is None:
                for _ in range(min(max(workers.capacity(), 1), len(tasks)) - len(threads)):
                    threads.append(Thread(target=go, daemon=True))  # sessions end with this process, see end_with_caller
                    threads[-1].start()
                try:
                    row = rows.get(timeout=COUNT_PERIOD)
                except Empty:
                    continue
            yield row
    finally:
        waiting.clear()
