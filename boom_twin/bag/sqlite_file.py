"""Read a ``.db3`` file of rosbag2, the storage sqlite3. It is only read: neither locked nor written to."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from ..errors import BagError
from ..system.received_files import holds_file, open_received
from .log_clock import LogClock, Piece
from .mcap_records import MOST_HELD
from .session_file import SessionFile, channel_of, schema_of

MAGIC = b"SQLite format 3\0"
BESIDE = ("-wal", "-journal")  # suffixes of the files in which sqlite3 keeps data that are not in the database yet
_MESSAGES = "SELECT topic_id, timestamp, data, id FROM messages ORDER BY"
_ARE_NUMBERS = "typeof(topic_id) = 'integer' AND typeof(timestamp) = 'integer'"
_LOG_TIMES = f"SELECT id, topic_id, timestamp FROM messages WHERE {_ARE_NUMBERS} ORDER BY id"
_AT_ONCE = 100_000  # log times
_REMEDY = "The file is damaged or no rosbag2 storage: try `sqlite3 FILE .recover` on a copy, or another copy of the session."


@dataclass(frozen=True, slots=True)
class SqliteFile(SessionFile):
    """Content of one .db3 file, which has no checksums."""

    def heads(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield messages as in `SessionFile`, in the order of `blocks`.

        Raise BagError if the messages have more bytes than the file: columns with a default, or generated, can give any
        number of bytes.
        """
        left, clock, newest = self.path.stat().st_size, self.log_clock(), 0
        with _database(self.path) as database:
            for channel, time, data, place in database.execute(f"{_MESSAGES} {'id' if clock.is_set_back else 'timestamp, id'}"):
                if channel not in self.channels or not isinstance(data, bytes) or not isinstance(time, int) or time < 0:
                    raise BagError(f"{self.path}: a message of topic {channel!r} at {time!r} ns is none. {_REMEDY}")
                left -= len(data)
                if left < 0:
                    raise BagError(
                        f"{self.path}: its messages have more bytes than the file, so are not stored in it. {_REMEDY}"
                    )
                newest = max(newest, int(clock.times(np.array([time], np.uint64), np.array([place]))[0]))
                yield channel, newest, data

    def log_clock(self) -> LogClock:
        """See `SessionFile`."""
        return LogClock.of(self._log_times)

    def _log_times(self) -> Iterator[Piece]:
        with _database(self.path) as database:
            found = database.execute(_LOG_TIMES)
            while rows := found.fetchmany(_AT_ONCE):
                places, channels, times = np.array(rows, np.int64).T
                yield places, channels, times.astype(np.uint64)


def summarise(path: Path) -> SqliteFile:
    """Return the content of one file; see `storages.summarise`."""
    with _database(path) as database:
        tables = {str(name) for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not {"messages", "topics"} <= tables:
            raise BagError(f"{path}: has no tables messages and topics, but {', '.join(sorted(tables)) or 'none'}. {_REMEDY}")
        definitions = _definitions(database) if "message_definitions" in tables else {}
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
        raise BagError(f"{path}: {row!r} in its table topics is no topic. {_REMEDY}")
    return number, texts[0], texts[1], texts[2]


def _definitions(database: sqlite3.Connection) -> dict[str, str]:
    """Return the definitions of messages by type, for those in the language ``ros2msg``."""
    rows = database.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
    return {str(kind): str(text) for kind, encoding, text in rows if encoding == "ros2msg"}


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
