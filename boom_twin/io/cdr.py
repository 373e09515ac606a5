"""Single fields of an encoded message, read where they stand: decoding all of it would take ten times as long."""

from __future__ import annotations

import struct

from mcap.records import Schema

_ORIGIN = 4  # bytes of encapsulation, from after which CDR aligns
_ORDERS = {b"\x00\x00": ">", b"\x00\x01": "<"}
_STAMPS = {order: struct.Struct(f"{order}iI") for order in "<>"}
_LENGTHS = {order: struct.Struct(f"{order}I") for order in "<>"}


def has_header(schema: Schema) -> bool:
    """Whether messages of that definition begin with a ``std_msgs/Header``."""
    for line in schema.data.decode(errors="replace").splitlines():
        if words := line.split("#")[0].split():
            return words[0] in ("std_msgs/Header", "std_msgs/msg/Header", "Header")
    return False


def stamp_in(data: bytes) -> int | None:
    """``header.stamp`` in nanoseconds of a message that begins with a header; None if it is too short for one."""
    order = _ORDERS.get(data[:2])
    if order is None or len(data) < _ORIGIN + 8:
        return None
    seconds, nanoseconds = _STAMPS[order].unpack_from(data, _ORIGIN)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)


def names_in(data: bytes) -> tuple[tuple[str, ...], int]:
    """``name`` of a sensor_msgs/JointState, and where it ends in `data`.

    Raises
    ------
    ValueError, struct.error, KeyError
        If the message is not whole.
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
    """The string at `place`, and where it ends."""
    (size,) = length.unpack_from(data, place)
    end = place + 4 + size
    if end > len(data):
        raise ValueError("a string ends after the message")
    return data[place + 4 : max(place + 4, end - 1)].decode(), end
