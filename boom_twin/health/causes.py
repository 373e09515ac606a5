"""Fault hypotheses of a boom, and the decision which of them is named.

Every second gives each hypothesis a gain: its log likelihood less that of the boom as believed. The evidence of a hypothesis is
the largest sum of its gains up to now, over all possible onsets.
A cause is named if its posterior probability is high. Three facts limit that.

- Successive innovations are not independent. So likelihoods are raised to the power `TEMPER`.
- An effect outside all hypotheses, such as a valve that opens under a load, may dominate a second. In each second no log
  likelihood counts as more than `MOST_GAIN` below the best.
- Parameters of a healthy boom are wrong by `Settings.scene_error`. So its likelihood is that of the boom as believed, and
  what these errors are expected to cost that. Each fault then seems to have a size. So a name needs a size surely above zero
  by these errors and by its scatter, for all faults together (bound of Bonferroni).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..config.settings import Settings
from ..deviation.kalman import ANGLE_ZERO
from ..deviation.predictor import LAG_FLOOR
from ..scene.edit import loaded, parameter, parameter_names, with_parameters
from ..scene.schema import Scene
from ..scene.summary import explain
from ..types import Alarm, Array, Stream, StrokeReading, channels_of, sensor_kind
from .alarms import UNKNOWN, change_text

LOSS, OIL_LOSS, LOAD = 0.25, 0.1, 0.02  # relative loss of a k or EI, of k of all cylinders; load over the boom's mass
LATE = 0.02  # s, delay of the stamps of a stream
TEMPER = math.log(20.0) / 25.0  # power of likelihoods: 25 nats more make a cause 20 times as probable
MOST_GAIN = 12.0  # nats by which the likelihood of a second is below the best, at most
MEMORY = 60  # s of gains that are kept


class Fault(NamedTuple):
    """Fault of a boom.

    cause : parameter of the scene, sensor, or delay of a stream. kind : ``softer``, ``more``, ``less``, ``off`` or
    ``late``. size : relative loss, kg, kg/m, s; or the change of a sensor's zero, rad, m/s^2 or N. The hypothesis ``off``
    lets the zero drift by any amount. is_told : False without an alarm: it competes for its effect alone.
    """

    cause: str
    kind: str
    size: float = 0.0
    is_told: bool = True

    @property
    def channel(self) -> str:
        """Channel of its alarm."""
        return "tip" if self.kind in ("more", "less") else self.cause.partition(".")[0]


class Hypothesis(NamedTuple):
    """Boom with faults.

    scene : with its parameters changed. payload, line_fill : additional load, kg and kg/m. doubted : channels whose zeros may
    drift by any amount. delays : delay of the stamps of a stream, s.
    """

    scene: Scene
    payload: float = 0.0
    line_fill: float = 0.0
    doubted: frozenset[str] = frozenset()
    delays: tuple[tuple[Stream, float], ...] = ()

    def load(self, payload: float, line_fill: float) -> dict[str, float]:
        """Return the load of this boom from a set load (kg, kg/m; below 0: that of the scene)."""
        told = loaded(self.scene, payload, line_fill)
        return {
            "payload": max(parameter(told, "tip.payload") + self.payload, 0.0),
            "line_fill": max(parameter(told, "line_fill") + self.line_fill, 0.0),
        }


def hypothesis(scene: Scene, faults: Sequence[Fault]) -> Hypothesis:
    """Return the boom of a scene with these faults."""
    extra, doubted, delays = {"tip.payload": 0.0, "line_fill": 0.0}, set[str](), list[tuple[Stream, float]]()
    for cause, kind, size, _ in faults:
        if kind == "softer":
            parts = [name for name in parameter_names(scene) if name.endswith(".k")] if cause == "oil.k" else [cause]
            scene = with_parameters(scene, {name: (1.0 - size) * parameter(scene, name) for name in parts})
        elif kind == "off":
            name, channels = cause.removesuffix(".sensor"), channels_of(len(scene.joints))
            doubted |= set(channels[Stream.IMU]) if name == "tip_imu" else {name}
        elif kind == "late":
            delays.append((Stream(cause.removesuffix(".delay")), size))
        else:
            extra[cause] += size if kind == "more" else -size
    return Hypothesis(scene, extra["tip.payload"], extra["line_fill"], frozenset(doubted), tuple(delays))


def possible_faults(scene: Scene, reads: StrokeReading = StrokeReading.LENGTH) -> list[Fault]:
    """Return all single faults that are compared for a boom; warm oil softens all cylinders and is no fault."""
    mass = explain(scene).mass
    found = [Fault(name, "softer", LOSS) for name in parameter_names(scene) if name.endswith((".k", ".EI", ".stiffness"))]
    found.append(Fault("oil.k", "softer", OIL_LOSS, False))
    for cause, size in (("tip.payload", LOAD * mass), ("line_fill", 2.0 * LOAD * mass / scene.reach)):
        found.append(Fault(cause, "more", size))
        if parameter(scene, cause) > 0.0:
            found.append(Fault(cause, "less", size))
    names_of = channels_of(len(scene.joints))
    angles = () if reads is StrokeReading.ANGLE else names_of[Stream.ANGLES]
    found += [Fault(f"{name}.sensor", "off") for name in (*angles, "tip_imu", *names_of[Stream.FORCES])]
    streams = dict.fromkeys((reads.stream, Stream.ANGLES, Stream.IMU, Stream.FORCES))
    return [*found, *(Fault(f"{stream.value}.delay", "late", LATE) for stream in streams)]


def usual_size(scene: Scene, fault: Fault, error: float) -> float:
    """Return the standard deviation of what looks like a fault in a healthy boom whose parameters are wrong by `error`.

    Independent mass errors of n equal sections turn a straight boom of mass M like a payload of `error` M / sqrt(3 n).
    """
    if fault.kind == "softer":
        return error
    if fault.kind == "off":  # a part that is wrong turns a joint as its sensor's zero would
        return ANGLE_ZERO if fault.channel.startswith("joint_") else 0.0
    if fault.kind == "late":
        return LAG_FLOOR
    payload = error * explain(scene).mass / math.sqrt(3.0 * len(scene.sections))
    return payload if fault.cause == "tip.payload" else 2.0 * payload / scene.reach


class Verdict(NamedTuple):
    """Named fault.

    place : index among the faults compared. rivals : of the other causes that are ranked and have a size; none of a sensor.
    onset : stamp (ns) of the first second of its evidence. ranked : the three most probable causes with their posterior
    probabilities, then `UNKNOWN` with the rest.
    """

    place: int
    rivals: tuple[int, ...]
    onset: int
    ranked: tuple[tuple[str, float], ...]


class Evidence:
    """Evidence of faults, updated every second.

    Parameters
    ----------
    scene : Scene
    faults : sequence of Fault
    settings : Settings
        With the posterior probability required to name a cause, and the errors of the scene.
    """

    def __init__(self, scene: Scene, faults: Sequence[Fault], settings: Settings) -> None:
        self._odds, self._faults, none = settings.name_odds, tuple(faults), np.zeros(len(faults))
        self._wrong = none.copy()  # share of a fault's cost that its usual size has: costs are as squares of sizes
        for i, fault in enumerate(faults):
            if (fault.kind == "softer" and fault.is_told) or fault.cause == "tip.payload":  # the others repeat these
                self._wrong[i] = (usual_size(scene, fault, settings.scene_error) / fault.size) ** 2
                self._wrong[i] /= [x.cause for x in faults].count(fault.cause)
        self._gains, self._stamps = deque([none], maxlen=MEMORY), deque([0], maxlen=MEMORY)

    def take(self, stamp: int, likelihoods: Array) -> Verdict | None:
        """Take the log likelihoods of a second that begins at a stamp (ns); return the verdict if a fault is named.

        `likelihoods` (1 + faults,) in nats: the boom as believed first.
        """
        believed = likelihoods[0] + self._wrong @ np.maximum(likelihoods[0] - likelihoods[1:], 0.0)
        likelihoods = np.array([believed, *likelihoods[1:]])
        bounded = np.maximum(likelihoods, likelihoods.max() - MOST_GAIN)
        self._gains.append(self._gains[-1] + bounded[1:] - bounded[0])
        self._stamps.append(stamp)
        gains = np.array(self._gains)
        rises = gains[-1] - gains
        evidence, onsets = rises.max(axis=0), len(rises) - 1 - rises[::-1].argmax(axis=0)
        causes = {"": 0.0}  # the healthy boom and each cause are equally probable before
        for fault, rise in zip(self._faults, evidence.tolist(), strict=True):
            causes[fault.cause] = max(causes.get(fault.cause, 0.0), rise)
        weights = np.exp(TEMPER * (np.array(list(causes.values())) - max(causes.values())))
        chances = dict(zip(causes, (weights / weights.sum()).tolist(), strict=True))
        best = int(np.argmax(evidence))
        if chances[self._faults[best].cause] < self._odds:
            return None
        shown = sorted(((cause, chance) for cause, chance in chances.items() if cause), key=lambda each: -each[1])[:3]
        shown.append((UNKNOWN, max(0.0, 1.0 - sum(chance for _, chance in shown))))
        others = {cause for cause, _ in shown if self._faults[best].kind != "off"} - {self._faults[best].cause}
        sized = [i for i, fault in enumerate(self._faults) if fault.cause in others and fault.is_told and fault.kind != "off"]
        rivals = tuple(i for i in sized if evidence[i] > 0.0)
        return Verdict(best, rivals, self._stamps[min(int(onsets[best]) + 1, len(self._stamps) - 1)], tuple(shown))

    def discard(self, place: int) -> None:
        """Discard the evidence of one fault up to now, because its size is none that is named; others keep theirs."""
        for gains in self._gains:
            gains[place] = self._gains[-1][place]


def evidence_of(fault: Fault, spread: float) -> str:
    """Return size and standard deviation of a fault as figures."""
    size = -fault.size if fault.kind in ("softer", "less") else fault.size
    if fault.kind == "softer":
        return f"{fault.cause.rpartition('.')[2]} {100.0 * size:.0f} % (+- {100.0 * spread:.0f})"
    if fault.channel == "tip":
        return change_text(size, "kg" if fault.cause == "tip.payload" else "kg/m", spread)
    if fault.kind == "late":
        return change_text(1e3 * size, "ms", 1e3 * spread)
    return change_text(size, sensor_kind(fault.channel.replace("tip_imu", "tip_imu_x")).unit, spread)


def explains(named: Alarm, stream: Stream, deviation: Alarm) -> bool:
    """Return True if a named fault explains a deviation: a load those of forces, a sensor that of its channel."""
    is_load = named.kind in ("more", "less") and stream is Stream.FORCES
    return is_load or (named.channel == deviation.channel and named.kind == "off")
