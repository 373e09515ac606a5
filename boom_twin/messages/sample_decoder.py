"""Decode a sensor message into a `Sample` in the scene's order and units.

Reads attributes only, so that messages of rclpy and of rosbags give the same numbers.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from math import inf, isnan, nan
from typing import Any

import numpy as np

from ..types import LIMIT, SECOND, SENSORS, Array, Sample, Stream
from .topic_table import AXES, Topics, factor, load_topics

LATEST = 2**31 * SECOND
"""Stamps (ns) from here on have no place in a message."""

LONGEST = 1000
"""Most names that are looked through; a machine has some tens of them."""

NO_MEASUREMENT = -1.0
"""First element of a covariance where the quantity is not measured (REP-145)."""

_ABSENT = float("nan")
"""Known by identity: stands for a channel that the message does not have, unlike one that reads NaN."""


def stamp_of(msg: Any) -> int:
    """``header.stamp`` of a message in nanoseconds."""
    stamp = msg.header.stamp
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


class _Channels:
    """The channels of one stream: where they stand in a message, and what a reading of them means."""

    def __init__(self, topics: Topics, stream: Stream, joints: int) -> None:
        sensors = topics.sensors_of(stream, joints)
        self.names = [sensor.name for sensor in sensors.values()]
        self.scales = [(sensor.zero, factor(channel, sensor)) for channel, sensor in sensors.items()]
        self.is_plain = all(scale == (0.0, 1.0) for scale in self.scales)  # readings are quantities
        self.usual: tuple[Sequence[str], int, list[int]] = (
            (),
            -1,
            [],
        )  # names, readings and places of a message without oddities
        self._topics, self._stream = topics, stream
        self._seen: Sequence[str] = ()
        self._places = [-1] * len(self.names)
        self.beyond: list[str] = []  # names of the newest message, see `Topics.beyond`

    def places(self, names: Sequence[str]) -> list[int]:
        """Where the channels stand among `names`, the first of equal ones; -1 for those that are not there."""
        if names != self._seen:
            self._seen, first = names[:], {name: place for place, name in reversed(list(enumerate(names)))}
            self._places = [first.get(name, -1) for name in self.names]
            self.beyond = self._topics.beyond(self._stream, len(self.names), first)
        return self._places

    def quantities(self, readings: list[float]) -> list[float]:
        """Readings in SI units; what is absent stays so."""
        pairs = zip(readings, self.scales, strict=True)
        return [value if value is _ABSENT else (value - zero) * scale for value, (zero, scale) in pairs]


ODDITIES = {
    "unequal arrays": "position (of forces effort) shorter or longer than name; the values that have a name are used",
    "missing names": "some of the scene's cylinders or joints are not in the message; the others are used",
    "unknown names only": "none of the scene's cylinders or joints is in the message, which is left out",
    "names of another boom": "cylinders or joints that the scene does not have; the message is left out",
    "too many names": f"more than {LONGEST} in a message, which is left out",
    "not finite": "NaN or infinity in a message; that value is left out",
    "absurd magnitude": f"above {LIMIT:g} in a message; that value is left out",
    "no measurement": "an Imu says by linear_acceleration_covariance[0] = -1 that it has none (REP-145); it is left out",
    "no usable value": "nothing of a message could be used",
    "no stamp": "zero, which a driver leaves that does not set header.stamp; the message is left out",
    "impossible stamp": "before 1970, or more seconds than a message can hold; the message is left out",
}
"""What may be odd about a message. That a message of a topic that strokes and angles share has only one kind of them is not."""


class SampleDecoder:
    """Maps messages to samples and counts what is odd about them.

    Parameters
    ----------
    joints : int
        Number of joints of the scene, n.
    topics : Topics, optional
        How the rig's sensors read; as usual by default.

    Attributes
    ----------
    oddities : Counter
        How often each of `ODDITIES` was met.
    other_boom_names : dict of Stream to list of str
        The names that the newest of these messages had, of another boom.
    strange_names : dict of Stream to tuple of list of str
        Names that the newest messages lacked, and those that they had and the scene does not, where there are both.
    delays : dict of Stream to int
        By how much stamps of messages are later than those of their samples, ns.
    """

    def __init__(self, joints: int, topics: Topics | None = None) -> None:
        topics = topics or load_topics()
        self._channels = {stream: _Channels(topics, stream, joints) for stream in Stream}
        pair = {Stream.STROKES: Stream.ANGLES, Stream.ANGLES: Stream.STROKES}
        self._sharing = pair if topics.is_shared else {}
        self.delays = {stream: topics.delay(stream) for stream in Stream}
        self._by_axis = {stream for stream, kind in SENSORS.items() if kind.is_imu}
        self.oddities: Counter[str] = Counter()
        self.other_boom_names: dict[Stream, list[str]] = {}
        self.strange_names: dict[Stream, tuple[list[str], list[str]]] = {}

    def samples(self, streams: Iterable[Stream], stamp_ns: int, msg: Any) -> Iterator[Sample]:
        """Those that `msg` holds of `streams`, the roles of the topic that it came by; see `put`."""
        return (sample for stream in streams if (sample := self.put(stream, stamp_ns, msg)) is not None)

    def put(self, stream: Stream, stamp_ns: int, msg: Any) -> Sample | None:
        """The sample that `msg` holds.

        Parameters
        ----------
        stream : Stream
            The role of the topic that it came by.
        stamp_ns : int
            Nanoseconds, see `stamp_of`.
        msg : sensor_msgs/JointState or sensor_msgs/Imu
            Of rclpy or of rosbags.

        Returns
        -------
        Sample or None
            None when no value of it can be used.
        """
        taken = stamp_ns - self.delays[stream]
        if not (stamp_ns and 0 < taken < LATEST):
            self.oddities["impossible stamp" if stamp_ns else "no stamp"] += 1
            return None
        raw = self._force(msg, stream) if stream in self._by_axis else self._by_name(msg, stream)
        if raw is None:
            return None
        channels = self._channels[stream]
        quantities = raw if channels.is_plain else channels.quantities(raw)
        values = [value if -LIMIT <= value <= LIMIT else self._reject(value) for value in quantities]
        if isnan(values[0]) and all(map(isnan, values)):
            self.oddities["no usable value"] += 1
            return None
        return Sample(stream, taken, np.array(values, dtype=np.float64))

    def places(self, stream: Stream, msg: Any) -> tuple[list[int] | None, list[str]]:
        """Where the channels of a stream stand among the readings of a message, and what is odd about that.

        Any other message with these names and as many readings gives the same.

        Returns
        -------
        list of int, or None
            Places in ``position`` or ``effort``, or in x, y, z of ``linear_acceleration``; -1 for a channel without a reading.
            None if the message is not of this stream.
        list of str
            Keys of `oddities`.
        """
        channels = self._channels[stream]
        if stream in self._by_axis:
            return [AXES.index(name) for name in channels.names], []
        names, end = msg.name, len(getattr(msg, SENSORS[stream].field))
        if len(names) > LONGEST:
            return None, ["too many names"]
        places = channels.places(names)
        if channels.beyond:
            self.other_boom_names[stream] = channels.beyond
            return None, ["names of another boom"]
        other = self._sharing.get(stream)
        if -1 in places and stream not in self.strange_names and (other is None or max(places) >= 0):
            self._note_strange(stream, names, places)
        if max(places) < 0:
            is_unknown = other is None or max(self._channels[other].places(names)) < 0
            return None, ["unknown names only"] if is_unknown else []
        odd = ["unequal arrays"] if end != len(names) else []
        if -1 in places:
            odd.append("missing names")
        return [place if place < end else -1 for place in places] if end < len(names) else places, odd

    def _note_strange(self, stream: Stream, names: Sequence[str], places: list[int]) -> None:
        """Note names that the scene does not have, beside those that are not there: they may be meant."""
        known = {
            name for each in (stream, self._sharing.get(stream)) if each is not None for name in self._channels[each].names
        }
        strange = [name for name in names if name not in known]
        lacking = [name for name, place in zip(self._channels[stream].names, places, strict=True) if place < 0]
        if strange:
            self.strange_names[stream] = lacking, strange

    def scales(self, stream: Stream) -> Array:
        """What is taken off a reading, and by what it is then multiplied, shape (2, channels)."""
        return np.array(self._channels[stream].scales).T

    def _by_name(self, msg: Any, stream: Stream) -> list[float] | None:
        """Readings in the scene's order, `_ABSENT` where there is none; None if there is none at all."""
        found, channels = getattr(msg, SENSORS[stream].field), self._channels[stream]
        names, end, usual = channels.usual
        if msg.name is names and len(found) == end:  # the decoder hands out the same names again
            return [float(found[place]) for place in usual]
        places, odd = self.places(stream, msg)
        for name in odd:
            self.oddities[name] += 1
        if places is not None and not odd and isinstance(msg.name, tuple):
            channels.usual = msg.name, len(found), places
        return None if places is None else [float(found[place]) if place >= 0 else _ABSENT for place in places]

    def _force(self, msg: Any, stream: Stream) -> list[float] | None:
        """Specific force along the axes that are taken for the tip's x and z."""
        if msg.linear_acceleration_covariance[0] == NO_MEASUREMENT:
            self.oddities["no measurement"] += 1
            return None
        return [float(getattr(msg.linear_acceleration, axis)) for axis in self._channels[stream].names]

    def _reject(self, value: float) -> float:
        """NaN, and a count of why; a channel that is absent has been counted before."""
        if value is not _ABSENT:
            self.oddities["absurd magnitude" if abs(value) < inf else "not finite"] += 1
        return nan
