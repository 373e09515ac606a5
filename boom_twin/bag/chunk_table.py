"""Table of where the chunks of an .mcap file lie: 40 bytes a chunk, of which a day's recording has some hundred thousand."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray


class ChunkPlace(NamedTuple):
    """What is needed of a ``ChunkIndex`` to read its chunk; fields as there."""

    message_start_time: int
    message_end_time: int
    chunk_start_offset: int
    chunk_length: int
    uncompressed_size: int


class _Index(Protocol):
    """What has these fields: `ChunkPlace`, and ``mcap.records.ChunkIndex``."""

    @property
    def message_start_time(self) -> int: ...
    @property
    def message_end_time(self) -> int: ...
    @property
    def chunk_start_offset(self) -> int: ...
    @property
    def chunk_length(self) -> int: ...
    @property
    def uncompressed_size(self) -> int: ...


class ChunkTable:
    """The chunks of a file in the order of its index; empty where it has none."""

    def __init__(self) -> None:
        self._columns = [array("Q") for _ in ChunkPlace._fields]

    def append(self, index: _Index) -> None:
        """Add one chunk."""
        for column, name in zip(self._columns, ChunkPlace._fields, strict=True):
            column.append(getattr(index, name))

    def __len__(self) -> int:
        return len(self._columns[0])

    def __getitem__(self, row: int) -> ChunkPlace:
        return ChunkPlace(*(column[row] for column in self._columns))

    def __iter__(self) -> Iterator[ChunkPlace]:
        return map(ChunkPlace, *self._columns)

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
