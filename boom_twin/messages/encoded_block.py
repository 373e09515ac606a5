"""Blocks of encoded messages as arrays of bytes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..twin.blocks import Integers

Bytes = NDArray[np.uint8]


class EncodedRows(NamedTuple):
    """Messages of one topic and one length."""

    key: str
    places: Integers  # index of each message in the block; shape (k,)
    data: Bytes  # bytes of each message; contiguous, not empty; shape (k, length)


class EncodedBlock(NamedTuple):
    """Encoded messages in the order of writing."""

    log_times: Integers  # log time of each message, ns; shape (n,)
    rows: list[EncodedRows]  # groups that together have every index from 0 to n - 1 once


class EncodedBlockBuilder:
    """Builder of a block from groups of encoded messages, sorted by their samples."""

    def __init__(self) -> None:
        self._groups: list[tuple[str, Integers, Integers, Bytes]] = []

    def add(self, key: str, at: Integers, turns: Integers | int, data: Bytes) -> None:
        """Add messages of one topic and one length for the samples in rows `at`. `turns` is their order within a sample."""
        if len(at):
            self._groups.append((key, at, np.full(len(at), turns), data))

    def add_one(self, key: str, at: int, turn: int, data: bytes) -> None:
        """Add a single message."""
        self.add(key, np.array([at]), turn, np.frombuffer(data, np.uint8)[np.newaxis])

    def block(self, stamps: Integers) -> EncodedBlock:
        """Return the block of all messages. Log times are the stamps (ns) of the samples."""
        if not self._groups:
            return EncodedBlock(stamps[:0], [])
        at, turns = (np.concatenate([group[column] for group in self._groups]) for column in (1, 2))
        order = np.lexsort((turns, at))
        places = np.empty(len(order), np.int64)
        places[order] = np.arange(len(order))
        ends = np.cumsum([len(group[1]) for group in self._groups])
        parts = np.split(places, ends[:-1])
        rows = [EncodedRows(group[0], part, group[3]) for group, part in zip(self._groups, parts, strict=True)]
        return EncodedBlock(stamps[at[order]], rows)
