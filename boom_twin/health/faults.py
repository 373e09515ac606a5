"""Faults of a boom, hypotheses (booms with faults), their twins, and the figures that an alarm states about a fault."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..deviation.kalman import ANGLE_ZERO
from ..deviation.sensor_errors import LAG_FLOOR
from ..deviation.states import Innovations
from ..errors import BoomTwinError
from ..scene.edit import loaded, parameter, parameter_names, with_parameters
from ..scene.schema import Scene
from ..scene.summary import explain
from ..types import SECOND, Alarm, Array, Change, Stream, StrokeReading, channels_of, sensor_kind
from .alarms import change_text
from .sensor_check import Flags

LOSS, OIL_LOSS, LOAD = 0.25, 0.1, 0.02  # relative loss of a k or EI, of k of all cylinders; load over the boom's mass
LATE = 0.02  # s, delay of the stamps of a stream
IMPOSSIBLE = -1e9  # log likelihood of a boom whose twin fails
QUIET = 0.1  # unknown force that the filter of a boom under less load expects, over the set one


class Fault(NamedTuple):
    """Fault of a boom.

    cause : parameter of the scene, sensor, or delay of a stream. kind : ``softer``, ``more``, ``less``, ``off``, ``late``,
    ``ended`` of a named one, ``heavier`` of a section, or ``quieter``: less unknown force at the tip than the filter expects.
    size : relative loss, kg, kg/m, s, relative mass; or the change of a sensor's zero, rad, m/s^2 or N. The hypothesis ``off``
    lets the zero drift by any amount. is_told : False if the fault raises no alarm and only competes with the others.
    """

    cause: str
    kind: str
    size: float = 0.0
    is_told: bool = True

    @property
    def is_size(self) -> bool:
        """True if the fault is a change of a parameter of the boom."""
        return self.kind not in ("off", "late", "ended")

    @property
    def unit(self) -> str:
        """Unit of the size; empty for a relative size."""
        if self.kind in ("softer", "heavier", "quieter"):
            return ""
        if self.channel == "tip":
            return "kg" if self.cause == "tip.payload" else "kg/m"
        return "s" if self.kind == "late" else sensor_kind(self.channel.replace("tip_imu", "tip_imu_x")).unit

    def signed(self) -> Fault:
        """Return the fault with a size above 0: a negative load is ``less``."""
        return self._replace(kind="less", size=-self.size) if self.kind == "more" and self.size < 0.0 else self

    def changed_by(self, change: Fault) -> Fault:
        """Return the fault of both this one and a change of its size."""
        if self.kind == "softer":
            return self._replace(size=1.0 - (1.0 - self.size) * (1.0 - change.size))
        return self._replace(kind="more", size=change.size + (self.size if self.kind == "more" else -self.size)).signed()

    @property
    def channel(self) -> str:
        """Channel of its alarm."""
        return "tip" if self.kind in ("more", "less") else self.cause.partition(".")[0]


class Hypothesis(NamedTuple):
    """Boom with faults.

    scene : scene with changed parameters. payload, line_fill : additional load, kg and kg/m. doubted : channels whose zeros may
    drift by any amount. delays : delay of the stamps of each late stream, s. expects : unknown force that its filter expects,
    relative to `Settings.expected_load`.
    """

    scene: Scene
    payload: float = 0.0
    line_fill: float = 0.0
    doubted: frozenset[str] = frozenset()
    delays: tuple[tuple[Stream, float], ...] = ()
    expects: float = 1.0

    def load(self, payload: float, line_fill: float) -> dict[str, float]:
        """Return the load of this boom from a set load (kg, kg/m; below 0: that of the scene)."""
        told = loaded(self.scene, payload, line_fill)
        return {
            "payload": max(parameter(told, "tip.payload") + self.payload, 0.0),
            "line_fill": max(parameter(told, "line_fill") + self.line_fill, 0.0),
        }

    def changed(self, change: Change) -> Change:
        """Return a change with the load of this boom."""
        load = self.load(change.settings["payload"], change.settings["line_fill"])
        return replace(change, settings=change.settings | load)

    def in_time(self, block: Any) -> Any:
        """Return a block with stamps corrected by the delays, in the order of time."""
        if not self.delays:
            return block
        stamps = block.stamps.copy()
        for stream, delay in self.delays:
            stamps -= round(delay * SECOND) * (block.streams == list(Stream).index(stream))
        order = np.argsort(stamps, kind="stable")
        return block._replace(streams=block.streams[order], stamps=stamps[order], values=block.values[order])


class Follower(Protocol):
    """Interface of a twin as far as fault twins need it; see `boom_twin.Twin`."""

    @property
    def evidence(self) -> float:
        """Log likelihood of all readings."""

    @property
    def doubts(self) -> int:
        """Number of times that the estimate was doubted, because its tip was far off the predicted one."""

    @property
    def requests(self) -> Any:
        """Requested changes that wait for the next stroke sample."""

    def take(self, block: Any, /) -> object:
        """Take the samples of a block."""

    def take_innovations(self) -> Innovations:
        """Return the innovations since the last call."""

    def zeros(self, channels: Collection[str], /) -> tuple[Array, Array, Array]:
        """Return the estimated zeros of sensors, their variances, and deviations by errors of the scene."""

    def leave_out(self, masked: Flags, strokes: Flags, /) -> None:
        """Leave out measured channels, and strokes."""


def hypothesis(scene: Scene, faults: Sequence[Fault]) -> Hypothesis:
    """Return the boom of a scene with these faults."""
    extra, doubted, delays = {"tip.payload": 0.0, "line_fill": 0.0}, set[str](), list[tuple[Stream, float]]()
    expects = 1.0
    for cause, kind, size, _ in faults:
        if kind == "softer":
            parts = [name for name in parameter_names(scene) if name.endswith(".k")] if cause == "oil.k" else [cause]
            scene = with_parameters(scene, {name: (1.0 - size) * parameter(scene, name) for name in parts})
        elif kind == "heavier":
            scene = with_parameters(scene, {cause: (1.0 + size) * parameter(scene, cause)})
        elif kind == "quieter":
            expects = QUIET
        elif kind == "off":
            name, channels = cause.removesuffix(".sensor"), channels_of(len(scene.joints))
            doubted |= set(channels[Stream.IMU]) if name == "tip_imu" else {name}
        elif kind == "late":
            delays.append((Stream(cause.removesuffix(".delay")), size))
        else:
            extra[cause] += size if kind == "more" else -size
    return Hypothesis(scene, extra["tip.payload"], extra["line_fill"], frozenset(doubted), tuple(delays), expects)


class Second(NamedTuple):
    """Samples of a second that begins at `stamp` (ns), and the failing channels to leave out; or a change."""

    stamp: int
    block: Any = None
    left_out: tuple[Flags, Flags] | None = None
    change: Change | None = None


def feed(twin: Follower, each: Hypothesis, second: Second) -> None:
    """Let the twin of a hypothesis take a second."""
    if second.left_out is not None:
        twin.leave_out(*second.left_out)
    twin.take(each.in_time(second.block))


class TwinMaker:
    """Maker of twins of a boom with faults. It keeps the `memory` newest seconds of the boom as believed, for new twins.

    Attributes
    ----------
    recent : deque of Second
        Newest seconds.
    expects : float
        Unknown force that the filters expect, over the set one.
    """

    def __init__(self, scene: Scene, make: Callable[[Hypothesis], Follower], memory: int) -> None:
        self._scene, self._make = scene, make
        self.recent: deque[Second] = deque(maxlen=memory)
        self.expects = 1.0
        self._change: Change | None = None

    def restart(self, change: Change) -> None:
        """Discard the recent seconds; further twins begin with a change."""
        self.recent.clear()
        self._change = change

    def is_news(self, flags: tuple[Flags, Flags]) -> bool:
        """Return True if the flags have a failing sensor that no recent second leaves out."""
        before = [each.left_out for each in self.recent if each.left_out is not None]
        return bool(before) and any((now & ~np.any(then, axis=0)).any() for now, *then in zip(flags, *before, strict=True))

    def leave_out(self, flags: tuple[Flags, Flags]) -> None:
        """Leave out failing sensors in all recent seconds."""
        self.recent = deque((each._replace(left_out=flags) for each in self.recent), self.recent.maxlen)

    def forget(self, before: int) -> None:
        """Discard the recent seconds before a stamp (ns)."""
        self.recent = deque((each for each in self.recent if each.stamp >= before), self.recent.maxlen)

    def twin(self, faults: Sequence[Fault]) -> tuple[Hypothesis, Follower]:
        """Return the hypothesis of these faults, and its twin before any sample."""
        each = hypothesis(self._scene, faults)
        each = each._replace(expects=self.expects * each.expects)
        twin = self._make(each)
        if self._change is not None:
            twin.requests.repeat(each.changed(self._change))
        return each, twin

    def possible(self, faults: Sequence[Fault]) -> tuple[Hypothesis, Follower] | None:
        """Return what `twin` does, or None for an impossible boom, such as one with a part too soft to hold it."""
        try:
            return self.twin(faults)
        except BoomTwinError:
            return None

    def repeated(self, faults: Sequence[Fault]) -> Iterator[tuple[int, Follower]]:
        """Run a twin with these faults over the recent seconds; yield each stamp with the twin after that second."""
        each, twin = self.twin(faults)
        for second in self.recent:
            feed(twin, each, second)
            yield second.stamp, twin

    def course(self, faults: Sequence[Fault], count: int) -> Array:
        """Return the log likelihood of each of the `count` newest seconds; `IMPOSSIBLE` for an impossible boom."""
        totals = [0.0]
        try:
            totals += [twin.evidence for _, twin in self.repeated(faults)]
        except BoomTwinError:
            return np.full(min(count, len(self.recent)), IMPOSSIBLE)
        return np.nan_to_num(np.diff(totals)[-count:], nan=IMPOSSIBLE)


def possible_faults(scene: Scene, reads: StrokeReading, streams: Collection[Stream]) -> list[Fault]:
    """Return all single faults that are compared for a boom whose sensors send these streams.

    Warm oil, which softens all cylinders, heavier sections and a quiet tip raise no alarm. They are compared because they
    explain readings.
    """
    mass = explain(scene).mass
    found = [Fault(name, "softer", LOSS) for name in parameter_names(scene) if name.endswith((".k", ".EI", ".stiffness"))]
    found.append(Fault("oil.k", "softer", OIL_LOSS, False))
    found += [Fault(f"section_{i + 1}.mass", "heavier", LOSS, False) for i in range(len(scene.sections))]
    found.append(Fault("tip.load", "quieter", 1.0, False))
    found.append(Fault("tip.payload", "more", LOAD * mass))
    found.append(Fault("line_fill", "more", 2.0 * LOAD * mass / scene.reach))
    names = channels_of(len(scene.joints)) | {Stream.IMU: ("tip_imu",)}
    measured = [each for each in (Stream.ANGLES, Stream.IMU, Stream.FORCES) if each in streams]
    found += [Fault(f"{name}.sensor", "off") for each in measured if each is not reads.stream for name in names[each]]
    return [*found, *(Fault(f"{each.value}.delay", "late", LATE) for each in dict.fromkeys((reads.stream, *measured)))]


def usual_size(scene: Scene, fault: Fault, error: float) -> float:
    """Return the standard deviation of the apparent size of a fault in a healthy boom, with parameters wrong by `error`.

    Independent mass errors of n equal sections turn a straight boom of mass M like a payload of `error` M / sqrt(3 n).
    """
    if fault.kind in ("softer", "heavier"):
        return error
    if fault.kind == "quieter":
        return 1.0
    if fault.kind == "off":  # a part that is wrong turns a joint as its sensor's zero would
        return ANGLE_ZERO if fault.channel.startswith("joint_") else 0.0
    if fault.kind == "late":
        return LAG_FLOOR
    payload = error * explain(scene).mass / math.sqrt(3.0 * len(scene.sections))
    return payload if fault.cause == "tip.payload" else 2.0 * payload / scene.reach


def evidence_of(fault: Fault, spread: float) -> str:
    """Return size and standard deviation of a fault as figures."""
    size = -fault.size if fault.kind in ("softer", "less") else fault.size
    if fault.kind == "softer":
        return f"{fault.cause.rpartition('.')[2]} {100.0 * size:.0f} % (+- {100.0 * spread:.0f})"
    if fault.kind == "late":
        return change_text(1e3 * size, "ms", 1e3 * spread)
    return change_text(size, fault.unit, spread)


def explains(named: Alarm, stream: Stream, deviation: Alarm) -> bool:
    """Return True if a named fault explains a deviation: a load those of forces, a sensor that of its channel."""
    is_load = named.kind in ("more", "less") and stream is Stream.FORCES
    return is_load or (named.channel == deviation.channel and named.kind == "off")
