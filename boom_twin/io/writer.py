"""A session bag from messages of known types."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from mcap.writer import CompressionType

from ..errors import BagError
from . import bagmeta
from .bagwriter import BagWriter, file_name
from .recorded import Recorded
from .topics import Topic
from .typestore import jazzy

FILE_NAME = file_name(0)


def recorded(topic: Topic) -> Recorded:
    """How a topic of ``topics.yaml`` stands in a bag."""
    qos = bagmeta.offered_qos(topic.qos)
    type_hash = jazzy().hash_rihs01(topic.type)
    details = {"offered_qos_profiles": bagmeta.dump(qos), "topic_type_hash": type_hash}
    definition, _ = jazzy().generate_msgdef(topic.type, ros_version=2)
    return Recorded(topic.absolute, topic.type, definition.encode(), details, qos, type_hash)


class SessionWriter:
    """Writes a session of one file; use it as a context.

    Leaving the context completes the bag. After an exception it stays without its end, so that nobody takes it for whole;
    `boom_twin.io.recover` saves what was written.

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
        self._topics = dict(topics)
        self._counts: Counter[str] = Counter()
        self._encode = jazzy().serialize_cdr
        self._bag = BagWriter(directory, notes, compression)
        self._keys = dict(zip(topics, self._bag.add(*map(recorded, topics.values())), strict=True))

    def write(self, key: str, stamp_ns: int, msg: Any) -> None:
        """Append a message of rosbags to the topic `key`; `stamp_ns` becomes log time and publish time."""
        self.write_encoded(key, stamp_ns, bytes(self._encode(msg, self._topics[key].type)))

    def write_encoded(self, key: str, stamp_ns: int, data: bytes) -> None:
        """Append a message that is CDR already."""
        self._counts[key] += 1
        self._bag.write(self._keys[key], stamp_ns, data, sequence=self._counts[key])

    def close(self) -> None:
        """Complete the file, then write ``metadata.yaml``."""
        self._bag.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
            return
        with suppress(BagError):
            self._bag.flush()
        self._bag.abandon()
