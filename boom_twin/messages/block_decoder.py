"""Decode blocks of sensor messages into samples, as the live node decodes one message after the other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..twin.blocks import SampleBlock, block_of
from ..types import SENSORS, Sample, Stream
from .cdr_decoder import CdrDecoder
from .message_block import Integers, MessageBlock
from .sample_decoder import SampleDecoder
from .topic_table import TYPES, Topics


class DecodedBlock(NamedTuple):
    """The samples of a block of messages.

    Attributes
    ----------
    samples : SampleBlock
    rows : ndarray of int64, shape (k,)
        The message that each sample is complete with.
    stamps : ndarray of int64, shape (messages,)
        Of every message, nanoseconds.
    refused : ndarray of int64, shape (r,)
        The messages of which nothing could be used.
    """

    samples: SampleBlock
    rows: Integers
    stamps: Integers
    refused: Integers

    def part(self, first: int, end: int) -> DecodedBlock:
        """That of the messages from `first` up to `end`."""
        rows = slice(*np.searchsorted(self.rows, (first, end)))
        refused = self.refused[(self.refused >= first) & (self.refused < end)] - first
        samples = SampleBlock(self.samples.streams[rows], self.samples.stamps[rows], self.samples.values[rows])
        return DecodedBlock(samples, self.rows[rows] - first, self.stamps[first:end], refused)


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
        self._decoder, self._joints, self._streams = SampleDecoder(joints, topics), joints, streams
        self._newest: tuple[MessageBlock, int] | None = None  # message that is being decoded

        def decode(data: bytes, type_name: str) -> Any:
            assert self._newest is not None
            return decoded(*self._newest)

        self._wires = [CdrDecoder(TYPES[group[0]], decode, SENSORS[group[0]].field) for group in streams]

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
        stamps, samples, rows, refused = np.zeros(len(block), np.int64), list[Sample](), list[int](), list[int]()
        for row, source in enumerate(block.sources.tolist()):
            self._newest, before = (block, row), self._decoder.refused
            stamps[row], message = self._wires[source].read(block.data(row))
            samples += self._decoder.samples(self._streams[source], int(stamps[row]), message)
            rows += [row] * (len(samples) - len(rows))
            refused += [row] * (self._decoder.refused - before)
        at, left_out = np.array(rows, np.int64), np.unique(np.array(refused, np.int64))
        return DecodedBlock(block_of(samples, self._joints), at, stamps, left_out)

    def rest(self) -> SampleBlock:
        """Return what is left where no more messages come, see `SampleAssembler.rest`."""
        return block_of(list(self._decoder.assembler.rest()), self._joints)


def together(blocks: Sequence[SampleBlock]) -> SampleBlock:
    """The samples of one block after those of the other."""
    return SampleBlock(*map(np.concatenate, zip(*blocks, strict=True)))
