"""Decode blocks of sensor messages into samples, all messages of one layout at once.

The samples, and what is counted as odd, are those of a `boom_twin.messages.sample_decoder.SampleDecoder` that is given one
message after the other; it is given those that are laid out in a way not known yet, or have a value that is to be left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import repeat
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import BagError
from ..twin.blocks import CODES, SampleBlock, block_of
from ..types import LIMIT, SENSORS, Array, Sample, Stream
from .cdr_decoder import Layout, layout_of
from .message_block import Integers, MessageBlock
from .sample_decoder import LATEST, NO_MEASUREMENT, SampleDecoder, stamp_of
from .topic_table import TYPES, Topics

FEW = 8
"""Messages of one topic in a block that are decoded one by one rather."""
MOST_LAYOUTS = 8
"""Layouts of one topic that are tried on each of its blocks."""
MOST_NEW = 4
"""Layouts of one topic that are learnt from one block: from messages that all differ there is nothing to learn."""


class DecodedBlock(NamedTuple):
    """The samples of a block of messages.

    Attributes
    ----------
    samples : SampleBlock
    rows : ndarray of int64, shape (k,)
        The message that each sample is from.
    stamps : ndarray of int64, shape (messages,)
        Of every message, nanoseconds.
    """

    samples: SampleBlock
    rows: Integers
    stamps: Integers

    def part(self, first: int, end: int) -> DecodedBlock:
        """That of the messages from `first` up to `end`."""
        rows = slice(*np.searchsorted(self.rows, (first, end)))
        return DecodedBlock(chosen(self.samples, rows), self.rows[rows] - first, self.stamps[first:end])

    @property
    def without(self) -> int:
        """How many of the messages have no sample."""
        return len(self.stamps) - int(np.count_nonzero(np.bincount(self.rows)))


class _Columns(NamedTuple):
    """Which numbers of a layout are which values of one stream, and their scales, shape (2, columns)."""

    stream: Stream
    columns: list[int]
    places: list[int]
    scales: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Known:
    """A layout, what is read of it, and what is odd about each of its messages; nothing is read of what has no sample."""

    layout: Layout
    streams: list[_Columns]
    oddities: list[str]


_Turn = tuple[int, _Known | None, int]
"""A message, and what to do when it is its turn: count oddities for so many as it, or if that is 0, decode it by itself."""


class BlockDecoder:
    """Maps blocks of messages to samples and counts what is odd about them.

    Parameters
    ----------
    joints : int
        Number of joints of the scene.
    topics : Topics
        How the rig's sensors read.
    streams : sequence of list of Stream
        What is heard from every source of the blocks; messages of one source have one type.
    decoded : callable
        Decodes one message of a block; raises BagError if that cannot be.
    """

    def __init__(
        self, joints: int, topics: Topics, streams: Sequence[list[Stream]], decoded: Callable[[MessageBlock, int], Any]
    ) -> None:
        self._decoder, self._joints = SampleDecoder(joints, topics), joints
        self._streams, self._decoded = streams, decoded
        self._known: list[list[_Known]] = [[] for _ in streams]
        self._width = block_of([], joints).values.shape[1]

    @property
    def oddities(self) -> Counter[str]:
        """How often each was met, see `SampleDecoder`."""
        return self._decoder.oddities

    def decode(self, block: MessageBlock) -> DecodedBlock:
        """The samples of a block, in its order.

        Raises
        ------
        BagError
            A message cannot be decoded: that of the first one.
        """
        stamps = np.zeros(len(block), np.int64)
        found: list[tuple[Integers, SampleBlock]] = []
        turns: list[_Turn] = []
        for source in np.flatnonzero(np.bincount(block.sources)).tolist():
            for known, rows in self._grouped(block, source):
                usual = np.zeros(len(rows), np.bool_)
                if known is not None:
                    stamps[rows] = known.layout.stamps_in(block, rows)
                    usual, values = self._read(known, block, rows, stamps[rows])
                    taken, delays = stamps[rows[usual]], self._decoder.delays
                    found += [(rows[usual], _of_stream(stream, taken - delays[stream], each[usual])) for stream, each in values]
                    if known.oddities and usual.any():
                        turns.append((int(rows[usual][0]), known, int(usual.sum())))
                turns += zip(rows[~usual].tolist(), repeat(known), repeat(0))
        found.append(self._one_by_one(block, sorted(turns, key=itemgetter(0)), stamps))
        rows, samples = np.concatenate([rows for rows, _ in found]), together([samples for _, samples in found])
        order = np.lexsort((samples.streams, rows))
        return DecodedBlock(chosen(samples, order), rows[order], stamps)

    def _grouped(self, block: MessageBlock, source: int) -> Iterator[tuple[_Known | None, Integers]]:
        """The messages of one source by their layouts; None is that of the rest."""
        left, met, new = np.flatnonzero(block.sources == source), list[_Known](), 0
        before = self._known[source]
        candidates = iter(before)
        while len(left) >= FEW:
            known = next(candidates, None)
            if known is None:
                known = self._learnt(block, int(left[0])) if new < MOST_NEW else None
                new += 1
            if known is None:
                break
            alike = known.layout.are_of(block, left)
            if np.count_nonzero(alike) >= FEW:
                met.append(known)
                yield known, left[alike]
                left = left[~alike]
            elif new:  # hardly another message is like the one that was learnt from
                break
        self._known[source] = [*met, *(known for known in before if known not in met)][:MOST_LAYOUTS]
        if len(left):
            yield None, left

    def _learnt(self, block: MessageBlock, row: int) -> _Known | None:
        """How a message is laid out; None if that cannot be told of it."""
        try:
            self._decoded(block, row)
        except BagError:
            return None  # raised when it is its turn
        data, streams = block.data(row), self._streams[block.sources[row]]
        layout = layout_of(data, TYPES[streams[0]], SENSORS[streams[0]].field)
        if layout is None:
            return None
        columns, oddities = [], []
        for stream in streams:
            places, odd = self._decoder.places(stream, layout.read(data))
            oddities += odd
            there = [column for column, place in enumerate(places or []) if place >= 0]
            if there and places:
                scales = self._decoder.scales(stream)[:, there]
                columns.append(_Columns(stream, there, [places[column] for column in there], scales))
            elif odd:
                return _Known(layout, [], [])
        return _Known(layout, columns, oddities)

    def _read(
        self, known: _Known, block: MessageBlock, rows: Integers, stamps: Integers
    ) -> tuple[NDArray[np.bool_], list[tuple[Stream, Array]]]:
        """Which of some messages have nothing but values, and the values of every stream of all of them."""
        usual = np.full(len(rows), bool(known.streams)) & (stamps != 0)
        if not usual.any():
            return usual, []
        numbers, found = known.layout.numbers_in(block, rows), []
        for stream, columns, places, (zeros, factors) in known.streams:
            taken = stamps - self._decoder.delays[stream]
            usual &= (taken > 0) & (taken < LATEST)
            if SENSORS[stream].is_imu:
                usual &= numbers[:, -1] != NO_MEASUREMENT
            values = np.full((len(rows), self._width), np.nan)
            with np.errstate(all="ignore"):
                values[:, columns] = quantities = (numbers[:, places] - zeros) * factors
                usual &= ((quantities >= -LIMIT) & (quantities <= LIMIT)).all(axis=1)
            found.append((stream, values))
        return usual, found

    def _one_by_one(self, block: MessageBlock, turns: list[_Turn], stamps: Integers) -> tuple[Integers, SampleBlock]:
        """The samples of single messages, each with its message, whose stamps are filled in."""
        rows, samples, sources = list[int](), list[Sample](), block.sources.tolist() if turns else []
        for row, known, covers in turns:
            if known is None:
                message = self._decoded(block, row)
                stamps[row] = stamp = stamp_of(message)
            elif covers:
                for name in known.oddities:
                    self.oddities[name] += covers
                continue
            else:
                message, stamp = known.layout.read(block.data(row)), int(stamps[row])
            for sample in self._decoder.samples(self._streams[sources[row]], stamp, message):
                rows.append(row)
                samples.append(sample)
        return np.array(rows, np.int64), block_of(samples, self._joints)


def _of_stream(stream: Stream, stamps: Integers, values: Array) -> SampleBlock:
    return SampleBlock(np.full(len(stamps), CODES[stream]), stamps, values)


def chosen(samples: SampleBlock, rows: slice | Integers) -> SampleBlock:
    """Some samples of a block, in the order of `rows`."""
    return SampleBlock(samples.streams[rows], samples.stamps[rows], samples.values[rows])


def together(blocks: Sequence[SampleBlock]) -> SampleBlock:
    """The samples of one block after those of the other."""
    return SampleBlock(*map(np.concatenate, zip(*blocks, strict=True)))
