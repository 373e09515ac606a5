"""One file of a session in any storage: its content, its messages as CDR, and one kind of error for any damage."""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator, Mapping, Set
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import numpy as np
from mcap.exceptions import McapError
from mcap.records import Channel, Schema
from rosbags.serde import SerdeError
from zstandard import ZstdError

from ..errors import BagError
from ..messages.message_block import MessageBlock
from ..messages.type_store import jazzy
from .log_clock import NEVER_SET_BACK, LogClock

TOGETHER = 2000  # messages in one block of a file that is read message by message
CDR = "cdr"
REMEDY = "The file is damaged or was cut off: `boom_twin recover BAG --out DIR` saves what is whole."

_LZ4 = (RuntimeError,)
_PARSING = (struct.error, ValueError, KeyError, IndexError, OverflowError, MemoryError)
PARSE_ERRORS = (McapError, SerdeError, ZstdError, *_LZ4, *_PARSING)  # errors that the parsers raise on invalid bytes


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


@dataclass(frozen=True, slots=True)
class SessionFile(ABC):
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

    def check_counts(self, source: str, counts: Mapping[int, int], other: str, others: Mapping[int, int]) -> None:
        """Raise BagError, as `compare_counts`, if two counts by channel are not the same for every topic."""
        one, two = by_topic(counts, self.channels), by_topic(others, self.channels)
        compare_counts(self.path, source, one, other, two)

    def type_of(self, channel: Channel) -> str:
        """Return the type of a channel as ``package/msg/Name``, whose name may be in two parts or of DDS; "" without one."""
        schema = self.schemas.get(channel.schema_id)
        parts = schema.name.replace("::", "/").split("/") if schema else [""]
        if parts[-2:-1] == ["dds_"]:
            parts = [*parts[:-2], parts[-1].removesuffix("_")]
        return "/".join([parts[0], "msg", parts[1]] if len(parts) == 2 else parts)

    @abstractmethod
    def heads(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield channel, log time (ns) and encoded data of all messages."""

    def log_clock(self) -> LogClock:
        """Return the clock of the recorder. The default is for a storage whose only order is that of log times."""
        return NEVER_SET_BACK

    def blocks(self, passed: Set[int], clock: LogClock) -> Iterator[MessageBlock]:
        """Yield blocks of all messages, except of the `passed` channels, in the order in which the node took them.

        The sources of a block are channels. The order is that of log times, or that of the file if its `clock` was set
        back; log times are then corrected. This default requires `heads` in that order.
        """
        found = (each for each in self.heads() if each[0] not in passed)
        while group := list(islice(found, TOGETHER)):
            sources, times, data = zip(*group, strict=True)
            ends = np.cumsum([len(each) for each in data])
            starts = np.concatenate([[0], ends[:-1]])
            yield MessageBlock(b"".join(data), np.array(sources), np.array(times, np.uint64), starts, ends)


def schema_of(number: int, type_name: str, definition: str = "") -> Schema:
    """Return the schema of a message type. Without a definition it is that of Jazzy, empty for a type unknown to Jazzy."""
    if not definition and type_name in jazzy().types:
        definition, _ = jazzy().generate_msgdef(type_name, ros_version=2)
    return Schema(id=number, name=type_name, encoding="ros2msg", data=definition.encode())


def channel_of(number: int, topic: str, encoding: str = CDR) -> Channel:
    """Return a channel whose schema has the number of the channel."""
    return Channel(id=number, topic=topic, message_encoding=encoding, schema_id=number, metadata={})
