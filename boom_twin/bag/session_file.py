"""Files of a session in any storage, their messages as CDR in the order of log times, and one error for any damage."""

from __future__ import annotations

import math
import struct
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from heapq import merge
from itertools import accumulate, islice, repeat
from numbers import Real
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mcap.exceptions import McapError
from mcap.records import Channel, Schema
from numpy.typing import NDArray
from rosbags.serde import SerdeError
from zstandard import ZstdError

from ..errors import BagError, UsageError
from ..messages.cdr_decoder import CdrDecoder, MessageBlock, by_log_time, joined
from ..messages.type_store import decode, jazzy
from ..types import NANO, Integers


@dataclass(frozen=True, slots=True)
class TimeWindow:
    """A part of a session, by the log times of its messages.

    Attributes
    ----------
    start : float
        Time after the first message of the topics that are read, s.
    duration : float or None
        Length, s; None is to the end of the session.
    """

    start: float = 0.0
    duration: float | None = None

    def __post_init__(self) -> None:
        for name, value in (("start", self.start), ("duration", 0.0 if self.duration is None else self.duration)):
            if not isinstance(value, Real) or not 0.0 <= value < math.inf:
                raise UsageError(f"{name} = {value!r}: must be a number of seconds, at least 0.")

    def share(self, length: float) -> float:
        """Return the share of a session of `length` (s) that lies in the window, 0 to 1."""
        left = max(0.0, length - self.start)
        return min(left, left if self.duration is None else self.duration) / length if length > 0.0 else 1.0

    def cut(self, blocks: Iterable[MessageBlock], path: Path) -> Iterator[MessageBlock]:
        """Yield the messages inside the window. Blocks after its end are not read.

        Raise BagError if no message is in the window.
        """
        first: int | None = None
        is_empty, newest = True, 0.0
        for block in blocks:
            first = int(block.log_times[0]) if first is None else first
            newest = (int(block.log_times[-1]) - first) * NANO
            begin, end = np.searchsorted(block.log_times, np.array(self.bounds(first), np.uint64))
            if begin < end:
                is_empty = False
                yield block.chosen(slice(int(begin), int(end)))
            if end < len(block):
                break
        if first is None:
            raise BagError(f"{path}: no message of the topics that a replay reads. Give their names in a mapping.")
        if is_empty:
            told = "" if self.duration is None else f" to {self.start + self.duration:g} s"
            raise BagError(
                f"{path}: no message from {self.start:g} s{told} on; the session lasts {newest:.1f} s. Begin earlier."
            )

    def bounds(self, first: int) -> tuple[int, int]:
        """Return the first log time (ns) in the window and the first one after it, for a session that begins at `first`."""
        never = 2**64 - 1  # log time after all others, ns
        begin = min(never, first + round(self.start / NANO))
        return begin, never if self.duration is None else min(never, begin + round(self.duration / NANO))


WHOLE = TimeWindow()  # window of the whole session


CDR = "cdr"
MOST_HELD = 2**30  # size limit of one message or one unpacked chunk in memory, bytes
MOST_TOGETHER = 2**22
"""Limit of messages in memory. An empty message takes ten times its bytes there."""
PIECE = 2**32  # offset between the places of messages of two pieces of a file, more than the messages of a piece
REMEDY = "The file is damaged or was cut off: `boom_twin recover BAG --out DIR` saves what is whole."

_PARSING = (struct.error, ValueError, KeyError, IndexError, OverflowError, MemoryError, RuntimeError)  # the last by lz4
PARSE_ERRORS = (McapError, SerdeError, ZstdError, *_PARSING)  # errors that the parsers raise on invalid bytes


@contextmanager
def as_bag_error(path: Path) -> Iterator[None]:
    """Turn an error on reading `path` into a BagError that names it."""
    try:
        yield
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}). Check the path and its permissions.") from error
    except PARSE_ERRORS as error:
        raise BagError(f"{path}: {str(error) or type(error).__name__}. {REMEDY}") from error


def compare_counts(place: Path, source: str, counts: Mapping[str, int], other: str, others: Mapping[str, int]) -> None:
    """Raise BagError that names each topic whose counts from two sources differ; a count of 0 is the same as none."""
    pairs = [(topic, counts.get(topic, 0), others.get(topic, 0)) for topic in sorted({*counts, *others})]
    if faults := "; ".join(f"{topic}: {source} {one}, {other} {two}" for topic, one, two in pairs if one != two):
        raise BagError(f"{place}: message counts differ ({faults}). {REMEDY}")


def by_topic(counts: Mapping[int, int], channels: Mapping[int, Channel]) -> Counter[str]:
    """Return counts by topic name from counts by channel."""
    topics: Counter[str] = Counter()
    for channel, count in counts.items():
        topics[channels[channel].topic] += count
    return topics


