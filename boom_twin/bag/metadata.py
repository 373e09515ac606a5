"""``metadata.yaml`` of a rosbag2 directory: read, write, and add up from the files; offered QoS of its topics."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from io import StringIO
from pathlib import Path, PureWindowsPath
from typing import Any

from pydantic import BaseModel, Field, ValidationError
from ruamel.yaml import YAML

from ..config.yaml_text import plain, read_plain
from ..errors import BagError
from ..messages.topic_table import Qos
from ..system.files import write_atomic

FILE_NAME = "metadata.yaml"

STORAGES = {".mcap": "mcap", ".db3": "sqlite3"}  # storages of rosbag2 that are read, by the suffix of their files
_ROOT = "rosbag2_bagfile_information"
_FOREVER = {"sec": 9223372036, "nsec": 854775807}


class TopicMetadata(BaseModel):
    """One topic of the bag."""

    name: str
    type: str
    serialization_format: str = "cdr"
    offered_qos_profiles: Any = []
    type_description_hash: str = ""


class TopicCount(BaseModel):
    """One topic and its number of messages."""

    topic_metadata: TopicMetadata
    message_count: int


class BagMetadata(BaseModel):
    """Content of ``metadata.yaml``. Keys missing in older versions have defaults; keys added by newer ones are ignored."""

    version: int
    storage_identifier: str
    duration: Any = None
    starting_time: Any = None
    message_count: int
    topics_with_message_count: list[TopicCount]
    compression_format: str = ""
    compression_mode: str = ""
    relative_file_paths: list[str] = Field(min_length=1)
    files: Any = []
    custom_data: dict[str, Any] | None = None
    ros_distro: str = ""

    @property
    def counts(self) -> Counter[str]:
        """Number of messages by topic."""
        found: Counter[str] = Counter()
        for entry in self.topics_with_message_count:
            found[entry.topic_metadata.name] += entry.message_count
        return found

    @property
    def file_names(self) -> list[str]:
        """Names of the files without their folders, which may be written as Windows paths."""
        return [PureWindowsPath(name).name for name in self.relative_file_paths]

    @property
    def notes(self) -> dict[str, str]:
        """Notes of the writer (``custom_data``), as texts."""
        return {key: str(value) for key, value in (self.custom_data or {}).items()}


_UNPACKERS = {
    ".zstd": "zstd -d", ".zst": "zstd -d", ".gz": "gzip -dk", ".bz2": "bzip2 -dk", ".xz": "xz -dk", ".lz4": "lz4 -d",
    ".zip": "unzip", ".tar": "tar -xf", ".tgz": "tar -xf",
}  # fmt: skip
"""Commands that unpack a file, by its suffix."""


def refuse_packed(path: Path) -> None:
    """Raise a BagError if the name of a file says that it is packed as a whole."""
    if (unpacker := _UNPACKERS.get(path.suffix.lower())) is not None:
        raise BagError(
            f"{path}: packed as a whole. Unpack it in its folder: `{unpacker} {path.name}`, and read what comes out."
        )


def read_metadata(path: Path) -> BagMetadata:
    """Return the content of a ``metadata.yaml``.

    Raise BagError if it is no ``metadata.yaml`` of rosbag2, or its bag has a storage or a compression that is not read.
    """
    remedy = "Move it away: the files of the session can be read without it."
    document = read_plain(path, BagError, remedy, received=True)
    try:
        metadata = BagMetadata.model_validate((document or {})[_ROOT])
    except (KeyError, TypeError) as error:
        raise BagError(f"{path}: no {_ROOT} in it, so not rosbag2 metadata. {remedy}") from error
    except ValidationError as error:
        faults = "; ".join(f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}" for fault in error.errors())
        raise BagError(f"{path}: not rosbag2 metadata ({faults}). {remedy}") from error
    if metadata.storage_identifier not in ("", *STORAGES.values()):
        raise BagError(
            f"{path}: storage_identifier = {metadata.storage_identifier!r}: only {' and '.join(STORAGES.values())} are read. "
            "Convert the bag with `ros2 bag convert` or `rosbags-convert`."
        )
    if metadata.compression_mode.lower() == "file" and all(name.endswith(".zstd") for name in metadata.file_names):
        for name in metadata.file_names:
            if not (path.parent / name.removesuffix(".zstd")).exists():
                refuse_packed(path.parent / name)
        unpacked = [name.removesuffix(".zstd") for name in metadata.file_names]
        metadata = metadata.model_copy(update={"relative_file_paths": unpacked, "compression_mode": ""})
    if metadata.compression_mode.lower() not in ("", "none"):
        raise BagError(
            f"{path}: compression_mode = {metadata.compression_mode!r}: only files with chunks compressed inside "
            "(zstd, lz4) are read. Convert the bag with `ros2 bag convert`."
        )
    return metadata


def dump(document: Any) -> str:
    """Return a document as YAML text in block style, as ROS tools write it, with keys in the given order."""
    yaml, text = YAML(), StringIO()
    yaml.default_flow_style = False
    yaml.width = 4096
    yaml.dump(document, text)
    return text.getvalue()


def write_metadata(path: Path, metadata: BagMetadata) -> None:
    """Write `metadata` as Jazzy does, atomically (see `write_atomic`). Equal values give equal bytes."""
    write_atomic(path, dump({_ROOT: metadata.model_dump()}))


def offered_qos(qos: Qos) -> list[dict[str, Any]]:
    """Return `qos` as a list of one offered profile, in the format of version 9."""
    return [
        {
            "history": "keep_last",
            "depth": qos.depth,
            "reliability": qos.reliability,
            "durability": qos.durability,
            "deadline": dict(_FOREVER),
            "lifespan": dict(_FOREVER),
            "liveliness": "automatic",
            "liveliness_lease_duration": dict(_FOREVER),
            "avoid_ros_namespace_conventions": False,
        }
    ]


@cache
def _offered_text(qos: Qos) -> str:
    return dump(offered_qos(qos))


_RELIABILITY = {1: "reliable", 2: "best_effort", "reliable": "reliable", "best_effort": "best_effort"}
_DURABILITY = {1: "transient_local", 2: "volatile", "transient_local": "transient_local", "volatile": "volatile"}


def profiles(value: Any) -> list[Qos]:
    """Return the QoS profiles of one topic as in ``topics.yaml``. A profile that cannot be read is left out.

    `value` is ``offered_qos_profiles`` of ``metadata.yaml`` or of a channel: a list, or YAML of one.
    """
    longest = 100_000  # characters of YAML in one entry
    if isinstance(value, str):
        try:
            value = plain(value) if len(value) <= longest else []
        except ValueError:
            return []
    found = [_profile(entry) for entry in (value if isinstance(value, list) else []) if isinstance(entry, dict)]
    return [qos for qos in found if qos is not None]


def _profile(entry: dict[Any, Any]) -> Qos | None:
    deepest = 10_000  # limit for the depth of a QoS profile that is read
    try:
        return Qos.model_validate(
            {
                "reliability": _RELIABILITY.get(entry.get("reliability"), "reliable"),
                "durability": _DURABILITY.get(entry.get("durability"), "volatile"),
                "depth": min(max(int(entry.get("depth") or 1), 1), deepest),
            }
        )
    except (ValidationError, TypeError, ValueError):
        return None


@dataclass(frozen=True, slots=True)
class Recorded:
    """One topic in a bag."""

    topic: str  # topic, type: absolute name, and type as ``package/msg/Name``
    type: str
    definition: bytes  # definition of the type and all types in it, in the language `definition_encoding`
    details: Mapping[str, str] = field(default_factory=dict)
    qos: Any = ()  # offered profiles, for ``metadata.yaml``
    type_hash: str = ""
    encoding: str = "cdr"
    definition_encoding: str = "ros2msg"

    @classmethod
    def offered(cls, topic: str, type_name: str, definition: str, qos: Qos, type_hash: str) -> Recorded:
        """Return a topic offered with `qos`. Its channel keeps the QoS and the hash of the type, as in rosbag2."""
        details = {"offered_qos_profiles": _offered_text(qos), "topic_type_hash": type_hash}
        return cls(topic, type_name, definition.encode(), details, offered_qos(qos), type_hash)

    @property
    def metadata(self) -> TopicMetadata:
        return TopicMetadata(
            name=self.topic,
            type=self.type,
            serialization_format=self.encoding,
            offered_qos_profiles=self.qos,
            type_description_hash=self.type_hash,
        )


def metadata_of(
    file: str, span: tuple[int, int], topics: Sequence[Recorded], counts: Sequence[int], notes: Mapping[str, str], distro: str
) -> BagMetadata:
    """Return the metadata of a bag of one file. `span` is first and last log time (ns), 0 without messages."""
    first, last = span
    times: dict[str, Any] = {"starting_time": {"nanoseconds_since_epoch": first}, "duration": {"nanoseconds": last - first}}
    count = sum(counts)
    return BagMetadata(
        version=9,  # of the format that Jazzy writes
        storage_identifier="mcap",
        **times,
        message_count=count,
        topics_with_message_count=[
            TopicCount(topic_metadata=topic.metadata, message_count=own) for topic, own in zip(topics, counts, strict=True)
        ],
        relative_file_paths=[file],
        files=[{"path": file, **times, "message_count": count}],
        custom_data=dict(notes) or None,
        ros_distro=distro,
    )
