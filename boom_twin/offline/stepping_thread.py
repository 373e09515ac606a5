"""Step the boom of a replay in a thread, ahead of the twin, which repeats the steps.

To step the boom is nearly half of what a twin does, needs the strokes alone, and is compiled code that runs without the
interpreter's lock: on a second core it goes beside the rest, see `boom_twin.estimation.recorded_steps`.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator
from contextlib import closing
from queue import Full, Queue
from threading import Event, Thread
from typing import TYPE_CHECKING, TypeVar

from ..errors import BoomTwinError
from ..twin.blocks import CODES, SampleBlock
from ..types import Array, Change, Stream

if TYPE_CHECKING:  # a replay imports this before it starts its other processes, and the model's modules beside them
    from ..twin.twin import Twin

AHEAD = 8
"""Blocks, and the steps of them, that wait for the twin at most."""
PATIENCE = 0.1
"""Seconds after which a thread that waits for room looks whether anybody still takes what it makes."""

NAME = "stepping"
"""Of the thread."""

Item = TypeVar("Item")
Given = SampleBlock | Change | None


def stepped_ahead(items: Iterable[Given], twin: Twin, other: Twin) -> Generator[Given, None, None]:
    """The items, for `twin` to take each of them as it comes; the steps that it repeats are made by `other`, a twin like it.

    To be closed where it is left before its end: the thread ends then.
    """
    with closing(_ahead(with_steps(items, other))) as made:
        for item in made:
            if isinstance(item, SampleBlock | Change | None):
                yield item
            else:
                twin.recorded_steps.repeat(item)


def with_steps(items: Iterable[Given], twin: Twin) -> Iterator[Given | Array]:
    """The items, and before each block the steps of the boom of `twin` along its strokes.

    Where the twin refuses a sample, so will the one that repeats the steps, which tells why: no more steps are given then.
    """
    twin.recorded_steps.record()
    is_refused = False
    for item in items:
        if not is_refused and item is not None:
            try:
                if isinstance(item, SampleBlock):
                    strokes = item.streams == CODES[Stream.STROKES]
                    twin.update_block(SampleBlock(*(column[strokes] for column in item)))
                else:
                    twin.requests.repeat(item)
            except BoomTwinError:
                is_refused = True
            if len(steps := twin.recorded_steps.taken()):
                yield steps.copy()
        yield item


def _ahead(items: Iterator[Item]) -> Generator[Item, None, None]:
    """The items, made in a thread that is `AHEAD` of who asks for them at most; what it raises is raised here."""
    made, is_over = Queue[tuple[Item] | BaseException | None](AHEAD), Event()

    def put(item: tuple[Item] | BaseException | None) -> None:
        while not is_over.is_set():
            try:
                return made.put(item, timeout=PATIENCE)
            except Full:
                continue

    def make() -> None:
        try:
            for item in items:
                put((item,))
                if is_over.is_set():
                    return
            put(None)
        except BaseException as error:  # handed on
            put(error)

    Thread(target=make, name=NAME, daemon=True).start()
    try:
        while (found := made.get()) is not None:
            if isinstance(found, BaseException):
                raise found
            yield found[0]
    finally:
        is_over.set()