class LogClock(NamedTuple):
    """Shift of the recorder's clock within a file, which grows where the clock was set back."""

    places: list[int]  # place of the first message of each shift but the first: its row in its piece, plus `PIECE` a piece
    shifts: list[int]  # shifts by which the log times of every topic rise in the order of the file, ns

    @classmethod
    def of(cls, pieces: Iterable[tuple[Integers, NDArray[np.uint64]]], counts: Mapping[int, int]) -> LogClock:
        """Return the clock from channels and log times of the messages, by pieces in the order of the file, and their counts.

        A recorder writes the messages of a topic as they come. If of log times p, q, r of a topic q < p, the clock was set
        back and went on if q < r < p. That holds for a third of the steps back in a random order, and for no late message:
        it must hold for most, in topics of most messages, as all share the clock. Else the file is not in order.
        """
        votes, last, clock = Counter[int](), dict[int, tuple[NDArray[np.uint64], int]](), cls([], [0])
        for number, (channels, times) in enumerate(pieces):
            older, before = np.zeros(len(times), np.uint64), np.zeros(len(times), np.int64)
            for channel in sorted(set(channels.tolist())):
                rows, (held, place) = np.flatnonzero(channels == channel), last.get(channel, (np.zeros(2, np.uint64), 0))
                own, at = np.concatenate([held, times[rows]]), np.concatenate([[place], PIECE * number + rows])
                p, q, r = own[:-2], own[1:-1], own[2:]
                votes[channel] += 2 * int(((q < r) & (r < p)).sum()) - int((q < p).sum())
                older[rows], before[rows], last[channel] = q, at[:-1], (own[-2:], at[-1])
            for row in np.flatnonzero(times < older).tolist():
                shift = clock.shifts[bisect_right(clock.places, before[row])] + int(older[row] - times[row])
                if shift > clock.shifts[-1]:
                    clock.places.append(PIECE * number + row)
                    clock.shifts.append(shift)
        agreed = sum(counts.get(channel, 0) for channel, vote in votes.items() if vote > 0)
        return clock if 2 * agreed > sum(counts.values()) else IN_ORDER


IN_ORDER = LogClock([], [0])  # clock that was not set back


class Part(NamedTuple):
    """Messages of a file that are read at once, sorted by log time."""

    bound: int  # no message of this part or of a later one is older, ns
    number: int  # place of the part in the file
    block: MessageBlock


@dataclass(frozen=True)
class SessionFile:
    """Content of one file of a session."""

    path: Path
    storage: str  # storage of the file: ``mcap``, ``sqlite3``, ``ros1`` or ``csv``
    # library, compression: program that wrote the file, by its own name; compression of its first chunk, or a note that it has
    # no chunks
    library: str
    compression: str
    channels: dict[int, Channel]
    schemas: dict[int, Schema]
    counts: dict[int, int]  # number of messages by channel
    start: int  # start, end: first and last log time in nanoseconds; 0 without messages
    end: int
    checked: bool = False  # True if its messages are under a checksum and counted. If not, a flipped bit can pass undetected
    notes: dict[str, str] = field(default_factory=dict)

    def type_of(self, channel: Channel) -> str:
        """Return the type of a channel as ``package/msg/Name``; "" without a schema.

        Names such as ``package/Name`` or ``package::msg::dds_::Name_`` are accepted.
        """
        schema = self.schemas.get(channel.schema_id)
        parts = schema.name.replace("::", "/").split("/") if schema else [""]
        if parts[-2:-1] == ["dds_"]:
            parts = [*parts[:-2], parts[-1].removesuffix("_")]
        return "/".join([parts[0], "msg", parts[1]] if len(parts) == 2 else parts)

    def messages(self, clock: LogClock) -> Iterator[tuple[int, int, bytes]]:
        """Yield channel, log time (ns) and encoded data of all messages, in the order of log times by the `clock`.

        A storage that has `parts` of its own needs none.
        """
        raise NotImplementedError

    @cached_property
    def log_clock(self) -> LogClock:
        """Clock of log times. The default is for a storage whose order is that of log times."""
        return IN_ORDER

    def parts(self, passed: Set[int], clock: LogClock) -> Iterator[Part]:
        """Yield all messages, except of the `passed` channels, by ascending bounds, with log times by the `clock`.

        `sources` of a block holds channel numbers.
        """
        together = 2000  # messages in one block of a file that is read message by message
        found = (each for each in self.messages(clock) if each[0] not in passed)
        for number, group in enumerate(iter(lambda: list(islice(found, together)), [])):
            sources, times, data = zip(*group, strict=True)
            ends = np.cumsum([len(each) for each in data])
            starts = np.concatenate([[0], ends[:-1]])
            block = MessageBlock(b"".join(data), np.array(sources), np.array(times, np.uint64), starts, ends)
            yield Part(times[0], number, block)


def schema_of(number: int, type_name: str, definition: str = "") -> Schema:
    """Return the schema of a message type. Without a definition it is that of Jazzy, empty for a type unknown to Jazzy."""
    if not definition and type_name in jazzy().types:
        definition, _ = jazzy().generate_msgdef(type_name, ros_version=2)
    return Schema(id=number, name=type_name, encoding="ros2msg", data=definition.encode())


def channel_of(number: int, topic: str, encoding: str = CDR) -> Channel:
    """Return a channel whose schema has the number of the channel."""
    return Channel(id=number, topic=topic, message_encoding=encoding, schema_id=number, metadata={})


