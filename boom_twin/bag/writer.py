"""Write a rosbag2 directory of .mcap files from encoded messages; the same bytes for the same input."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BufferedWriter
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from ..errors import BagError
from ..messages.cdr_encoder import EncodedBlock
from ..messages.topic_table import Topic
from ..messages.type_store import jazzy
from ..system.result_folder import UNFINISHED
from ..types import Integers
from . import metadata as bagmeta
from .mcap_records import NOTES, PROFILE
from .mcap_writer import McapWriter
from .metadata import Recorded, metadata_of
from .session_file import MOST_HELD


def claim_directory(directory: Path) -> None:
    """Make the directory. Refuse one that holds anything except the mark of a result that is being built.

    Raise BagError if the directory is not empty, or cannot be made.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        taken = sorted(entry.name for entry in directory.iterdir() if entry.name != UNFINISHED)
    except OSError as error:
        raise BagError(f"{directory}: cannot be made ({error.strerror}). Choose another place.") from error
    if taken:
        raise BagError(f"{directory}: holds {taken[0]} already, and nothing is overwritten. Choose a new directory.")


CHUNK_SIZE = 64 * 1024  # bytes of messages that wait in memory: about one second of a 200 Hz session
RESULT_CHUNK_SIZE = 512 * 1024
"""Bytes of messages in a chunk of a result bag: about a second of all outputs at 200 Hz. Fewer chunks need less index."""
LIBRARY = "boom_twin"
LARGEST_MESSAGE = MOST_HELD - 2**20
"""Size limit of a message, bytes. Its chunk holds topic and type, too, and must be readable."""


FILE_NAME = "session_0.mcap"  # the one file of a bag that this package writes, named as rosbag2 names the first


