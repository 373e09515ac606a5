"""Table of where the pieces of an .mcap file lie: 56 bytes a piece, of which a day's recording has some hundred thousand."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from mcap.records import ChunkIndex
from numpy.typing import NDArray


class ChunkPlace(NamedTuple):
    """Place of a chunk, or of messages outside chunks on end; fields as in ``ChunkIndex``.

    `channels` are those that have messages in it; none if that is not known.
    """

    message_start_time: int
    message_end_time: int
    chunk_start_offset: int
    chunk_length: int
    uncompressed_size: int
    message_index_length: int
    channels: frozenset[int]

    @classmethod
    def of(cls, index: ChunkIndex) -> ChunkPlace:
        """Return what is needed of the index of a chunk."""
        return cls(
            index.message_start_time, index.message_end_time, index.chunk_start_offset, index.chunk_length,
            index.uncompressed_size, index.message_index_length, frozenset(index.message_index_offsets),
        )  # fmt: skip


class ChunkTable:
    """The pieces of a file in the order of its index, which for most files is that of the file."""

    def __init__(self) -> None:
        self._columns = [array("Q") for _ in ChunkPlace._fields]
        self._numbers: dict[frozenset[int], int] = {}
        self._channels: list[frozenset[int]] = []

    def append(self, place: ChunkPlace) -> None:
        """Add one piece."""
        if (number := self._numbers.setdefault(place.channels, len(self._numbers))) == len(self._channels):
            self._channels.append(place.channels)
        for column, value in zip(self._columns, (*place[:-1], number), strict=True):
            column.append(value)

    def __len__(self) -> int:
        return len(self._columns[0])

    def __getitem__(self, row: int) -> ChunkPlace:
        start, end, offset, length, size, index, channels = (column[row] for column in self._columns)
        return ChunkPlace(start, end, offset, length, size, index, self._channels[channels])

    def __iter__(self) -> Iterator[ChunkPlace]:
        return map(self.__getitem__, range(len(self)))

    def by_time(self) -> Iterator[ChunkPlace]:
        """In the order of their first log times, of one time in that of the file."""
        return map(
            self.__getitem__, np.lexsort((self._array("chunk_start_offset"), self._array("message_start_time"))).tolist()
        )

    def by_place(self) -> Iterator[ChunkPlace]:
        """In the order of the file."""
        return map(self.__getitem__, np.argsort(self._array("chunk_start_offset"), kind="stable").tolist())

    def _array(self, name: str) -> NDArray[np.uint64]:
        return np.array(self._columns[ChunkPlace._fields.index(name)], np.uint64)
