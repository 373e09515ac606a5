"""Writers of sessions without ROS: from arrays of samples, and from samples of a live source."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..errors import UsageError
from ..messages.mapping import load_mapping
from ..messages.sample_decoder import LATEST, NO_MEASUREMENT
from ..messages.topic_table import FRAME, Topics, every_input, factor, usual
from ..messages.type_store import fill_header, jazzy, new_message
from ..scene.load import SceneSource
from ..twin.sample_check import SampleCheck, samples_of
from ..types import SECOND, SENSORS, Array, Sample, Stream
from .async_writer import Storage
from .session_model import SessionMetadata, scene_from
from .writer import BagWriter, MessageWriter, recorded


def write_samples(
    directory: Path, samples: Iterable[Sample], streams: Iterable[Stream], description: Mapping[str, str]
) -> None:
    """Write the bag of one session into a new or empty folder from ordered `samples`, with the topics of `streams`.

    Log times are the stamps. Readings that come beside others, those of a gyro, are in the messages with the same stamp.
    `description` are the notes of the bag: describe the session, and state if it is synthetic. Raise BagError if `directory`
    holds anything.
    """
    samples, inputs = list(samples), every_input()
    beside = {
        (SENSORS[sample.stream].beside, sample.stamp): sample.values for sample in samples if SENSORS[sample.stream].beside
    }
    topics = {stream.value: inputs[stream] for stream in streams if not SENSORS[stream].beside}
    with MessageWriter(directory, topics, description) as bag:
        for sample in samples:
            if sample.stream.value in topics:
                bag.write(
                    sample.stream.value, sample.stamp, sensor_message(sample, beside.get((sample.stream.value, sample.stamp)))
                )


def samples_in_rows(
    stamps_ns: NDArray[np.int64], values: Mapping[Stream, Array], angle_stamps_ns: NDArray[np.int64] | None = None
) -> list[Sample]:
    """Return the samples of a session by stamp, from rows of readings; at equal stamps in the order of `values`.

    A row without any value gives no sample.
    """
    other = {} if angle_stamps_ns is None else {Stream.ANGLES: angle_stamps_ns}
    samples = [
        Sample(stream, stamp, row)
        for stream, rows in values.items()
        for stamp, row in zip(other.get(stream, stamps_ns).tolist(), rows, strict=True)
        if not np.isnan(row).all()
    ]
    return sorted(samples, key=lambda sample: sample.stamp)


def sensor_message(sample: Sample, rate: Array | None = None) -> Any:
    """Return the message that a rig's sensor sends, with the usual names. An Imu has the `rate` (1,) too, if given."""
    kind = SENSORS[sample.stream]
    names = [usual(channel)["name"] for channel in kind.channels(len(sample.values) // (len(kind.ends) or 1))]
    readings = -sample.values if kind.beside else sample.values  # a gyro turns about the axis to the right, see `factor`
    msg = named_message(Sample(sample.stream, sample.stamp, readings), names)
    if rate is not None:
        msg.angular_velocity.y, msg.angular_velocity_covariance[0] = -float(rate[0]), 0.0
    return msg


def named_message(sample: Sample, names: Sequence[str]) -> Any:
    """Return the message of readings with names by a mapping, or axes. A reading without a name is left out."""
    kind = SENSORS[sample.stream]
    msg = new_message(kind.message)
    fill_header(msg.header, sample.stamp, FRAME if kind.is_named else kind.stem.removesuffix("_imu"))
    pairs = [(name, float(value)) for name, value in zip(names, sample.values, strict=True) if name]
    if kind.is_named:
        msg.name = [name for name, _ in pairs]
        setattr(msg, kind.field, np.array([value for _, value in pairs]))
        return msg
    for axis, value in pairs:
        setattr(getattr(msg, kind.field), axis, value)
    if kind.field != "point":
        msg.orientation.w = 1.0
        other = msg.linear_acceleration_covariance if kind.beside else msg.angular_velocity_covariance
        msg.orientation_covariance[0] = other[0] = NO_MEASUREMENT
    return msg


CLOCK_SET = SECOND  # step back of a stamp (ns) above which a clock was set; a smaller one is a late row


class LogTimes:
    """Log times of rows with stamps, in the order of the rows.

    A row whose stamp steps back has the log time of the row before. After a clock was set back, log times continue by the
    last interval.
    """

    def __init__(self) -> None:
        self._last = self._stamp = self._shift = 0
        self._step = 1

    def at(self, stamp: int) -> int:
        """Return the log time (ns) of the next row."""
        if self._last and stamp + self._shift < self._last - CLOCK_SET:
            self._shift = self._last + self._step - stamp
        elif self._last and 0 < stamp - self._stamp < CLOCK_SET:
            self._step = stamp - self._stamp
        self._stamp = stamp
        self._last = max(self._last, stamp + self._shift)
        return self._last


class SessionWriter:
    """Context manager that writes samples of a live source as a session like those of `boom_twin record`.

    Until the context ends, ``session.yaml`` marks the session as incomplete. It stays so after an exception or a kill, and
    `boom_twin recover` saves what was written.

    Parameters
    ----------
    out : path
        New or empty folder.
    scene : Scene, path or mapping, optional
        Boom of the session, stored in it. The default is the package's own.
    mapping : path, optional
        Names, units, signs and zeros of the rig's sensors, stored in the session. Messages are encoded with them. So a
        replay gives the same samples.
    note, origin : str, optional
        Note of the operator, and origin of the session.

    Raises
    ------
    BagError
        `out` holds anything, or cannot be written.
    UsageError, SceneError
        The mapping or the scene cannot be used.
    """

    def __init__(
        self,
        out: str | Path,
        scene: SceneSource = None,
        mapping: str | Path | None = None,
        note: str | None = None,
        origin: str | None = None,
    ) -> None:
        self._out, kept = Path(out), scene_from(scene)
        self._joints = len(kept.scene.joints)
        path = None if mapping is None else Path(mapping)
        self._topics = load_mapping(path, self._joints)
        text = None if path is None else path.read_text(encoding="utf-8-sig")
        names = {topic.absolute: topic.type for topic in self._topics.inputs.values()}
        self._metadata = SessionMetadata(
            __version__, kept.text, mapping=text, topics=names, note=note, origin=origin, started=datetime.now(UTC)
        )
        self._bag = BagWriter(self._out, {"origin": origin} if origin else None)
        self._metadata.write(self._out)
        self._storage = Storage(self._bag, lambda _: None)
        self._keys: dict[str, int] = {}
        self._sensors = {stream: _Sensors(self._topics, stream, self._joints) for stream in Stream}
        self._counts: Counter[str] = Counter()
        self._log, self._due, self._is_closed = LogTimes(), 0.0, False
        channels = {stream: SENSORS[stream].channels(self._joints) for stream in Stream}
        self._check = SampleCheck(channels, Stream.ANGLES if self._topics.drive == "angles" else Stream.STROKES)

    def write(self, sample: Sample | Mapping[str, Any], stamp_ns: int | None = None) -> None:
        """Append a sample, or readings by name in SI units as for `Twin.update`.

        Raises
        ------
        BagError
            The disk is full or fails, or does not keep up.
        UsageError
            A sample, or readings by name, that `Twin.update` refuses; a stamp before 1970 or at 0; the context has ended.
        """
        check_period = 0.5  # time (s) between two checks of the disk
        if self._is_closed:
            raise UsageError(f"{self._out}: the session is closed. Write within its `with` block.")
        samples = samples_of(sample, stamp_ns, self._joints) if isinstance(sample, Mapping) else [sample]
        for each in map(self._check.checked, samples):
            if not 0 < each.stamp < LATEST:
                raise UsageError(f"stamp is {each.stamp} ns: a message can hold 1 to {LATEST - 1}. Give ns since 1970.")
            topic = self._topics.inputs.get(Stream(SENSORS[each.stream].beside or each.stream))
            if topic is None:
                raise UsageError(f"{each.stream.value}: the mapping has no such sensor. Give its place there.")
            message = self._sensors[each.stream].message(each)
            if topic.absolute not in self._keys:
                self._keys[topic.absolute] = self._storage.add(recorded(topic))
            self._counts[topic.absolute] += 1
            data, log = bytes(jazzy().serialize_cdr(message, topic.type)), self._log.at(each.stamp)
            self._storage.put(self._keys[topic.absolute], log, data, log, self._counts[topic.absolute])
        if (now := time.monotonic()) > self._due:
            self._due = now + check_period
            self._storage.check()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        written, self._is_closed = self._storage.close(), True
        if kind is None:
            self._metadata.write(self._out, [{"topic": topic, "written": written[key]} for topic, key in self._keys.items()])


class _Sensors:
    """Sensors of one stream: readings from quantities in SI units."""

    def __init__(self, topics: Topics, stream: Stream, joints: int) -> None:
        sensors = topics.sensors_of(stream, joints)
        self._names = ["" if channel in topics.absent else sensor.name for channel, sensor in sensors.items()]
        self._factors = np.array([factor(channel, sensor) for channel, sensor in sensors.items()])
        self._zeros = np.array([sensor.zero for sensor in sensors.values()])
        self._delay = topics.delay(stream)

    def message(self, sample: Sample) -> Any:
        """Return the message that a decoder with the same mapping turns into this sample."""
        readings = np.asarray(sample.values, float) / self._factors + self._zeros
        return named_message(Sample(sample.stream, sample.stamp + self._delay, readings), self._names)
