"""Blocks of encoded messages: many of them at once, in the bytes that they were read from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class MessageBlock:
    """Encoded messages in the order of processing."""

    content: bytes  # bytes of all messages; may hold others
    sources: Integers  # source of each message, a number defined by the maker of the block; shape (k,)
    log_times: NDArray[np.uint64]  # log time of each message, ns; shape (k,)
    starts: Integers  # starts, ends: offsets of the start and the end of each message in `content`; shape (k,)
    ends: Integers

    def __len__(self) -> int:
        return len(self.starts)

    def chosen(self, rows: slice | Integers) -> MessageBlock:
        """Return the messages at `rows`, in that order."""
        return MessageBlock(self.content, self.sources[rows], self.log_times[rows], self.starts[rows], self.ends[rows])

    def data(self, row: int) -> bytes:
        """Return one encoded message."""
        return self.content[self.starts[row] : self.ends[row]]


def gather(content: bytes, places: Integers, size: int) -> NDArray[np.uint8]:
    """Return `size` bytes from each of the `places` in `content`; shape (places, size)."""
    if len(places) == 0:
        return np.empty((0, size), np.uint8)
    windows: NDArray[np.uint8] = np.ndarray((len(content) - size + 1, size), np.uint8, content, strides=(1, 1))
    return windows[places]


def joined(blocks: Sequence[MessageBlock]) -> MessageBlock:
    """Return the messages of all blocks as one block, in the order of the blocks."""
    if len(blocks) == 1:
        return blocks[0]
    if not blocks:
        none = np.zeros(0, np.int64)
        return MessageBlock(b"", none, np.zeros(0, np.uint64), none, none)
    spans = ((block.content, zip(block.starts.tolist(), block.ends.tolist(), strict=True)) for block in blocks)
    content = b"".join(content[start:end] for content, pairs in spans for start, end in pairs)
    ends = np.cumsum(np.concatenate([block.ends - block.starts for block in blocks]))
    sources, log_times = (np.concatenate(rows) for rows in zip(*((b.sources, b.log_times) for b in blocks), strict=True))
    return MessageBlock(content, sources, log_times, np.concatenate([[0], ends[:-1]]), ends)


def by_log_time(block: MessageBlock) -> MessageBlock:
    """Return the messages sorted by log time. Messages of equal log time keep their order."""
    times = block.log_times
    return block if (times[1:] >= times[:-1]).all() else block.chosen(np.argsort(times, kind="stable"))
