"""``metadata.yaml`` of a rosbag2 directory, to read and to write."""

from __future__ import annotations

import os
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, ValidationError
from ruamel.yaml import YAML

from ..errors import BagError
from ..plain import read_plain
from .atomic import write_atomic
from .topics import Qos

FILE_NAME = "metadata.yaml"
VERSION = 9
"""Of the format, as Jazzy writes it."""

_ROOT = "rosbag2_bagfile_information"
_FOREVER = {"sec": 9223372036, "nsec": 854775807}


class Start(BaseModel):
    """A point in time."""

    nanoseconds_since_epoch: int = 0


class Duration(BaseModel):
    """A span of time."""

    nanoseconds: int = 0


class TopicMetadata(BaseModel):
    """One topic of the bag."""

    name: str
    type: str
    serialization_format: str = "cdr"
    offered_qos_profiles: Any = []
    type_description_hash: str = ""


class TopicCount(BaseModel):
    """How often one topic was recorded."""

    topic_metadata: TopicMetadata
    message_count: int


class FileInformation(BaseModel):
    """One file of the bag."""

    path: str
    starting_time: Start
    duration: Duration
    message_count: int


class BagMetadata(BaseModel):
    """The whole of it; what older versions lack has a default, what newer ones add is not looked at."""

    version: int
    storage_identifier: str
    duration: Duration
    starting_time: Start
    message_count: int
    topics_with_message_count: list[TopicCount]
    compression_format: str = ""
    compression_mode: str = ""
    relative_file_paths: list[str] = Field(min_length=1)
    files: list[FileInformation] = []
    custom_data: dict[str, Any] | None = None
    ros_distro: str = ""


def read_metadata(path: Path) -> BagMetadata:
    """What a ``metadata.yaml`` says.

    Raises
    ------
    BagError
        If it is no such file, or its bag is stored in a way that is not read here (sqlite3, compressed as a whole).
    """
    remedy = "Move it away: the .mcap files can be read without it."
    document = read_plain(path, BagError, remedy, received=True)
    try:
        metadata = BagMetadata.model_validate((document or {})[_ROOT])
    except (KeyError, TypeError) as error:
        raise BagError(f"{path}: no {_ROOT} in it, so not rosbag2 metadata. {remedy}") from error
    except ValidationError as error:
        faults = "; ".join(f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}" for fault in error.errors())
        raise BagError(f"{path}: not rosbag2 metadata ({faults}). {remedy}") from error
    if metadata.storage_identifier != "mcap":
        raise BagError(
            f"{path}: storage_identifier = {metadata.storage_identifier!r}: only mcap is read. "
            "Convert the bag with `ros2 bag convert` or `rosbags-convert`."
        )
    if metadata.compression_mode.lower() not in ("", "none"):
        raise BagError(
            f"{path}: compression_mode = {metadata.compression_mode!r}: only files with chunks compressed inside "
            "(zstd, lz4) are read. Convert the bag with `ros2 bag convert`."
        )
    return metadata


def write_metadata(path: Path, metadata: BagMetadata, sync: Callable[[int], None] = os.fsync) -> None:
    """Write `metadata` as Jazzy does, all of it or nothing; the same values give the same bytes. `sync`: see `write_atomic`."""
    write_atomic(path, dump({_ROOT: metadata.model_dump()}), sync)


def offered_qos(qos: Qos) -> list[dict[str, Any]]:
    """`qos` as one offered profile, in the words of version 9."""
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


def dump(document: Any) -> str:
    """YAML text in block style, keys in the order given, no anchors."""
    yaml = YAML()
    yaml.default_flow_style = False
    yaml.width = 4096
    text = StringIO()
    yaml.dump(document, text)
    return text.getvalue()
