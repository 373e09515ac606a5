"""Turn messages of the twin's topics into rows of the page's tables, for live and recorded topics alike.

Nothing is known of who sent a message. Here, and nowhere after it, one that cannot be used is dropped and counted.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import partial
from math import sqrt
from operator import attrgetter
from types import SimpleNamespace
from typing import Any, NamedTuple

from ...messages.report_encoder import decode_health
from ...messages.sample_decoder import SampleDecoder, stamp_of
from ...messages.topic_table import Output, Topics
from ...messages.type_store import decode
from ...types import NANO, SENSORS, Sample, Stream, stream_of
from .status import MAX_NODES, Severity, text
from .store import (
    DroppedMessages,
    MalformedError,
    Store,
    check_arrays,
    check_count,
    check_numbers,
    check_residuals,
    check_stamp,
)

MAX_STATUSES, MAX_CAUSES, MAX_MARKERS = 500, 100, 500
"""Statuses or alarms of one message, causes of one alarm, markers of one shape."""
MAX_WAITING = 1000  # stamps of which parts may wait for the others
COMPARED = Stream.IMU  # stream whose readings are shown beside the predicted ones; the others are shown as residuals
RESIDUALS = {stream: "joints" if stream is Stream.ANGLES else stream.value for stream in Stream if stream is not COMPARED}
"""Names of the tables of residuals."""
NO_MEASUREMENT = "no measurement"  # oddity of `SampleDecoder` that is no fault here: an Imu states that it has no measurement
PLANE, ACCELERATION = ("x_m", "z_m"), ("x_m_s2", "z_m_s2")
ESTIMATE = "estimate"
ESTIMATE_COLUMNS = (
    *PLANE, "sigma_x_m", "sigma_z_m", *ACCELERATION, "sigma_x_m_s2", "sigma_z_m_s2", "load_x_N", "load_z_N",
)  # fmt: skip
"""Columns of the table of estimates: displacement and acceleration of the tip with their deviations, load."""


class Vector(NamedTuple):
    """Output that is a vector in the plane of the boom: where it and its covariance are in a message, and its own table."""

    get: Callable[[Any], Any]
    covariance: Callable[[Any], Any] | None = None
    table: str = ""
    columns: tuple[str, ...] = ()


VECTORS = {
    Output.TIP_DISPLACEMENT: Vector(attrgetter("vector"), table="displacement", columns=PLANE),
    Output.TIP_POSITION: Vector(attrgetter("point"), table="position", columns=PLANE),
    Output.TIP_ACCELERATION: Vector(attrgetter("accel.linear"), table="acceleration", columns=ACCELERATION),
    Output.TIP_UNCERTAINTY: Vector(attrgetter("vector"), table="uncertainty", columns=PLANE),
    Output.ESTIMATE_POSE: Vector(attrgetter("pose.pose.position"), attrgetter("pose.covariance")),
    Output.ESTIMATE_ACCELERATION: Vector(attrgetter("accel.accel.linear"), attrgetter("accel.covariance")),
    Output.ESTIMATE_LOAD: Vector(attrgetter("wrench.force")),
}
JOINED = (
    Output.TIP_DISPLACEMENT, Output.TIP_POSITION, Output.ESTIMATE_POSE, Output.ESTIMATE_ACCELERATION, Output.ESTIMATE_LOAD,
)  # fmt: skip
"""Outputs with equal stamps that make one row of estimates."""
FORCE_COLUMNS = tuple(f"{kind}_{axis}_m_s2" for kind in ("measured", "predicted", "sigma") for axis in "xz")


class PartsOfRows:
    """Parts of rows that wait for the others of their stamp; the oldest are dropped when more than `MAX_WAITING` wait."""

    def __init__(self, names: Sequence[Hashable]) -> None:
        self._names = names
        self.waiting: dict[int, dict[Hashable, Sequence[float]]] = {}  # by stamp, ns

    def put(self, name: Hashable, stamp: int, values: Sequence[float]) -> list[Sequence[float]] | None:
        """Return all parts of the row at `stamp` (ns), in their order, if this is the last of them."""
        if len(self.waiting) > MAX_WAITING:
            del self.waiting[next(iter(self.waiting))]
        parts = self.waiting.setdefault(stamp, {})
        parts[name] = values
        if len(parts) < len(self._names):
            return None
        del self.waiting[stamp]
        return [parts[each] for each in self._names]


class TopicRows:
    """Converter of messages of the topics with the absolute `names` to rows of a store.

    =================  ==================================================================================================
    table              columns
    =================  ==================================================================================================
    ``displacement``   tip, x and z of ``base_link``
    ``position``       the same
    ``acceleration``   the same
    ``force``          specific force at the tip, x and z of the IMU: measured, predicted, expected deviation of the two
    ``joints``         residual of every joint, then the same over its expected deviation; likewise a table of every further
                       stream of sensors, by the stream's name
    ``uncertainty``    standard deviation of the predicted tip, x and z of ``base_link``
    ``estimate``       see `ESTIMATE_COLUMNS`; the displacement is that of the estimated tip; no row before anything is measured
    ``shape``          x, z of the deflected line and of the undeflected one, four of every cylinder's pins, forces, strokes
    =================  ==================================================================================================
    """

    def __init__(self, store: Store, topics: Topics) -> None:
        self._store, self._decoder = store, SampleDecoder(1, topics)
        store.driven_by = topics.stroke_reading.stream
        self.dropped = DroppedMessages()
        self._specific_forces, self._estimates = PartsOfRows((COMPARED, Output.RESIDUALS)), PartsOfRows(JOINED)
        self._forces: list[float] = []
        self._strokes: list[float] = []
        self.scene, self._now = "", 0.0  # name of the node's scene, empty until it is known
        outputs: dict[Output, Callable[[Any], None]] = {
            **{role: partial(self._take_vector, role) for role in VECTORS},
            Output.JOINT_STATES: self._take_cylinders,
            Output.RESIDUALS: self._take_residuals,
            Output.SHAPE: self._take_shape,
            Output.HEALTH: self._take_health,
            Output.DIAGNOSTICS: self._take_state,
        }
        taken = [(topics.outputs[role], take) for role, take in outputs.items()]
        taken += [(topics.inputs[COMPARED], self._take_measured), (topics.events, self._take_event)]
        self._takers = {topic.absolute: take for topic, take in taken}
        self._types = {topic.absolute: topic.type for topic, _ in taken}
        self.names = frozenset(self._takers)

    def take(self, topic: str, message: Any, now: float) -> None:
        """Take a message of a topic (absolute name) that came at `now` (s, as lamps count); a malformed one is dropped."""
        self._now = now
        with self.dropped.guard(topic):
            self._takers[topic](message)

    def take_encoded(self, topic: str, data: bytes, now: float) -> None:
        """Take a CDR-encoded message of a topic, as `take` does."""
        max_bytes = 1_000_000  # bytes of an encoded message; a longer one is not decoded
        self._now = now
        with self.dropped.guard(topic):
            check_count("bytes", len(data), max_bytes)
            self._takers[topic](decode(data, self._types[topic]))

    def measure(self, sample: Sample) -> None:
        """Join a measured specific force with its residual, in any order of arrival; ignore samples of other streams."""
        if sample.stream is COMPARED:
            self._join_force(COMPARED, sample.stamp, sample.values.tolist())

    def _append(self, table: str, columns: Sequence[str], stamp: int, values: Sequence[float]) -> None:
        generation = self._store.generation
        self._store.receive(table, columns, stamp, values)
        if self._store.generation != generation:  # time was set back
            self._specific_forces.waiting.clear()
            self._estimates.waiting.clear()

    def _take_measured(self, msg: Any) -> None:
        before = self._decoder.oddities.copy()
        sample = self._decoder.sample_of(COMPARED, stamp_of(msg), msg)
        odd = self._decoder.oddities - before
        if sample is not None:
            self.measure(sample)
        elif NO_MEASUREMENT not in odd:
            raise MalformedError(", ".join(odd))

    def _take_vector(self, role: Output, msg: Any) -> None:
        vector, stamp = VECTORS[role], check_stamp(stamp_of(msg))
        point = vector.get(msg)
        values = check_numbers((point.x, point.z))
        if vector.covariance is not None:
            values += _deviations(vector.covariance(msg))
        if vector.table:
            self._append(vector.table, vector.columns, stamp, values)
        if role in JOINED:
            self._join_estimate(role, stamp, values)

    def _join_estimate(self, role: Output, stamp: int, values: list[float]) -> None:
        if (parts := self._estimates.put(role, stamp, values)) is None:
            return
        displacement, position, pose, acceleration, load = parts
        if any(load):  # exactly zero before anything is measured
            shown = [d + e - p for d, e, p in zip(displacement, pose, position, strict=False)]
            self._append(ESTIMATE, ESTIMATE_COLUMNS, stamp, [*shown, *pose[2:], *acceleration, *load])

    def _take_event(self, msg: Any) -> None:
        time = self._store.time(check_stamp(stamp_of(SimpleNamespace(header=msg))))
        self._store.alarms.add("event", Severity.OK, text(msg.msg), time, time)

    def _take_cylinders(self, msg: Any) -> None:
        check_arrays(msg, "position", "effort")
        places = [place for place, name in enumerate(msg.name) if stream_of(name) is Stream.STROKES]
        strokes = check_numbers([msg.position[place] for place in places])
        self._strokes, self._forces = strokes, check_numbers([msg.effort[place] for place in places])

    def _take_residuals(self, msg: Any) -> None:
        check_arrays(msg, "position", "velocity", "effort")
        stamp, stream = check_stamp(stamp_of(msg)), check_residuals(msg.name)
        values, ratios, sigmas = (check_numbers(each, may_lack=True) for each in (msg.position, msg.velocity, msg.effort))
        if stream is COMPARED:
            self._join_force(Output.RESIDUALS, stamp, values + sigmas)
        else:
            ends = (SENSORS[stream].unit_suffix, "normalised")
            self._append(RESIDUALS[stream], [f"{name}_{end}" for end in ends for name in msg.name], stamp, values + ratios)

    def _join_force(self, part: Hashable, stamp: int, values: list[float]) -> None:
        if (parts := self._specific_forces.put(part, stamp, values)) is not None:
            (x, z), (left_x, left_z, *sigmas) = parts
            self._append("force", FORCE_COLUMNS, stamp, [x, z, x - left_x, z - left_z, *sigmas])

    def _take_shape(self, msg: Any) -> None:
        max_columns = 1000  # numbers of one row; a boom of nine sections has some two hundred
        check_count("markers", len(msg.markers), MAX_MARKERS)
        lines = {(marker.ns, marker.id): marker.points for marker in msg.markers}
        boom, straight = lines.get(("boom", 0)), lines.get(("boom_undeflected", 0))
        pins = [point for (kind, _), ends in lines.items() if kind == "cylinders" for point in ends]
        if boom is None or straight is None or not len(boom) == len(straight) > 1:
            raise MalformedError("no lines of the boom, deflected and not, of as many points each")
        if not self._forces:  # they come by a topic of their own
            return
        if len(pins) != 2 * len(self._forces):
            raise MalformedError(f"{len(pins)} ends of cylinders, but {len(self._forces)} forces of cylinders")
        names = [("line", len(boom)), ("straight", len(straight)), ("pins", len(pins))]
        columns = [f"{name}_{i}_{axis}_m" for name, count in names for i in range(count) for axis in "xz"]
        columns += [f"force_{i + 1}_N" for i in range(len(self._forces))]
        columns += [f"stroke_{i + 1}_m" for i in range(len(self._strokes))]
        check_count("numbers of a shape", len(columns), max_columns)
        values = check_numbers([number for point in (*boom, *straight, *pins) for number in (point.x, point.z)])
        self._append("shape", columns, check_stamp(stamp_of(msg.markers[0])), values + self._forces + self._strokes)

    def _take_health(self, msg: Any) -> None:
        check_count("alarms", len(msg.status), MAX_STATUSES)
        store, found = self._store, decode_health(msg)
        for alarm in found:
            check_count("causes of an alarm", len(alarm.ranked), MAX_CAUSES)
            check_stamp(alarm.since)
            check_stamp(alarm.since if alarm.until is None else alarm.until)
        store.alarms.judge(store.time(check_stamp(stamp_of(msg))), found, store.time)

    def _take_state(self, msg: Any) -> None:
        check_count("statuses", len(msg.status), MAX_STATUSES)
        store = self._store
        statuses = store.statuses(self._now).updated(self._now, msg.status, stamp_of(msg) * NANO)
        check_count("nodes on one topic", len(statuses.nodes), MAX_NODES)
        for status in msg.status:
            if str(status.name).endswith(": model"):
                self.scene = next((pair.value for pair in status.values if pair.key == "scene"), self.scene)
        store.set_statuses(self._now, statuses)


def _deviations(covariance: Any) -> list[float]:
    """Return the standard deviations of x and z from a covariance by rows (36,)."""
    variances = check_numbers((covariance[0], covariance[14]))
    if min(variances) < 0.0:
        raise MalformedError(f"a variance is {min(variances):g}; at least 0 is possible")
    return [sqrt(variance) for variance in variances]
