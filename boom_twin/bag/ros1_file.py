"""Read a ``.bag`` file of ROS 1, its messages converted to CDR."""

from __future__ import annotations

from bz2 import BZ2Decompressor
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lz4.frame import LZ4FrameDecompressor
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader, ReaderError
from rosbags.rosbag1.reader import decompressors
from rosbags.typesys import TypesysError, get_types_from_msg

from ..errors import BagError
from ..messages.type_store import jazzy, other_than_jazzy
from ..system.received_files import open_received
from .mcap_records import MOST_HELD
from .session_file import CDR, PARSE_ERRORS, SessionFile, channel_of, schema_of

ENCODING = "ros1"  # encoding of a message that is not converted, because its type differs in Jazzy
_OWN = ("std_msgs/msg/Header", "builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
"""Types that differ in ROS 2, and that `Typestore.ros1_to_cdr` converts."""
_ERRORS = (ReaderError, AssertionError, EOFError, RecursionError, *PARSE_ERRORS)
_REMEDY = "The file is damaged or was cut off: `rosbag reindex` or `rosbag fix` of ROS 1 may mend a copy of it."


@dataclass(frozen=True, slots=True)
class Ros1File(SessionFile):
    """Content of one .bag file, which has no checksums."""

    def heads(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield messages as in `SessionFile`, in the order of log times."""
        convert = jazzy().ros1_to_cdr
        with _reader(self.path) as reader:
            for connection, time, data in reader.messages():
                is_same = self.channels[connection.id].message_encoding == CDR
                yield connection.id, time, bytes(convert(data, connection.msgtype)) if is_same else data


def summarise(path: Path) -> Ros1File:
    """Return the content of one file, which must have an index; see `storages.summarise`."""
    with _reader(path) as reader:
        connections = reader.connections
        return Ros1File(
            path=path,
            storage="ros1",
            library="ROS 1",
            compression=_compression(reader),
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


def _compression(reader: Any) -> str:
    names = {_lz4: "lz4", _bz2: "bz2"}
    return next((names.get(chunk.decompressor, "none") for chunk in reader.chunks.values()), "none")


def _bz2(data: bytes) -> bytes:
    return _within(BZ2Decompressor().decompress(data, MOST_HELD + 1))


def _lz4(data: bytes) -> bytes:
    return _within(LZ4FrameDecompressor().decompress(data, max_length=MOST_HELD + 1))


def _within(content: bytes) -> bytes:
    if len(content) > MOST_HELD:
        raise ReaderError(f"a chunk unpacks to more than {MOST_HELD} bytes, the most that is read")
    return content


@contextmanager
def _reader(path: Path) -> Iterator[Reader]:
    """Open a file whose chunks unpack within limits. Errors of the file become a BagError."""
    bounded: dict[Callable[[bytes], bytes], Callable[[bytes], bytes]]
    bounded = {decompressors["bz2"]: _bz2, decompressors["lz4"]: _lz4}
    try:
        open_received(path).close()
        with Reader(path) as reader:
            for place, chunk in reader.chunks.items():
                own = bounded.get(chunk.decompressor)
                reader.chunks[place] = chunk._replace(decompressor=own) if own else chunk
            yield reader
    except _ERRORS as error:
        raise BagError(f"{path}: {str(error) or type(error).__name__}. {_REMEDY}") from error
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror or error}). {_REMEDY}") from error
