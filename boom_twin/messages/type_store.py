"""Message types of ROS 2 Jazzy: the type store, decoding of whole messages, new messages by type name and their fields."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import cache, partial
from operator import call
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Typesdict
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from ..types import SECOND, Array
from .topic_table import FRAME

PADDING = 12
"""Bytes that may stand behind the last field of a message, whatever they are.

``rmw_serialize`` of Fast DDS, by which ``serialize_message`` of rclpy and rosbag2's writers of whole messages encode, gives
back a buffer of estimated size, not what Fast CDR has filled of it. The estimate aligns the elements of a sequence of doubles
also where there are none, which is 4 bytes each; a JointState has three. They are not initialised.
"""
_ORDERS = (b"\x00\x00", b"\x00\x01")


@cache
def jazzy() -> Typestore:
    """Return the type store that encodes, decodes and describes every message. No type is ever registered in it."""
    return get_typestore(Stores.ROS2_JAZZY)


def other_than_jazzy(types: Typesdict) -> list[str]:
    """Return the names of the types that Jazzy has, and defines otherwise."""
    known = jazzy().fielddefs
    return [name for name, (_, fields) in types.items() if name in known and list(known[name][1]) != list(fields)]


def text_in(data: bytes) -> str:
    """Return a text in UTF-8, or with a question mark for every byte beyond ASCII if it is in another encoding."""
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data.decode("ascii", "replace").replace("\ufffd", "?")


def decode(data: bytes, type_name: str) -> Any:
    """Return the message in `data`, which may have up to `PADDING` bytes after its end, as Fast DDS leaves there.

    The `Typestore`'s own decoder takes 3 bytes. Raise SerdeError if the message is not whole, or more stands behind it.
    """
    most_texts = 100  # texts of a message that may be in another encoding than UTF-8
    encapsulation = 4  # bytes before the first field; the second one says in which order bytes are
    if data[:2] not in _ORDERS:
        raise SerdeError(f"{type_name} begins with the bytes {data[:2].hex()!r}: only 0000 and 0001, plain CDR, can be read.")
    store = jazzy()
    kind = store.get_msgdef(type_name)
    read = kind.deserialize_cdr_le if data[1] else kind.deserialize_cdr_be
    for left in reversed(range(most_texts)):
        try:
            message, size = read(data[encapsulation:], 0, kind.cls, store)
            break
        except (struct.error, ValueError) as error:
            if not isinstance(error, UnicodeDecodeError) or not left:
                raise SerdeError(f"{type_name} of {len(data)} bytes is not whole: {error}") from error
            old = struct.pack("<I" if data[1] else ">I", len(error.object) + 1) + error.object
            data = data.replace(old, old[:4] + text_in(error.object).encode(), 1)
    end = encapsulation + size
    if len(data) > end + PADDING:
        behind = f"{len(data) - end} bytes stand behind its last field, which ends at byte {end}"
        raise SerdeError(f"{type_name} of {len(data)} bytes: {behind}; publishers leave up to {PADDING} there.")
    return message


Maker = Callable[[], Any]


def new_message(type_name: str) -> Any:
    """Return a new message of ``package/msg/Name`` (rosbags dataclass). Every field is zero or empty, also a quaternion's w."""
    return _maker(type_name)()


@cache
def _maker(type_name: str) -> Maker:
    store = jazzy()
    kind: Any = store.types[type_name]
    fields = [_field_maker(description) for _, description in store.fielddefs[type_name][1]]
    return lambda: kind(*map(call, fields))


def _field_maker(description: Any) -> Maker:
    """Return a function that makes one field of the given description."""
    node, detail = description
    if node is Nodetype.NAME:
        return _maker(detail)
    if node is Nodetype.BASE:
        return {"string": str, "bool": bool, "float32": float, "float64": float}.get(detail[0], int)
    element, length = detail if node is Nodetype.ARRAY else (detail[0], 0)
    if element[0] is Nodetype.BASE and element[1][0] != "string":
        kind = {"byte": "uint8", "char": "uint8"}.get(element[1][0], element[1][0])
        return partial(np.zeros, length, dtype=kind)
    single = _field_maker(element)
    return lambda: [single() for _ in range(length)]


def fill_header(header: Any, stamp: int, frame: str = FRAME) -> None:
    """Put a stamp (nanoseconds) and a frame into a ``std_msgs/Header``."""
    header.stamp.sec, header.stamp.nanosec = divmod(stamp, SECOND)
    header.frame_id = frame


def fill_xz(target: Any, values: Array | Sequence[float]) -> None:
    """Write model x to x and model y to z; y stays 0."""
    target.x, target.y, target.z = float(values[0]), 0.0, float(values[1])
