"""Blocks of the messages of some topics, from all files of a session, in the order of their log times."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ..errors import BagError
from ..messages.message_block import MessageBlock, by_log_time, joined
from ..messages.type_store import decode, jazzy
from .log_clock import LogClock
from .session_file import PARSE_ERRORS, REMEDY, SessionFile, as_bag_error
from .time_window import WHOLE, TimeWindow


class Source(NamedTuple):
    """Source of messages: a file, a topic in it, the `name` by which the topic was requested, and its type."""

    file: Path
    topic: str
    name: str
    type: str


class SessionBlocks:
    """Iterable over blocks of the messages of some topics, sorted by log time, then by file.

    Parameters
    ----------
    files : sequence of (SessionFile, set of int)
        Files, each with the channels to read.
    asked : mapping of str to str
        Name by which each topic is requested, by its name in the files.
    window : TimeWindow
        Time window; messages outside it are left out.

    Raises
    ------
    BagError
        While iterating: a checksum does not fit, or no message is in the window; at the end: the files did not hold what their
        statistics say.
    """

    def __init__(self, files: Sequence[tuple[SessionFile, set[int]]], asked: Mapping[str, str], window: TimeWindow) -> None:
        self.sources: list[Source] = []  # source for each source number of the blocks
        self._window = window
        self._files = [(file, self._numbers(file, channels, asked)) for file, channels in files]

    def _numbers(self, file: SessionFile, channels: set[int], asked: Mapping[str, str]) -> dict[int, int]:
        """Return the index in `sources` by channel; -1 for a channel that was not requested."""
        numbers = dict.fromkeys(file.channels, -1)
        for channel in file.channels.values():
            if channel.id in channels:
                numbers[channel.id] = len(self.sources)
                self.sources.append(Source(file.path, channel.topic, asked[channel.topic], file.type_of(channel)))
        return numbers

    def __iter__(self) -> Iterator[MessageBlock]:
        ahead, files = 0, []
        for file, numbers in self._files:
            with as_bag_error(file.path):
                clock = file.log_clock()
            files.append(_wanted(file, numbers, clock, ahead))
            ahead += clock.total  # the clock stays where it was set to
        blocks = _merged(files)
        return blocks if self._window == WHOLE else self._window.cut(blocks, self._files[0][0].path)

    def decoded(self, block: MessageBlock, row: int) -> Any:
        """Return one decoded message; None for a type unknown to Jazzy. Raise BagError if it cannot be decoded."""
        source = self.sources[block.sources[row]]
        try:
            return decode(block.data(row), source.type) if source.type in jazzy().types else None
        except PARSE_ERRORS as error:
            place = f"{source.file}: topic {source.topic} at log time {block.log_times[row]} ns"
            raise BagError(f"{place}: {error} {REMEDY}") from error


def _wanted(file: SessionFile, numbers: Mapping[int, int], clock: LogClock, ahead: int) -> Iterator[MessageBlock]:
    """Yield blocks of the requested channels of one file (number 0 or more), with log times shifted by `ahead` (ns)."""
    seen: Counter[int] = Counter()
    passed = {channel for channel, number in numbers.items() if number < 0}
    with as_bag_error(file.path):
        for block in file.blocks(passed, clock):
            seen.update(block.sources.tolist())
            unknown = ~np.isin(block.sources, list(numbers))
            end = int(unknown.argmax()) if unknown.any() else len(block)
            if end:
                known = block.chosen(slice(0, end))
                sources = np.array([numbers[channel] for channel in known.sources.tolist()])
                yield replace(known, sources=sources, log_times=known.log_times + np.uint64(ahead))
            if end < len(block):
                raise KeyError(int(block.sources[end]))
        told = {channel: count for channel, count in file.counts.items() if channel not in passed}
        file.check_counts("statistics", told, "read", seen)


def _merged(files: Sequence[Iterator[MessageBlock]]) -> Iterator[MessageBlock]:
    """Yield blocks of the messages of all files, sorted by log time, then by file."""
    filling = [(block for block in file if len(block)) for file in files]
    waiting = [next(file, None) for file in filling]
    while filled := [(number, block) for number, block in enumerate(waiting) if block is not None]:
        last, first = min((block.log_times[-1], number) for number, block in filled)
        due = []
        for number, block in filled:
            if block.log_times[0] <= last:
                side: Literal["left", "right"] = "right" if number <= first else "left"
                end = int(np.searchsorted(block.log_times, last, side))
                due.append(block.chosen(slice(0, end)))
                waiting[number] = block.chosen(slice(end, None))
        yield by_log_time(joined([block for block in due if len(block)]))
        waiting[first] = next(filling[first], None)