class BagWriter:
    """Writer of a bag of one file; `close` completes it, `abandon` leaves it as it is.

    Every method raises BagError if the disk is full or fails. After that, call only `abandon`. `notes` are kept in the file and
    in ``custom_data``. A chunk has `chunk_size` bytes before it is compressed. Raise BagError if `directory` holds
    anything, or cannot be made.
    """

    def __init__(
        self, directory: Path, notes: Mapping[str, str] | None = None, distro: str = "jazzy", chunk_size: int | None = None
    ) -> None:
        self.directory, self.file, self._distro = directory, directory / FILE_NAME, distro
        self._notes = dict(notes or {})
        self.topics: list[Recorded] = []
        self._channels: list[int] = []
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self.counts: Counter[int] = Counter()
        self.sync: Callable[[int], None] = os.fsync  # puts a file that is complete on the disk, by its descriptor
        self._span: tuple[int, int] | None = None  # first and last log time, ns
        claim_directory(directory)
        with self._as_bag_error():
            self._raw = self.file.open("xb", buffering=0)
            self._writer = McapWriter(BufferedWriter(self._raw), PROFILE, LIBRARY, chunk_size or CHUNK_SIZE)
            if self._notes:
                self._writer.add_metadata(NOTES, self._notes)

    def add(self, *topics: Recorded) -> list[int]:
        """Write the definitions of topics, types first, and return the topics' keys for `write`."""
        first = len(self.topics)
        self.topics += topics
        schemas = [(each.type, each.definition_encoding, each.definition) for each in topics]
        for schema in schemas:
            if schema not in self._schemas:
                self._schemas[schema] = self._writer.register_schema(*schema)
        for each, schema in zip(topics, schemas, strict=True):
            number = self._schemas[schema]
            self._channels.append(self._writer.register_channel(each.topic, each.encoding, number, each.details))
        return list(range(first, len(self.topics)))

    def write(self, key: int, log_time: int, data: bytes, publish_time: int | None = None, sequence: int = 0) -> None:
        """Append one encoded message of at most `LARGEST_MESSAGE` bytes. Times are in ns; publish time defaults to log time."""
        self.counts[key] += 1
        self._extend_span(log_time, log_time)
        published = log_time if publish_time is None else publish_time
        with self._as_bag_error():
            self._writer.add_message(self._channels[key], log_time, data, published, sequence)

    def write_block(self, keys: Integers, block: EncodedBlock) -> None:
        """Append many messages, numbered, to the topics with these keys. The bytes are those of `write` for each message."""
        if not len(keys):
            return
        sequences = np.empty_like(keys)
        for key in set(keys.tolist()):
            own = np.flatnonzero(keys == key)
            sequences[own] = self.counts[key] + np.arange(1, len(own) + 1)
            self.counts[key] += len(own)
        self._extend_span(int(block.log_times.min()), int(block.log_times.max()))
        with self._as_bag_error():
            self._writer.add_block(np.array(self._channels)[keys], sequences, block)

    def _extend_span(self, start: int, end: int) -> None:
        first, last = self._span or (start, end)
        self._span = min(first, start), max(last, end)

    def flush(self) -> int:
        """Give all messages so far to the operating system and return the descriptor of the open file.

        The messages then survive this process. They survive a loss of power after ``os.fsync`` of that descriptor.
        """
        with self._as_bag_error():
            self._writer.flush()
        return self._raw.fileno()

    @property
    def written(self) -> int:
        """Size of the file on the disk, bytes, without data in memory."""
        return 0 if self._raw.closed else self._raw.tell()

    def close(self) -> None:
        """Complete the file, then write ``metadata.yaml``."""
        with self._as_bag_error():
            self._writer.finish()
            self.sync(self.flush())
            self._raw.close()
            counts = [self.counts[key] for key in range(len(self.topics))]
            metadata = metadata_of(FILE_NAME, self._span or (0, 0), self.topics, counts, self._notes, self._distro)
            bagmeta.write_metadata(self.directory / bagmeta.FILE_NAME, metadata)

    def abandon(self) -> None:
        """Close the open file without its end; data in memory are lost."""
        with suppress(OSError):
            self._raw.close()

    @contextmanager
    def _as_bag_error(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise self.fault(error) from error

    def fault(self, error: OSError) -> BagError:
        """Return the error for a disk that is full or fails."""
        return BagError(f"{self.file}: cannot be written ({error.strerror}). Make room or choose another disk.")


def recorded(topic: Topic) -> Recorded:
    """Return a topic of ``topics.yaml`` as it is recorded in a bag."""
    definition, _ = jazzy().generate_msgdef(topic.type, ros_version=2)
    return Recorded.offered(topic.absolute, topic.type, definition, topic.qos, jazzy().hash_rihs01(topic.type))


class MessageWriter:
    """Context manager that writes a session of one file.

    Leaving the context completes the bag. After an exception the file keeps no end, so that it is not taken for whole;
    `boom_twin.bag.recover.recover` saves its messages. `topics` have any keys, which `write` takes; their names are made
    absolute. `notes` state, for instance, that the session is synthetic. Options are those of `BagWriter`.
    """

    def __init__(
        self, directory: Path, topics: Mapping[str, Topic], notes: Mapping[str, str] | None = None, **options: Any
    ) -> None:
        self._types = {key: topic.type for key, topic in topics.items()}
        self._bag = BagWriter(directory, notes, **options)
        self._keys = dict(zip(topics, self._bag.add(*map(recorded, topics.values())), strict=True))

    def write(self, key: str, stamp_ns: int, msg: Any) -> None:
        """Append a message of rosbags to the topic `key`; `stamp_ns` becomes log time and publish time."""
        self.write_encoded(key, stamp_ns, bytes(jazzy().serialize_cdr(msg, self._types[key])))

    def write_encoded(self, key: str, stamp_ns: int, data: bytes) -> None:
        number = self._keys[key]
        self._bag.write(number, stamp_ns, data, sequence=self._bag.counts[number] + 1)

    def write_block(self, block: EncodedBlock) -> None:
        """Append many messages by the keys of their topics. The bytes are those of `write_encoded` for each message."""
        keys = np.empty(len(block.log_times), np.int64)
        for rows in block.rows:
            keys[rows.places] = self._keys[rows.key]
        self._bag.write_block(keys, block)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is None:
            self._bag.close()
            return
        with suppress(BagError):
            self._bag.flush()
        self._bag.abandon()
