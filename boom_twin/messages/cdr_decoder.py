"""Read fields of CDR-encoded ROS messages in place, without decoding the whole message.

A publisher sends the same names in every message. Decoding a message costs ten times as much as unpacking its numbers.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from mcap.records import Schema
from numpy.typing import NDArray

from ..types import SECOND, SENSORS, Integers, Stream
from .type_store import PADDING, decode, text_in


@dataclass(frozen=True, slots=True, eq=False)
class MessageBlock:
    """Encoded messages in the order of processing."""

    content: bytes  # bytes of all messages; may hold others
    sources: Integers  # source of each message, a number defined by the maker of the block; shape (k,)
    log_times: NDArray[np.uint64]  # log time of each message, ns; shape (k,)
    starts: Integers  # starts, ends: offsets of the start and the end of each message in `content`; shape (k,)
    ends: Integers

    def __len__(self) -> int:
        return len(self.starts)

    def chosen(self, rows: slice | Integers) -> MessageBlock:
        """Return the messages at `rows`, in that order."""
        return MessageBlock(self.content, self.sources[rows], self.log_times[rows], self.starts[rows], self.ends[rows])

    def data(self, row: int) -> bytes:
        return self.content[self.starts[row] : self.ends[row]]


def gather(content: bytes, places: Integers, size: int) -> NDArray[np.uint8]:
    """Return `size` bytes from each of the `places` in `content`; shape (places, size)."""
    if len(places) == 0:
        return np.empty((0, size), np.uint8)
    windows: NDArray[np.uint8] = np.ndarray((len(content) - size + 1, size), np.uint8, content, strides=(1, 1))
    return windows[places]


def joined(blocks: Sequence[MessageBlock]) -> MessageBlock:
    """Return the messages of one or more blocks as one block, in the order of the blocks."""
    if len(blocks) == 1:
        return blocks[0]
    spans = ((block.content, zip(block.starts.tolist(), block.ends.tolist(), strict=True)) for block in blocks)
    content = b"".join(content[start:end] for content, pairs in spans for start, end in pairs)
    ends = np.cumsum(np.concatenate([block.ends - block.starts for block in blocks]))
    sources, log_times = (np.concatenate(rows) for rows in zip(*((b.sources, b.log_times) for b in blocks), strict=True))
    return MessageBlock(content, sources, log_times, np.concatenate([[0], ends[:-1]]), ends)


def by_log_time(block: MessageBlock) -> MessageBlock:
    """Return the messages sorted by log time. Messages of equal log time keep their order."""
    times = block.log_times
    return block if (times[1:] >= times[:-1]).all() else block.chosen(np.argsort(times, kind="stable"))


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

    Raise ValueError, struct.error or KeyError if the message is not whole.
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
_JOINT_STATE, _IMU = (SENSORS[stream].message for stream in (Stream.STROKES, Stream.IMU))
_ARRAYS = ("position", "velocity", "effort")
_HEAD = _ORIGIN + 8  # behind the stamp
_IMU_NUMBERS, _BEFORE_RATE, _BEFORE_FORCE = 37, 13, 25  # doubles of an Imu, and those before its vectors


class Joints(NamedTuple):
    """Fields read from a sensor_msgs/JointState: its names and one of its arrays. Of many messages, a number is an array."""

    name: tuple[str, ...]
    position: tuple[Any, ...] = ()
    effort: tuple[Any, ...] = ()


class Vector(NamedTuple):
    """A geometry_msgs/Vector3."""

    x: Any
    y: Any
    z: Any


class Axes(NamedTuple):
    """Fields read from a sensor_msgs/Imu; of covariances the first element. Of many messages, a number is an array."""

    frame: str
    angular_velocity: Vector
    angular_velocity_covariance: tuple[Any]
    linear_acceleration: Vector
    linear_acceleration_covariance: tuple[Any]


class CdrDecoder:
    """Decoder of the messages of one topic. The frame and the names of a message are decoded when they are new.

    A ``sensor_msgs/msg/JointState`` or ``sensor_msgs/msg/Imu`` is read in place. `decode` takes other types, messages with a
    new head, and those that are not whole. `field` is the array of a JointState to read, ``position`` or ``effort``.
    """

    def __init__(self, type_name: str, decode: Callable[[bytes, str], Any] = decode, field: str = _ARRAYS[0]) -> None:
        self._type, self._decode, self._field = type_name, decode, field
        self._heads: list[tuple[bytes, int, Any]] = []  # bytes of frame and names, their end, and the names or the frame

    def read(self, data: bytes) -> tuple[int, Any]:
        """Return stamp (ns) and message with the fields that `boom_twin.messages.sample_decoder.SampleDecoder` reads.

        Raise ValueError, or what `decode` raises, if the message is not whole.
        """
        most_heads = 8  # number of heads kept for one topic: a bus may send every joint in a message of its own
        is_imu = self._type == _IMU
        is_little = data[:2] == _LITTLE and (is_imu or self._type == _JOINT_STATE)
        found = None
        if is_little:
            for head, end, text in self._heads:
                if data[_HEAD:end] == head:
                    found = _axes(data, end, text) if is_imu else _joints(data, end, text, self._field)
                    break
        msg = self._decode(data, self._type) if found is None else found
        stamp = stamp_in(data)
        if stamp is None:
            raise ValueError("the message is too short for a header")
        if found is None and is_little:
            frame, place = _string(data, _HEAD, _LENGTHS["<"])
            text, end = (frame, place) if is_imu else names_in(data)
            self._heads = [(data[_HEAD:end], end, text), *self._heads[: most_heads - 1]]
        return stamp, msg

    def read_many(self, block: MessageBlock) -> tuple[Integers, Any] | None:
        """Return stamps (ns) and one message with arrays (k,) for numbers; None unless all have one layout, which is known."""
        first, size, is_imu = block.data(0), int(block.ends[0] - block.starts[0]), self._type == _IMU
        known = next((each for each in self._heads if first[_HEAD : each[1]] == each[0]), None)
        if known is None or first[:2] != _LITTLE or (block.ends - block.starts != size).any():
            return None
        _, end, text = known
        if (_axes(first, end, text) if is_imu else _joints(first, end, text, self._field)) is None:
            return None
        arrays = [] if is_imu else _arrays(first, end)[0]
        rows = gather(block.content, block.starts, size)
        alike = slice(_ORIGIN), slice(_HEAD, end), *(slice(length, length + 4) for length, _, _ in arrays)
        if any((rows[:, each] != rows[0, each]).any() for each in alike):
            return None
        times = rows[:, _ORIGIN:_HEAD].copy()
        stamps = times.view("<i4")[:, 0] * np.int64(SECOND) + times.view("<u4")[:, 1]
        _, place, count = (0, _aligned(end), _IMU_NUMBERS) if is_imu else arrays[_ARRAYS.index(self._field)]
        numbers = tuple(rows[:, place : place + 8 * count].copy().view("<f8").T)
        return stamps, _axes_of(text, numbers) if is_imu else Joints(text)._replace(**{self._field: numbers})


def _aligned(place: int) -> int:
    """Return the offset of a double that is written at `place` or behind it."""
    return place + -(place - _ORIGIN) % 8


def _arrays(data: bytes, place: int) -> tuple[list[tuple[int, int, int]], int]:
    """Return the arrays of a JointState whose names end at `place`, and the end of the last one.

    Of each array these are the offsets of its length and of its first number, and its length.
    """
    found = []
    for _ in _ARRAYS:
        length = place + -place % 4
        place = length + 4
        if count := int.from_bytes(data[length:place], "little"):
            place = _aligned(place)
        found.append((length, place, count))
        place += 8 * count
    return found, place


def _joints(data: bytes, place: int, names: tuple[str, ...], field: str) -> Joints | None:
    """Return the fields of a JointState whose names end at `place`; None if it is not whole."""
    arrays, end = _arrays(data, place)
    if not end <= len(data) <= end + PADDING:
        return None
    _, first, count = arrays[_ARRAYS.index(field)]
    return Joints(names)._replace(**{field: struct.unpack_from(f"<{count}d", data, first)})


def _axes(data: bytes, place: int, frame: str) -> Axes | None:
    """Return the fields of an Imu whose frame ends at `place`, before numbers at fixed offsets; None if it is not whole."""
    place = _aligned(place)
    if not 0 <= len(data) - place - 8 * _IMU_NUMBERS <= PADDING:
        return None
    return _axes_of(frame, struct.unpack_from(f"<{_IMU_NUMBERS}d", data, place))


def _axes_of(frame: str, numbers: Any) -> Axes:
    rate, force = (numbers[first : first + 4] for first in (_BEFORE_RATE, _BEFORE_FORCE))
    return Axes(frame, Vector(*rate[:3]), (rate[3],), Vector(*force[:3]), (force[3],))
