"""Readers of two other storages: ``.db3`` files of rosbag2 (sqlite3), and ``.bag`` files of ROS 1, converted to CDR."""

from __future__ import annotations

import sqlite3
from bisect import bisect_right
from bz2 import BZ2Decompressor
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from lz4.frame import LZ4FrameDecompressor
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader, ReaderError
from rosbags.rosbag1.reader import decompressors
from rosbags.typesys import TypesysError, get_types_from_msg

from ..errors import BagError
from ..messages.type_store import jazzy, other_than_jazzy
from ..system.files import holds_file, open_received
from .session_file import CDR, MOST_HELD, PARSE_ERRORS, PIECE, LogClock, SessionFile, channel_of, schema_of

MAGIC = b"SQLite format 3\0"
BESIDE = ("-wal", "-journal")  # suffixes of the files in which sqlite3 keeps data that are not in the database yet
_MESSAGES = "SELECT topic_id, timestamp, data FROM messages ORDER BY "
_TIMES = "SELECT IFNULL(CAST(topic_id AS INTEGER), 0), MAX(IFNULL(CAST(timestamp AS INTEGER), 0), 0) FROM messages ORDER BY id"
_TOGETHER = 100_000  # messages whose times are read at once
_REMEDY = "The file is damaged or no rosbag2 storage: try `sqlite3 FILE .recover` on a copy, or another copy of the session."


@dataclass(frozen=True)
class SqliteFile(SessionFile):
    """Content of one .db3 file, which has no checksums."""

    @cached_property
    def log_clock(self) -> LogClock:
        """Clock as in `SessionFile`, by the order in which the messages were stored."""
        with _database(self.path) as database:
            rows = database.execute(_TIMES)
            pieces = (np.array(piece).T for piece in iter(lambda: rows.fetchmany(_TOGETHER), []))
            return LogClock.of(((channels, times.astype(np.uint64)) for channels, times in pieces), self.counts)

    def messages(self, clock: LogClock) -> Iterator[tuple[int, int, bytes]]:
        """Yield messages as in `SessionFile`, in the order of their log times; as they were stored, if the clock was set back.

        Raise BagError if the messages have more bytes than the file: columns with a default, or generated, can give any
        number of bytes.
        """
        left, newest = self.path.stat().st_size, 0
        with _database(self.path) as database:
            rows = database.execute(_MESSAGES + ("id" if clock.places else "timestamp, id"))
            for row, (channel, time, data) in enumerate(rows):
                if channel not in self.channels or not isinstance(data, bytes) or not isinstance(time, int) or time < 0:
                    raise BagError(f"{self.path}: the row of topic {channel!r} at {time!r} ns is not a message. {_REMEDY}")
                left -= len(data)
                if left < 0:
                    raise BagError(
                        f"{self.path}: its messages have more bytes than the file, so they are not data of the file. {_REMEDY}"
                    )
                place = PIECE * (row // _TOGETHER) + row % _TOGETHER
                newest = max(newest, time + clock.shifts[bisect_right(clock.places, place)])
                yield channel, newest, data


def summarise_sqlite(path: Path) -> SqliteFile:
    """Return the content of one file; see `boom_twin.bag.reader.summarise`."""
    with _database(path) as database:
        tables = {str(name) for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not {"messages", "topics"} <= tables:
            raise BagError(f"{path}: has no tables messages and topics, but {', '.join(sorted(tables)) or 'none'}. {_REMEDY}")
        definitions = dict[str, str]()
        if "message_definitions" in tables:
            wanted = "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg'"
            definitions = {str(kind): str(text) for kind, text in database.execute(wanted)}
        topics = [_topic(path, row) for row in database.execute("SELECT id, name, type, serialization_format FROM topics")]
        counts = dict(database.execute("SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id"))
        if unknown := sorted(map(str, counts.keys() - {number for number, *_ in topics})):
            raise BagError(f"{path}: messages of topics {', '.join(unknown)}, which are not in its table topics. {_REMEDY}")
        start, end = database.execute("SELECT MIN(timestamp), MAX(timestamp) FROM messages").fetchone()
        distro = database.execute("SELECT ros_distro FROM schema").fetchone() if "schema" in tables else None
    return SqliteFile(
        path=path,
        storage="sqlite3",
        library=f"rosbag2_storage_sqlite3 ({distro[0]})" if distro else "rosbag2_storage_sqlite3",
        compression="none",
        channels={number: channel_of(number, topic, encoding) for number, topic, _, encoding in topics},
        schemas={number: schema_of(number, kind, definitions.get(kind, "")) for number, _, kind, _ in topics},
        counts=counts,
        start=start or 0,
        end=end or 0,
    )


def _topic(path: Path, row: tuple[Any, ...]) -> tuple[int, str, str, str]:
    number, *texts = row
    if not isinstance(number, int) or not 0 <= number < 2**31 or not all(isinstance(text, str) for text in texts):
        raise BagError(f"{path}: row {row!r} of its table topics is not a topic. {_REMEDY}")
    return number, texts[0], texts[1], texts[2]


@contextmanager
def _database(path: Path) -> Iterator[sqlite3.Connection]:
    """Open the database in a file. Errors of the file become a BagError."""
    try:
        with open_received(path) as file:
            if (start := file.read(len(MAGIC))) != MAGIC:
                raise BagError(f"{path}: {'empty' if not start else 'not an sqlite3 file (it begins otherwise)'}. {_REMEDY}")
        for end in BESIDE:
            beside = path.with_name(path.name + end)
            if holds_file(beside) and beside.stat().st_size:
                raise BagError(
                    f"{path}: was not closed: {beside.name} holds messages that are not in it. "
                    f"Copy both, and close the copy by `sqlite3 {path.name} 'PRAGMA wal_checkpoint(TRUNCATE)'`."
                )
        address = f"file:{quote(str(path.absolute()))}?mode=ro&immutable=1"  # immutable: no lock, no file beside it
        with closing(sqlite3.connect(address, uri=True)) as database:
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(path.stat().st_size, MOST_HELD))
            database.execute("PRAGMA trusted_schema = OFF")
            yield database
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}). Check the path and its permissions.") from error
    except (sqlite3.Error, UnicodeError, OverflowError) as error:
        raise BagError(f"{path}: {error}. {_REMEDY}") from error


