"""A rosbag2 directory with one .mcap file, the same bytes for the same input."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from mcap.writer import CompressionType, Writer

from ..errors import BagError
from . import bagmeta
from .survey import NOTES, PROFILE
from .topics import Topic
from .typestore import jazzy

FILE_NAME = "session_0.mcap"
CHUNK_SIZE = 64 * 1024
"""Bytes of messages that wait in memory: about one second of a 200 Hz session."""
LIBRARY = "boom_twin"


class SessionWriter:
    """Writes a session; use it as a context.

    Leaving the context completes the bag, after an error too: what was written so far can be read.

    Parameters
    ----------
    directory : Path
        Made if it is not there.
    topics : dict of str to Topic
        By any key; `write` takes that key. Names are made absolute.
    notes : dict of str to str, optional
        Kept in the file and in ``custom_data``; for instance that the session is synthetic, and of what origin.
    compression : CompressionType, optional
        Of the chunks.

    Raises
    ------
    BagError
        If `directory` holds anything, or cannot be made.
    """

    def __init__(
        self,
        directory: Path,
        topics: Mapping[str, Topic],
        notes: Mapping[str, str] | None = None,
        compression: CompressionType = CompressionType.ZSTD,
    ) -> None:
        self._directory = directory
        self._topics = dict(topics)
        self._notes = dict(notes or {})
        self._counts: Counter[str] = Counter()
        self._times: tuple[int, int] | None = None
        self._encode = jazzy().serialize_cdr
        _claim(directory)
        self._file = (directory / FILE_NAME).open("xb")
        self._writer = Writer(self._file, chunk_size=CHUNK_SIZE, compression=compression)
        self._writer.start(profile=PROFILE, library=LIBRARY)
        if self._notes:
            self._writer.add_metadata(NOTES, self._notes)
        schemas = {topic.type: self._register_schema(topic.type) for topic in self._topics.values()}
        self._channels = {key: self._register(topic, schemas[topic.type]) for key, topic in self._topics.items()}

    def write(self, key: str, stamp_ns: int, msg: Any) -> None:
        """Append a message of rosbags to the topic `key`; `stamp_ns` becomes log time and publish time."""
        self.write_encoded(key, stamp_ns, bytes(self._encode(msg, self._topics[key].type)))

    def write_encoded(self, key: str, stamp_ns: int, data: bytes) -> None:
        """Append a message that is CDR already, as a raw subscription delivers it."""
        self._counts[key] += 1
        first, last = self._times or (stamp_ns, stamp_ns)
        self._times = min(first, stamp_ns), max(last, stamp_ns)
        self._writer.add_message(self._channels[key], stamp_ns, data, stamp_ns, self._counts[key])

    def flush(self) -> None:
        """Put all messages so far on the disk, to survive the loss of the process and of power."""
        self._writer.flush()  # type: ignore[no-untyped-call]
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Complete the file, then write ``metadata.yaml``."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()
        bagmeta.write_metadata(self._directory / bagmeta.FILE_NAME, self._metadata())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _register_schema(self, type_name: str) -> int:
        definition, _ = jazzy().generate_msgdef(type_name, ros_version=2)
        schema: int = self._writer.register_schema(type_name, "ros2msg", definition.encode())
        return schema

    def _register(self, topic: Topic, schema: int) -> int:
        qos = bagmeta.dump(bagmeta.offered_qos(topic.qos))
        details = {"offered_qos_profiles": qos, "topic_type_hash": jazzy().hash_rihs01(topic.type)}
        return self._writer.register_channel(topic.absolute, "cdr", schema, details)

    def _metadata(self) -> bagmeta.BagMetadata:
        first, last = self._times or (0, 0)
        start = bagmeta.Start(nanoseconds_since_epoch=first)
        duration = bagmeta.Duration(nanoseconds=last - first)
        count = self._counts.total()
        return bagmeta.BagMetadata(
            version=bagmeta.VERSION,
            storage_identifier="mcap",
            duration=duration,
            starting_time=start,
            message_count=count,
            topics_with_message_count=[self._topic_count(key, topic) for key, topic in self._topics.items()],
            relative_file_paths=[FILE_NAME],
            files=[
                bagmeta.FileInformation(path=FILE_NAME, starting_time=start, duration=duration, message_count=count)
            ],
            custom_data=self._notes or None,
            ros_distro="jazzy",
        )

    def _topic_count(self, key: str, topic: Topic) -> bagmeta.TopicCount:
        return bagmeta.TopicCount(
            topic_metadata=bagmeta.TopicMetadata(
                name=topic.absolute,
                type=topic.type,
                offered_qos_profiles=bagmeta.offered_qos(topic.qos),
                type_description_hash=jazzy().hash_rihs01(topic.type),
            ),
            message_count=self._counts[key],
        )


def _claim(directory: Path) -> None:
    """Make the directory; refuse one that holds anything."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        taken = sorted(entry.name for entry in directory.iterdir())
    except OSError as error:
        raise BagError(f"{directory}: cannot be made ({error.strerror}). Choose another place.") from error
    if taken:
        raise BagError(f"{directory}: holds {taken[0]} already, and nothing is overwritten. Choose a new directory.")
