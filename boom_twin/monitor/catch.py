"""From messages of the twin's topics to rows of the tables, for live topics and recorded ones alike."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from ..io.health import decode_health
from ..io.intake import Intake, stamp_of
from ..io.topics import Output, Topics
from ..records import Sample, Stream
from .lamps import Board, Level
from .store import Store

Taker = Callable[[Any, float], None]

JUMP_BACK = 1.0
"""A stamp earlier by more than this (s) begins everything anew."""
WAITING = 1000
"""Measured samples, and residuals, that may wait for each other."""
GAP = 0.1
"""A longer pause between strokes (s) is told as an alarm."""
PLANE = ("x_m", "z_m")
ACCELERATION = ("x_m_s2", "z_m_s2")


class Catch:
    """Puts messages into a store.

    =================  ==================================================================================================
    table              columns
    =================  ==================================================================================================
    ``displacement``   tip, x and z of ``base_link``
    ``position``       the same
    ``acceleration``   the same
    ``force``          specific force at the tip, x and z of the IMU: measured, predicted, expected deviation of the two
    ``joints``         residual of every joint, then the same over its expected deviation
    ``uncertainty``    standard deviation of the predicted tip, x and z of ``base_link``
    ``shape``          x, z of the deflected line and of the undeflected one, four of every cylinder's pins, forces, strokes
    =================  ==================================================================================================

    Attributes
    ----------
    takers : dict of str to callable
        By the absolute name of the topic: takes a message, and the time (s) of its arrival that lamps count by.
    """

    def __init__(self, store: Store, topics: Topics) -> None:
        self._store, self._intake = store, Intake(1, topics)
        self._measured: OrderedDict[int, tuple[float, float]] = OrderedDict()
        self._residuals: OrderedDict[int, tuple[list[float], list[float]]] = OrderedDict()
        self._forces: list[float] = []
        self._strokes: list[float] = []
        self._scene = ""
        self.takers = self._takers(topics)

    @property
    def scene(self) -> str:
        """What the node calls its scene: a path, or the name of the package's own; empty if not known yet."""
        return self._scene

    def _takers(self, topics: Topics) -> dict[str, Taker]:
        by_role: dict[Output, Taker] = {
            Output.TIP_DISPLACEMENT: self._take_displacement,
            Output.TIP_POSITION: self._take_position,
            Output.TIP_ACCELERATION: self._take_acceleration,
            Output.JOINT_STATES: self._take_cylinders,
            Output.RESIDUALS: self._take_residuals,
            Output.SHAPE: self._take_shape,
            Output.HEALTH: self._take_health,
            Output.TIP_UNCERTAINTY: self._take_uncertainty,
            Output.DIAGNOSTICS: self._take_state,
        }
        found = {topics.outputs[role].absolute: take for role, take in by_role.items()}
        return {**found, topics.inputs[Stream.IMU].absolute: self._take_measured, topics.events.absolute: self._take_event}

    def measure(self, sample: Sample) -> None:
        """Put the measured specific force beside its residual, whichever comes first."""
        self._measured[sample.stamp] = (float(sample.values[0]), float(sample.values[1]))
        self._join(sample.stamp)

    def _take_measured(self, msg: Any, now: float) -> None:
        sample = self._intake.put(Stream.IMU, stamp_of(msg), msg)
        if sample is not None:
            self.measure(sample)

    def _take_position(self, msg: Any, now: float) -> None:
        self._store.append("position", PLANE, stamp_of(msg), (msg.point.x, msg.point.z))

    def _take_acceleration(self, msg: Any, now: float) -> None:
        self._store.append("acceleration", ACCELERATION, stamp_of(msg), (msg.accel.linear.x, msg.accel.linear.z))

    def _take_event(self, msg: Any, now: float) -> None:
        time = self._store.time(int(msg.stamp.sec) * 1_000_000_000 + int(msg.stamp.nanosec))
        self._store.alarms.add("event", Level.OK, str(msg.msg), time, time)

    def _take_displacement(self, msg: Any, now: float) -> None:
        stamp, store = stamp_of(msg), self._store
        known = store.tables.get("displacement")
        if known is not None:
            time = (stamp - store.epoch) * 1e-9
            if time < known.newest - JUMP_BACK:
                store.clear()
                self._measured.clear()
                self._residuals.clear()
            elif time - known.newest > GAP:
                store.alarms.add("cylinder_strokes", Level.WARN, f"gap of {time - known.newest:.2f} s", known.newest, time)
        store.append("displacement", PLANE, stamp, (msg.vector.x, msg.vector.z))

    def _take_cylinders(self, msg: Any, now: float) -> None:
        places = [place for place, name in enumerate(msg.name) if name.startswith("cylinder_") and name[9:].isdigit()]
        self._strokes = [float(msg.position[place]) for place in places]
        self._forces = [float(msg.effort[place]) for place in places]

    def _take_residuals(self, msg: Any, now: float) -> None:
        stamp, values, sigmas = stamp_of(msg), list(msg.position), list(msg.effort)
        if msg.name and msg.name[0].startswith("joint_"):
            columns = [f"{name}_rad" for name in msg.name] + [f"{name}_normalised" for name in msg.name]
            self._store.append("joints", columns, stamp, values + list(msg.velocity))
        else:
            self._residuals[stamp] = (values, sigmas)
            self._join(stamp)

    def _join(self, stamp: int) -> None:
        """Make the row of a measurement and its residual, once both are there; forget what has waited long."""
        if stamp in self._measured and stamp in self._residuals:
            measured, (values, sigmas) = self._measured.pop(stamp), self._residuals.pop(stamp)
            predicted = [m - v for m, v in zip(measured, values, strict=True)]
            columns = [f"{kind}_{axis}_m_s2" for kind in ("measured", "predicted", "sigma") for axis in "xz"]
            self._store.append("force", columns, stamp, [*measured, *predicted, *sigmas])
        for waiting in (self._measured, self._residuals):
            if len(waiting) > WAITING:
                waiting.popitem(last=False)

    def _take_shape(self, msg: Any, now: float) -> None:
        lines = {(marker.ns, marker.id): marker.points for marker in msg.markers}
        boom, straight = lines.get(("boom", 0)), lines.get(("boom_undeflected", 0))
        if not self._forces or boom is None or straight is None:  # not the twin's own
            return
        pins = [point for (kind, _), ends in lines.items() if kind == "cylinders" for point in ends]
        values = [number for point in (*boom, *straight, *pins) for number in (point.x, point.z)]
        names = [("line", len(boom)), ("straight", len(straight)), ("pins", len(pins))]
        columns = [f"{name}_{i}_{axis}_m" for name, count in names for i in range(count) for axis in "xz"]
        columns += [f"force_{i + 1}_N" for i in range(len(self._forces))]
        columns += [f"stroke_{i + 1}_m" for i in range(len(self._strokes))]
        self._store.append("shape", columns, stamp_of(msg.markers[0]), values + self._forces + self._strokes)

    def _take_health(self, msg: Any, now: float) -> None:
        store = self._store
        store.alarms.judge(store.time(stamp_of(msg)), decode_health(msg), store.time)

    def _take_uncertainty(self, msg: Any, now: float) -> None:
        self._store.append("uncertainty", PLANE, stamp_of(msg), (msg.vector.x, msg.vector.z))

    def _take_state(self, msg: Any, now: float) -> None:
        store = self._store
        for status in msg.status:
            if str(status.name).endswith(": model"):
                self._scene = next((pair.value for pair in status.values if pair.key == "scene"), self._scene)
        board: Board = store.board(now).told(now, msg.status, stamp_of(msg) * 1e-9)
        store.light(now, board)