ENCODING = "ros1"  # encoding of a message that is not converted, because its type differs in Jazzy
_OWN = ("std_msgs/msg/Header", "builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
"""Types that differ in ROS 2, and that `Typestore.ros1_to_cdr` converts."""
_ERRORS = (ReaderError, AssertionError, EOFError, RecursionError, *PARSE_ERRORS)
_MEND = "The file is damaged or was cut off: `rosbag reindex` or `rosbag fix` of ROS 1 may mend a copy of it."


@dataclass(frozen=True, slots=True)
class Ros1File(SessionFile):
    """Content of one .bag file, which has no checksums."""

    def messages(self, clock: LogClock) -> Iterator[tuple[int, int, bytes]]:
        convert = jazzy().ros1_to_cdr
        with _reader(self.path) as reader:
            for connection, time, data in reader.messages():
                is_same = self.channels[connection.id].message_encoding == CDR
                yield connection.id, time, bytes(convert(data, connection.msgtype)) if is_same else data


def summarise_ros1(path: Path) -> Ros1File:
    """Return the content of one file, which must have an index; see `boom_twin.bag.reader.summarise`."""
    with _reader(path) as reader:
        connections, names = reader.connections, dict[Any, str]((unpack, name) for name, unpack in _BOUNDED.items())
        return Ros1File(
            path=path,
            storage="ros1",
            library="ROS 1",
            compression=next((names.get(chunk.decompressor, "none") for chunk in reader.chunks.values()), "none"),
            channels={each.id: channel_of(each.id, each.topic, _encoding(each)) for each in connections},
            schemas={each.id: schema_of(each.id, each.msgtype) for each in connections},
            counts={each.id: each.msgcount for each in connections},
            start=reader.start_time if any(each.msgcount for each in connections) else 0,
            end=max(0, reader.end_time - 1),
        )


def _encoding(connection: Connection) -> str:
    """Return `CDR` if the type is defined as in Jazzy, so that its messages can be converted; else `ENCODING`."""
    try:
        found = get_types_from_msg(str(connection.msgdef.data), connection.msgtype)
    except TypesysError:
        return ENCODING
    is_known = all(name in jazzy().fielddefs for name in found.keys() - set(_OWN))
    return CDR if is_known and not {*other_than_jazzy(found)} - set(_OWN) else ENCODING


def _unpack(decompressor: Callable[[], Any], data: bytes) -> bytes:
    content: bytes = decompressor().decompress(data, max_length=MOST_HELD + 1)
    if len(content) > MOST_HELD:
        raise ReaderError(f"a chunk unpacks to more than {MOST_HELD} bytes, the most that is read")
    return content


_BOUNDED = {"bz2": partial(_unpack, BZ2Decompressor), "lz4": partial(_unpack, LZ4FrameDecompressor)}


@contextmanager
def _reader(path: Path) -> Iterator[Reader]:
    """Open a file whose chunks unpack within limits. Errors of the file become a BagError."""
    bounded = {decompressors[name]: unpack for name, unpack in _BOUNDED.items()}
    try:
        open_received(path).close()
        with Reader(path) as reader:
            for place, chunk in reader.chunks.items():
                own = bounded.get(chunk.decompressor)
                reader.chunks[place] = chunk._replace(decompressor=own) if own else chunk
            yield reader
    except _ERRORS as error:
        raise BagError(f"{path}: {str(error) or type(error).__name__}. {_MEND}") from error
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror or error}). {_MEND}") from error
