"""Threads of a replay beside the twin: one reads ahead, one writes the result bag.

Kernels and compression release the interpreter's lock, so two cores are used. Each queue has one producer and one consumer, so
order and bytes are those of a single thread.
"""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from ..bag.writer import RESULT_CHUNK_SIZE, MessageWriter
from ..config.settings import Settings
from ..messages.report_encoder import ReportEncoder
from ..messages.topic_table import Output, Topic, Topics
from ..scene.schema import Scene
from ..twin.blocks import ReportBlock
from ..types import Report

ITEMS_AHEAD = 8  # blocks of samples, or of reports, that wait between two threads
SWITCH_INTERVAL = 2e-5
"""Time (s) that a thread keeps the interpreter's lock while another waits; a call of the twin's kernel takes 1 ms."""
Item = TypeVar("Item")


@contextmanager
def quick_switches() -> Iterator[None]:
    """Shorten the switch interval of threads, so that the twin does not wait for the decoder of messages."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        yield
    finally:
        sys.setswitchinterval(usual)


def read_ahead(items: Iterable[Item]) -> Generator[Item]:
    """Yield the items of an iterable; a thread reads up to `ITEMS_AHEAD` of them in advance."""
    iterator, end = iter(items), object()
    thread = ThreadPoolExecutor(1, "read")
    try:
        waiting = deque(thread.submit(next, iterator, end) for _ in range(ITEMS_AHEAD))
        while (item := waiting.popleft().result()) is not end:
            waiting.append(thread.submit(next, iterator, end))
            yield item  # type: ignore[misc]
    finally:
        thread.shutdown(cancel_futures=True)


@contextmanager
def result_bag(
    directory: Path, notes: Mapping[str, str], topics: Topics, scene: Scene, settings: Settings
) -> Iterator[Callable[[list[ReportBlock | Report]], None]]:
    """Yield a function that queues reports for a thread, which writes them to a bag.

    The bag is complete if the block ends without an exception.

    Raises
    ------
    BagError
        The bag cannot be written. The function raises it, too.
    """
    encoder = ReportEncoder(scene, settings, topics.frame)
    outputs: dict[str, Topic] = {key: topic for key, topic in topics.outputs.items() if key is not Output.DIAGNOSTICS}
    with MessageWriter(directory, outputs, notes, chunk_size=RESULT_CHUNK_SIZE) as bag:
        thread, waiting = ThreadPoolExecutor(1, "write"), deque[Future[None]]()

        def write(found: list[ReportBlock | Report]) -> None:
            for each in found:
                if isinstance(each, ReportBlock):
                    bag.write_block(encoder.fill_block(each))
                    continue
                for report in each.all:
                    for key, data in encoder.fill(report):
                        bag.write_encoded(key, report.stamp, data)

        def put(found: list[ReportBlock | Report]) -> None:
            if len(waiting) == ITEMS_AHEAD:
                waiting.popleft().result()
            waiting.append(thread.submit(write, found))

        try:
            yield put
            for each in waiting:
                each.result()
        finally:
            thread.shutdown(cancel_futures=True)
