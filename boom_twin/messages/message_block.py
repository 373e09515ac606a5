"""Blocks of encoded messages: many of them at once, in the bytes that they were read from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class MessageBlock:
    """Encoded messages in the order in which they are to be taken.

    Attributes
    ----------
    content : bytes
        Has all of them, and maybe more.
    sources : ndarray of int64, shape (k,)
        Where each one is from; numbers with a meaning to whoever made the block.
    log_times : ndarray of uint64, shape (k,)
        Nanoseconds.
    starts, ends : ndarray of int64, shape (k,)
        Where each one stands in `content`.
    """

    content: bytes
    sources: Integers
    log_times: NDArray[np.uint64]
    starts: Integers
    ends: Integers

    def __len__(self) -> int:
        return len(self.starts)

    def chosen(self, rows: slice | Integers) -> MessageBlock:
        """Some of them, in the order of `rows`."""
        return MessageBlock(self.content, self.sources[rows], self.log_times[rows], self.starts[rows], self.ends[rows])

    def data(self, row: int) -> bytes:
        """One encoded message."""
        return self.content[self.starts[row] : self.ends[row]]


def gather(content: bytes, places: Integers, size: int) -> NDArray[np.uint8]:
    """So many bytes from each of some places on, which has them; shape (places, size)."""
    if len(places) == 0:
        return np.empty((0, size), np.uint8)
    windows: NDArray[np.uint8] = np.ndarray((len(content) - size + 1, size), np.uint8, content, strides=(1, 1))
    return windows[places]


def joined(blocks: Sequence[MessageBlock]) -> MessageBlock:
    """The messages of all blocks, a block after the other."""
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
    """The same in the order of log times, those of equal times as they stand."""
    times = block.log_times
    return block if (times[1:] >= times[:-1]).all() else block.chosen(np.argsort(times, kind="stable"))
