"""Read fields of CDR-encoded ROS messages in place, without decoding the whole message.

A publisher sends the same names in every message. Decoding a message costs ten times as much as unpacking its numbers.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from mcap.records import Schema

from ..types import SECOND, Stream
from .topic_table import TYPES
from .type_store import decode, text_in

_ORIGIN = 4  # bytes of encapsulation, from after which CDR aligns
_ORDERS = {b"\x00\x00": ">", b"\x00\x01": "<"}
_STAMPS = {order: struct.Struct(f"{order}iI") for order in "<>"}
_LENGTHS = {order: struct.Struct(f"{order}I") for order in "<>"}


def has_header(schema: Schema) -> bool:
    """Return True if messages with this definition begin with a ``std_msgs/Header``."""
    for line in schema.data.decode(errors="replace").splitlines():
        if words := line.split("#")[0].split():
            return words[0] in ("std_msgs/Header", "std_msgs/msg/Header", "Header")
    return False


def stamp_in(data: bytes) -> int | None:
    """Return ``header.stamp`` (ns) of a message that begins with a header; None if the message is too short."""
    order = _ORDERS.get(data[:2])
    if order is None or len(data) < _ORIGIN + 8:
        return None
    seconds, nanoseconds = _STAMPS[order].unpack_from(data, _ORIGIN)
    return int(seconds) * SECOND + int(nanoseconds)


def names_in(data: bytes) -> tuple[tuple[str, ...], int]:
    """Return ``name`` of a sensor_msgs/JointState, and the offset of its end in `data`.

    Raises
    ------
    ValueError, struct.error, KeyError
        The message is not whole.
    """
    length = _LENGTHS[_ORDERS[data[:2]]]
    place = _string(data, _ORIGIN + 8, length)[1]  # after frame_id
    place += -(place - _ORIGIN) % 4
    (count,) = length.unpack_from(data, place)
    place += 4
    names = []
    for _ in range(count):  # ends early with an error where the message is shorter than that
        place += -(place - _ORIGIN) % 4
        name, place = _string(data, place, length)
        names.append(name)
    return tuple(names), place


def _string(data: bytes, place: int, length: struct.Struct) -> tuple[str, int]:
    """Return the string at `place`, and the offset of its end."""
    (size,) = length.unpack_from(data, place)
    end = place + 4 + size
    if end > len(data):
        raise ValueError("a string ends after the message")
    return text_in(data[place + 4 : max(place + 4, end - 1)]), end


_LITTLE = b"\x00\x01"
_POSITION = "position"
_TIME = 8  # bytes of a stamp
_BEFORE_FORCE = 25  # doubles of an Imu before its linear acceleration


class Joints(NamedTuple):
    """Fields read from a sensor_msgs/JointState: its names and one of its arrays."""

    name: tuple[str, ...]
    position: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()


class Vector(NamedTuple):
    """A geometry_msgs/Vector3."""

    x: float
    y: float
    z: float


class Force(NamedTuple):
    """Fields read from a sensor_msgs/Imu."""

    frame: str
    linear_acceleration: Vector
    linear_acceleration_covariance: tuple[float]


class Layout(NamedTuple):
    """Layout of a decoded message, which later messages may share."""

    size: int
    head: bytes
    end: int
    stamped: struct.Struct
    later: tuple[tuple[int, bytes], ...]
    make: Callable[[tuple[float, ...]], Joints | Force]

    def is_of(self, data: bytes) -> bool:
        """Return True if `data` has this layout."""
        if len(data) != self.size or data[:2] != _LITTLE or data[_ORIGIN + _TIME : self.end] != self.head:
            return False
        return not self.later or all(data[at : at + len(part)] == part for at, part in self.later)

    def read_stamped(self, data: bytes) -> tuple[int, Joints | Force]:
        """Return stamp (ns) and fields of a message with this layout."""
        seconds, nanoseconds, *_ = found = self.stamped.unpack_from(data, _ORIGIN)
        return seconds * SECOND + nanoseconds, self.make(found[2:])


MOST_LAYOUTS = 8
"""Number of layouts kept for one topic: a bus may send every joint in a message of its own."""


class CdrDecoder:
    """Decoder of the messages of one topic.

    Parameters
    ----------
    type_name : str
        ``sensor_msgs/msg/JointState`` or ``sensor_msgs/msg/Imu``.
    decode : callable, optional
        Decodes a message whose layout is not known yet.
    field : str
        Array of a JointState to read, ``position`` or ``effort``.
    """

    def __init__(self, type_name: str, decode: Callable[[bytes, str], Any] = decode, field: str = _POSITION) -> None:
        self._type, self._decode, self._field = type_name, decode, field
        self._layouts: list[Layout] = []

    def read(self, data: bytes) -> tuple[int, Any]:
        """Return stamp (ns) and message with the fields that `boom_twin.messages.sample_decoder.SampleDecoder` reads.

        Raises
        ------
        ValueError, or what `decode` raises
            The message is not whole.
        """
        for layout in self._layouts:
            if layout.is_of(data):
                return layout.read_stamped(data)
        msg = self._decode(data, self._type)
        if (new := layout_of(data, self._type, self._field)) is not None:
            self._layouts = [new, *self._layouts[: MOST_LAYOUTS - 1]]
        stamp = stamp_in(data)
        if stamp is None:
            raise ValueError("the message is too short for a header")
        return stamp, msg


def layout_of(data: bytes, type_name: str, field: str) -> Layout | None:
    """Return the layout of a message that was decoded, of a type that `CdrDecoder` reads; None if it is big-endian."""
    if data[:2] != _LITTLE:
        return None
    return _force_layout(data) if type_name == TYPES[Stream.IMU] else _joints_layout(data, field)


def _joints_layout(data: bytes, field: str) -> Layout:
    """Return the layout of a JointState: header, names, then positions, velocities and efforts, each after its length."""
    names, place = names_in(data)
    place += -(place - _ORIGIN) % 4
    end, lengths, found = place + 4, list[tuple[int, bytes]](), {}
    for each in (_POSITION, "velocity", "effort"):
        length = data[place : place + 4]
        if len(lengths) > 1 and lengths[-1][0] + len(lengths[-1][1]) == place:  # right behind the one before
            lengths[-1] = lengths[-1][0], lengths[-1][1] + length
        else:
            lengths.append((place, length))
        count = int.from_bytes(length, "little")
        place += 4
        at = place + (-(place - _ORIGIN) % 8 if count else 0)
        found[each] = at, struct.Struct(f"<{count}d")
        place = at + 8 * count
    at, numbers = found[field]
    head, make = data[_ORIGIN + _TIME : end], partial(Joints, names) if field == _POSITION else partial(Joints, names, ())
    return Layout(len(data), head, end, _stamped(at, numbers), tuple(lengths[1:]), make)


def _force_layout(data: bytes) -> Layout:
    """Return the layout of an Imu, whose fields after the header have fixed offsets."""
    end = _ORIGIN + _TIME + 4 + int.from_bytes(data[_ORIGIN + _TIME : _ORIGIN + _TIME + 4], "little")
    at = end + -(end - _ORIGIN) % 8 + 8 * _BEFORE_FORCE
    numbers, frame = struct.Struct("<4d"), _string(data, _ORIGIN + _TIME, _LENGTHS["<"])[0]
    return Layout(len(data), data[_ORIGIN + _TIME : end], end, _stamped(at, numbers), (), partial(_force, frame))


def _stamped(at: int, numbers: struct.Struct) -> struct.Struct:
    """Return the structure of a stamp and of numbers at offset `at`, read from after the encapsulation."""
    return struct.Struct(f"<iI{at - _ORIGIN - _TIME}x{numbers.format.removeprefix('<')}")


def _force(frame: str, row: tuple[float, ...]) -> Force:
    x, y, z, covariance = row
    return Force(frame, Vector(x, y, z), (covariance,))