class Source(NamedTuple):
    """Source of messages: a file, a topic in it, the `name` by which the topic was requested, its type and definition."""

    file: Path
    topic: str
    name: str
    type: str
    schema: Schema | None


class SessionBlocks:
    """Iterable over blocks of the messages of some topics, sorted by log time, then by file.

    `files` come with the channels to read. `asked` has the name by which each topic is requested, by its name in the files.
    Messages outside the `window` are left out.

    Raise BagError while iterating if a checksum does not fit, or no message is in the window; at the end if the files did not
    hold what their statistics say.
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
                kind, schema = file.type_of(channel), file.schemas.get(channel.schema_id)
                self.sources.append(Source(file.path, channel.topic, asked[channel.topic], kind, schema))
        return numbers

    def __iter__(self) -> Iterator[MessageBlock]:
        clocks = [file.log_clock for file, _ in self._files]
        ahead = accumulate((clock.shifts[-1] for clock in clocks), initial=0)  # a clock set back stays so in later files
        parts = [_wanted(*file, clock, late) for file, clock, late in zip(self._files, clocks, ahead, strict=False)]
        blocks = _in_order([file.path for file, _ in self._files], parts)
        return blocks if self._window == WHOLE else self._window.cut(blocks, self._files[0][0].path)

    def decoded(self, block: MessageBlock, row: int) -> Any:
        """Return one decoded message; None for a type unknown to Jazzy. Raise BagError if it cannot be decoded."""
        source = self.sources[block.sources[row]]
        try:
            return decode(block.data(row), source.type) if source.type in jazzy().types else None
        except PARSE_ERRORS as error:
            place = f"{source.file}: topic {source.topic} at log time {block.log_times[row]} ns"
            raise BagError(f"{place}: {error} {REMEDY}") from error

    def read(self, decoder: CdrDecoder, block: MessageBlock, row: int) -> tuple[int, Any]:
        """Return stamp and fields of one message, see `CdrDecoder.read`. Raise BagError if it cannot be decoded."""
        try:
            return decoder.read(block.data(row))
        except PARSE_ERRORS:
            self.decoded(block, row)  # raises it with its place
            raise

    def read_together(self, decoders: Sequence[CdrDecoder], block: MessageBlock) -> Iterator[tuple[int, Integers, Any]]:
        """Yield source, stamps (k,) and message, by `decoders` of the sources, for all messages of a block.

        Messages of a source with one layout come as one message, whose numbers are arrays (k,).
        """
        for source in sorted(set(block.sources.tolist())):
            part, decoder = block.chosen(np.flatnonzero(block.sources == source)), decoders[source]
            stamp, message = self.read(decoder, part, 0)  # a layout is known with its first message
            if (many := decoder.read_many(part)) is not None:
                yield source, *many
                continue
            yield source, np.array([stamp]), message
            for row in range(1, len(part)):
                stamp, message = self.read(decoder, part, row)
                yield source, np.array([stamp]), message


def _wanted(file: SessionFile, numbers: Mapping[int, int], clock: LogClock, ahead: int) -> Iterator[Part]:
    """Yield the parts of one file with the requested channels (number 0 or more), `ahead` ns later."""
    seen: Counter[int] = Counter()
    passed = {channel for channel, number in numbers.items() if number < 0}
    with as_bag_error(file.path):
        for bound, number, block in file.parts(passed, clock):
            seen.update(channels := block.sources.tolist())
            sources = np.array([numbers[channel] for channel in channels], np.int64)
            times = block.log_times + np.uint64(ahead)
            yield Part(bound + ahead, number, replace(block, sources=sources, log_times=times))
        told = {channel: count for channel, count in file.counts.items() if channel not in passed}
        compare_counts(file.path, "statistics", by_topic(told, file.channels), "read", by_topic(seen, file.channels))


def _in_order(paths: Sequence[Path], files: Sequence[Iterator[Part]]) -> Iterator[MessageBlock]:
    """Yield blocks of the messages of all files, sorted by log time, then by file, then by their order in it."""
    held: dict[tuple[int, int], MessageBlock] = {}  # blocks by file and part
    for part, file in merge(*(zip(parts, repeat(file)) for file, parts in enumerate(files)), key=lambda each: each[0].bound):
        ends = {at: int(np.searchsorted(block.log_times, np.uint64(part.bound))) for at, block in sorted(held.items())}
        if due := [held[at].chosen(slice(0, end)) for at, end in ends.items() if end]:
            yield by_log_time(joined(due))
        held = {at: held[at].chosen(slice(end, None)) for at, end in ends.items() if end < len(held[at])}
        held[file, part.number] = part.block
        if sum(len(each.content) for each in held.values()) > MOST_HELD or sum(map(len, held.values())) > MOST_TOGETHER:
            what = f"more than {MOST_HELD} bytes or {MOST_TOGETHER} messages are out of order"
            raise BagError(f"{paths[file]}: {what}. Sort them by log time: `mcap sort IN.mcap -o OUT.mcap`.")
    if held:
        yield by_log_time(joined([block for _, block in sorted(held.items())]))
