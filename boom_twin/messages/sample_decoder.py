"""Decode a sensor message into a `Sample` in the scene's order and units.

Reads attributes only, so that messages of rclpy and of rosbags give the same numbers.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from math import inf, isnan, nan, tau
from typing import Any, NamedTuple

import numpy as np

from ..types import LIMIT, SECOND, SENSORS, Array, Integers, Sample, Stream
from .cdr_decoder import Axes, Vector
from .sample_assembler import Reading, SampleAssembler
from .topic_table import Topics, factor, load_topics

LATEST = 2**31 * SECOND  # first stamp beyond the range of a message, ns

MOST_NAMES = 1000  # limit for the number of names in a message; a machine has some tens of them


NO_MEASUREMENT = -1.0  # first element of a covariance where the quantity is not measured (REP-145)

_ABSENT = float("nan")  # value of a channel that a message does not have, distinguished by identity from a reading of NaN


def stamp_of(msg: Any) -> int:
    """Return ``header.stamp`` of a message, ns."""
    return int(msg.header.stamp.sec) * SECOND + int(msg.header.stamp.nanosec)


def in_range(values: Array, middle: Array, half: Array) -> Array:
    """Return readings (rad), with one turn removed where that brings them within `half` of `middle`.

    A reading off by more than one turn is unchanged: it is not from an encoder but, for example, in degrees.
    """
    outside = np.abs(values - middle) > half
    if not outside.any():
        return values
    turned = values - tau * np.sign(values - middle)
    return np.where(outside & (np.abs(turned - middle) <= half), turned, values)


class _Named(NamedTuple):
    """Channels of one stream among the names of a message.

    `places` are their indices, -1 for a missing or repeated name. `twice` are repeated names, `lacking` names without an index,
    `beyond` those of `Topics.beyond`. `is_regular` is True if all sensors are named once.
    """

    places: list[int]
    twice: set[str]
    lacking: list[str]
    beyond: list[str]
    is_regular: bool


class _Channels:
    """Channels of one stream: their places in a message, and the conversion of their readings."""

    def __init__(self, topics: Topics, stream: Stream, joints: int) -> None:
        sensors = topics.sensors_of(stream, joints)
        self.wanted = np.array([not topics.lacks(channel) for channel in sensors])
        self.names = [sensor.name if wanted else "" for sensor, wanted in zip(sensors.values(), self.wanted, strict=True)]
        self.scales = [(sensor.zero, factor(channel, sensor)) for channel, sensor in sensors.items()]
        self.is_plain = all(scale == (0.0, 1.0) for scale in self.scales)  # readings are quantities
        self.range = np.tile([[0.0], [inf]], len(self.names))  # middle and half of an encoder's range, see `in_range`
        if stream is Stream.ANGLES:
            for i, (mount, (low, high)) in enumerate(zip(topics.mounts(joints), topics.ranges, strict=False)):
                if mount is None:
                    self.range[:, i] = 0.5 * (low + high), 0.5 * (high - low)
        self._topics, self._stream = topics, stream
        self._known: dict[tuple[str, ...], _Named] = {}

    def among(self, names: tuple[str, ...]) -> _Named:
        """Return the channels among `names`."""
        kept = 16  # lists of names remembered for one stream: a bus may send every joint in a message of its own
        if names not in self._known:
            counts = Counter(names)
            places = [names.index(name) if name and counts[name] == 1 else -1 for name in self.names]
            twice = {name for name in self.names if name and counts[name] > 1}
            if len(self._known) >= kept:
                self._known.clear()
            lacking = [name for name, place in zip(self.names, places, strict=True) if name and place < 0]
            beyond = self._topics.beyond(self._stream, len(self.names), counts)
            self._known[names] = _Named(places, twice, lacking, beyond, not lacking and not beyond and max(places) >= 0)
        return self._known[names]

    def quantities(self, readings: list[float]) -> list[float]:
        """Return readings in SI units. Absent channels stay absent."""
        pairs = zip(readings, self.scales, strict=True)
        return [value if value is _ABSENT else (value - zero) * scale for value, (zero, scale) in pairs]


ODDITIES = {
    "unequal arrays": "position (of forces effort) shorter or longer than name; the values that have a name are used",
    "missing names": "some of the scene's cylinders or joints are in no message of a cycle; the others are used",
    "names apart": "cylinders or joints in messages of their own; those of a cycle are one sample, by the stamp of the first",
    "name twice": "a cylinder or joint is there twice in a message; neither value is used: take one out at its source",
    "two sources": "messages of one topic contradict each other at equal stamps or in their frame_id; none is used: end one",
    "unknown names only": "none of the scene's cylinders or joints is in the message, which is left out",
    "names of another boom": "cylinders or joints that the scene does not have; the message is left out",
    "too many names": f"more than {MOST_NAMES} in a message, which is left out",
    "not finite": "a reading without a value (NaN or infinity); it is left out",
    "absurd magnitude": f"above {LIMIT:g} in a message; that value is left out",
    "no measurement": "an Imu says by linear_acceleration_covariance[0] = -1 that it has none (REP-145); it is left out",
    "another frame": "header.frame_id is not that of the mapping: another sensor, or other axes; the message is left out",
    "no usable value": "nothing of a message could be used",
    "no stamp": "header.stamp is 0; the message is left out: let its driver set header.stamp to the time of the reading",
    "impossible stamp": "before 1970, or more seconds than a message can hold; the message is left out",
}
"""Irregularities of a message. On a topic shared by strokes and angles, a message with only one of them is regular."""


class SampleDecoder:
    """Decoder of messages to samples by the `topics` (default: the package's), with counts of irregular messages."""

    def __init__(self, joints: int, topics: Topics | None = None) -> None:
        topics = topics or load_topics()
        streams = [stream for stream in Stream if stream is not Stream.STROKES or stream in topics.inputs]
        self._channels = {stream: _Channels(topics, stream, joints) for stream in streams}
        pair = {Stream.STROKES: Stream.ANGLES, Stream.ANGLES: Stream.STROKES}
        self._sharing = pair if topics.is_shared else {}
        self.delays = {stream: topics.delay(stream) for stream in self._channels}  # from a sample's stamp to its message's, ns
        self._frames = {stream.value: topic.frame_id for stream, topic in topics.inputs.items()}
        self._areas = topics.areas
        self.refused = 0  # number of messages without a usable value; one without any names and values is not counted
        self.oddities: Counter[str] = Counter()  # count of each of the irregularities `ODDITIES`
        wanted = {stream: each.wanted for stream, each in self._channels.items()}
        self.assembler = SampleAssembler(wanted, self.oddities, topics.stroke_reading.stream)
        self.other_boom_names: dict[Stream, list[str]] = {}  # names in the newest message that has names of another boom
        # names missing in the first message that also had names unknown to the scene, and those unknown names
        self.strange_names: dict[Stream, tuple[list[str], list[str]]] = {}

    def samples(self, streams: Iterable[Stream], stamp_ns: int, msg: Any) -> list[Sample]:
        """Return the samples that are complete with `msg`, which came by the topic of these `streams`; see `sample_of`."""
        odd, contested = self.oddities.total(), self.assembler.refused
        readings = [reading for stream in streams if (reading := self._reading(stream, stamp_ns, msg)) is not None]
        self.refused += not readings and self.oddities.total() > odd
        found = [each for reading in readings for each in self.assembler.take(reading)]
        self.refused += self.assembler.refused - contested
        return found

    def many(self, streams: Iterable[Stream], stamps: Integers, msg: Any) -> list[tuple[Stream, Integers, Array]] | None:
        """Return streams, stamps (k,) in ns and values (k, channels) of the samples of many messages; None if any is irregular.

        `stamps` (at least two) and `msg` are from `CdrDecoder.read_many`; `streams` are as for `samples`.
        """
        found, frame = list[tuple[Stream, Integers, Array]](), msg.frame if isinstance(msg, Axes) else ""
        for stream in streams:
            channels, kind, taken = self._channels[stream], SENSORS[stream], stamps - self.delays[stream]
            columns, names = getattr(msg, kind.field), Vector._fields if isinstance(msg, Axes) else msg.name
            if isinstance(msg, Axes):
                places = [names.index(axis) if axis else -1 for axis in channels.names]
                is_absent = getattr(msg, f"{kind.field}_covariance")[0] == NO_MEASUREMENT
                if kind.beside and is_absent.all():
                    continue
                is_regular = not is_absent.any()
            else:
                places, *_, is_regular = channels.among(names)
                is_regular &= len(columns) == len(names)
            is_regular &= self._is_of_frame(stream, frame)
            own = [i for i, place in enumerate(places) if place >= 0]
            if not (is_regular and own and not kind.gives and ((stamps != 0) & (taken > 0) & (taken < LATEST)).all()):
                return None
            values = np.full((len(stamps), len(places)), np.nan)
            for i in own:
                zero, scale = channels.scales[i]
                values[:, i] = (columns[places[i]] - zero) * scale
            if not (np.abs(values[:, own]) <= LIMIT).all() or not self.assembler.is_regular(stream, taken, frame):
                return None
            found.append((stream, taken, in_range(values, *channels.range) if stream is Stream.ANGLES else values))
        for each in found:
            self.assembler.note(*each, frame)
        return found

    def _is_of_frame(self, stream: Stream, frame: str) -> bool:
        return frame == (self._frames.get(SENSORS[stream].beside or stream.value) or frame)

    def sample_of(self, stream: Stream, stamp_ns: int, msg: Any) -> Sample | None:
        """Return the sample that a message of rclpy or of rosbags holds by itself; None if no value of it can be used."""
        reading = self._reading(stream, stamp_ns, msg)
        return None if reading is None else reading.sample

    def _reading(self, stream: Stream, stamp_ns: int, msg: Any) -> Reading | None:
        is_by_name, taken = SENSORS[stream].is_named, stamp_ns - self.delays[stream]
        if is_by_name and not (len(msg.name) or len(getattr(msg, SENSORS[stream].field))):
            return None  # a sign of life
        if not (stamp_ns and 0 < taken < LATEST):
            self.oddities["impossible stamp" if stamp_ns else "no stamp"] += 1
            return None
        frame = "" if is_by_name else msg.frame if isinstance(msg, Axes) else msg.header.frame_id
        if not self._is_of_frame(stream, frame):
            self.oddities["another frame"] += not SENSORS[stream].beside
            return None
        raw, is_whole = self._by_name(msg, stream) if is_by_name else (self._by_axes(msg, stream), True)
        if raw is None:
            return None
        channels = self._channels[stream]
        quantities = raw if channels.is_plain else channels.quantities(raw)
        if SENSORS[stream].gives:
            stream, quantities = Stream(SENSORS[stream].gives), self._forces(quantities)
        values = [value if -LIMIT <= value <= LIMIT else self._reject(value) for value in quantities]
        if isnan(values[0]) and all(map(isnan, values)):
            self.oddities["no usable value"] += 1
            return None
        array = in_range(np.array(values), *channels.range) if stream is Stream.ANGLES else np.array(values)
        return Reading(Sample(stream, taken, array), is_whole, frame)

    def _places(self, stream: Stream, names: Sequence[str], end: int) -> tuple[list[int] | None, list[str], bool]:
        """Return places of the channels among `end` readings (-1 without one), what is odd, and if all sensors are named."""
        if len(names) > MOST_NAMES:
            return None, ["too many names"], True
        places, twice, lacking, beyond, is_regular = self._channels[stream].among(tuple(names))
        if is_regular and end == len(names):
            return places, [], True
        other = self._sharing.get(stream)
        if beyond:
            self.other_boom_names[stream] = beyond
            return None, ["names of another boom"], True
        if lacking and stream not in self.strange_names and (other is None or max(places) >= 0):
            self._note_strange(stream, names, lacking)
        odd = ["name twice"] if twice else []
        if max(places) < 0 and not odd:
            is_unknown = other is None or max(self._channels[other].among(tuple(names)).places) < 0
            return None, ["unknown names only"] if is_unknown else [], True
        if end != len(names):
            odd.append("unequal arrays")
            places = [place if place < end else -1 for place in places]
        return places, odd, twice.issuperset(lacking)

    def _note_strange(self, stream: Stream, names: Sequence[str], lacking: list[str]) -> None:
        """Keep names unknown to the scene beside the missing ones, which they may stand for."""
        known = {
            name for each in (stream, self._sharing.get(stream)) if each is not None for name in self._channels[each].names
        }
        strange = [name for name in names if name not in known]
        if strange:
            self.strange_names[stream] = lacking, strange

    def _by_name(self, msg: Any, stream: Stream) -> tuple[list[float] | None, bool]:
        """Return readings in the scene's order, `_ABSENT` where there is none, or None, and whether all names are there."""
        found = getattr(msg, SENSORS[stream].field)
        places, odd, is_whole = self._places(stream, msg.name, len(found))
        for name in odd:
            self.oddities[name] += 1
        return None if places is None else [float(found[place]) if place >= 0 else _ABSENT for place in places], is_whole

    def _by_axes(self, msg: Any, stream: Stream) -> list[float] | None:
        """Return readings along the axes that the mapping names; None if the message has none."""
        kind = SENSORS[stream]
        if hasattr(msg, f"{kind.field}_covariance") and getattr(msg, f"{kind.field}_covariance")[0] == NO_MEASUREMENT:
            if not kind.beside:
                self.oddities["no measurement"] += 1
            return None
        vector = getattr(msg, kind.field)
        return [float(getattr(vector, axis)) if axis else _ABSENT for axis in self._channels[stream].names]

    def _forces(self, pressures: list[float]) -> list[float]:
        """Return the forces (N, positive in tension) of cylinders by the pressures (Pa) of their cap and rod sides."""
        pairs = zip(pressures[::2], pressures[1::2], self._areas, strict=True)
        return [
            _ABSENT if cap is _ABSENT or rod is _ABSENT else rod * ring - cap * piston for cap, rod, (piston, ring) in pairs
        ]

    def _reject(self, value: float) -> float:
        """Return NaN and count the reason. An absent channel is counted elsewhere."""
        if value is not _ABSENT:
            self.oddities["absurd magnitude" if abs(value) < inf else "not finite"] += 1
        return nan
