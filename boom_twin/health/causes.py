"""Fault hypotheses of a boom, and the decision which of them is named.

Every second gives each hypothesis a gain: its log likelihood less that of the boom as believed. The evidence of a hypothesis is
the sum of its gains since the best onset. A cause is named if its posterior probability is high. Three facts limit the gains.

- Successive innovations are not independent. So likelihoods are raised to the power `TEMPER`.
- An effect outside all hypotheses, such as a valve that opens under a load, may dominate a second. Its probability,
  exp(-`MOST_GAIN`), bounds the likelihood ratio of a second.
- A load from the start belongs to the scene. A new load must gain faster than before its onset.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..scene.edit import loaded, parameter, parameter_names, with_parameters
from ..scene.schema import Scene
from ..scene.summary import explain
from ..types import Alarm, Array, Stream, StrokeReading, channels_of
from .alarms import UNKNOWN

LOSS, OIL_LOSS, LOAD = 0.25, 0.1, 0.02  # relative loss of a k or EI, of k of all cylinders; load over the boom's mass
LATE = 0.02  # s, delay of the angles
HEAD_START = 30.0  # nats of the hypothesis without a fault; parameters with 2 % of error gain as much
TEMPER = math.log(20.0) / 25.0  # power of likelihoods: 25 nats more make a cause 20 times as probable
MOST_GAIN = 12.0  # nats, limit of the gain of a second
FASTER = 1.5  # ratio of gain rates after and before the onset, which a load must exceed
KNOWN_LOAD = 10  # s at the beginning of the gains kept, without onset of a load: it could be the scene's
MEMORY = 60  # s of gains that are kept


class Fault(NamedTuple):
    """Fault of a boom.

    cause : parameter of the scene, sensor, or delay of a stream. kind : ``softer``, ``more``, ``less``, ``off`` or
    ``late``. size : relative loss, kg, kg/m, s; or the change of a sensor's zero, rad, m/s^2 or N. The hypothesis ``off``
    lets the zero drift by any amount. is_told : False if it gives no alarm, and only keeps others from being named for it.
    """

    cause: str
    kind: str
    size: float = 0.0
    is_told: bool = True

    @property
    def is_load(self) -> bool:
        """Return True for a fault of the load."""
        return self.kind in ("more", "less")

    @property
    def channel(self) -> str:
        """Channel of its alarm."""
        return "tip" if self.is_load else self.cause.partition(".")[0]


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
            parts = _springs(scene) if cause == "oil.k" else [cause]
            scene = with_parameters(scene, {name: (1.0 - size) * parameter(scene, name) for name in parts})
        elif kind == "off":
            name, channels = cause.removesuffix(".sensor"), channels_of(len(scene.joints))
            doubted |= set(channels[Stream.IMU]) if name == "tip_imu" else {name}
        elif kind == "late":
            delays.append((Stream(cause.removesuffix(".delay")), size))
        else:
            extra[cause] += size if kind == "more" else -size
    return Hypothesis(scene, extra["tip.payload"], extra["line_fill"], frozenset(doubted), tuple(delays))


def _springs(scene: Scene) -> list[str]:
    return [name for name in parameter_names(scene) if name.endswith(".k")]


def possible_faults(scene: Scene, reads: StrokeReading = StrokeReading.LENGTH) -> list[Fault]:
    """Return all single faults that are compared for a boom, without zeros and delay of angles that drive the model.

    Three give no alarm. Warm oil softens all cylinders. The outermost section bends mostly in modes that the filter leaves out.
    The zero of the IMU looks like model errors in fast moves.
    """
    mass, sections = explain(scene).mass, [name for name in parameter_names(scene) if name.endswith(".EI")]
    base = [name for name in parameter_names(scene) if name == "base.stiffness"]
    found = [Fault(name, "softer", LOSS, name not in sections[-1:]) for name in [*_springs(scene), *sections, *base]]
    found.append(Fault("oil.k", "softer", OIL_LOSS, False))
    for cause, size in (("tip.payload", LOAD * mass), ("line_fill", LOAD * mass / scene.reach)):
        found.append(Fault(cause, "more", size))
        if parameter(scene, cause) > 0.0:
            found.append(Fault(cause, "less", size))
    names_of = channels_of(len(scene.joints))
    angles = () if reads is StrokeReading.ANGLE else names_of[Stream.ANGLES]
    found += [
        Fault(f"{name}.sensor", "off", is_told=name != "tip_imu") for name in (*angles, "tip_imu", *names_of[Stream.FORCES])
    ]
    return [*found, Fault(f"{Stream.ANGLES.value}.delay", "late", LATE)] if angles else found


class Verdict(NamedTuple):
    """Named fault.

    place : index among the faults compared. onset : stamp (ns) of the first second of its evidence. ranked : the three
    most probable causes with their posterior probabilities, then `UNKNOWN` with the rest.
    """

    place: int
    onset: int
    ranked: tuple[tuple[str, float], ...]


class Evidence:
    """Evidence of faults, updated every second.

    Parameters
    ----------
    faults : sequence of Fault
    odds : float
        Posterior probability required to name a cause.
    """

    def __init__(self, faults: Sequence[Fault], odds: float) -> None:
        self._odds = odds
        self._faults, none = tuple(faults), np.zeros(len(faults))
        self._comes = np.array([fault.is_load for fault in faults], bool)
        self._gains, self._stamps = deque([none], maxlen=MEMORY), deque([0], maxlen=MEMORY)

    def take(self, stamp: int, gains: Array) -> Verdict | None:
        """Take the gains of a second that begins at a stamp (ns); return the verdict if a fault is named.

        Parameters
        ----------
        gains : ndarray, shape (faults,)
            nats.
        """
        self._gains.append(self._gains[-1] + np.clip(gains, -MOST_GAIN, MOST_GAIN))
        self._stamps.append(stamp)
        evidence, onsets = self._rises()
        causes = {"": HEAD_START}
        for fault, rise in zip(self._faults, evidence.tolist(), strict=True):
            causes[fault.cause] = max(causes.get(fault.cause, 0.0), rise)
        weights = np.exp(TEMPER * (np.array(list(causes.values())) - max(causes.values())))
        chances = dict(zip(causes, (weights / weights.sum()).tolist(), strict=True))
        best = int(np.argmax(evidence))
        if chances[self._faults[best].cause] < self._odds:
            return None
        ranked = sorted(((cause, chance) for cause, chance in chances.items() if cause), key=lambda each: -each[1])
        shown = ranked[:3]
        shown.append((UNKNOWN, max(0.0, 1.0 - sum(chance for _, chance in shown))))
        return Verdict(best, self._stamps[min(onsets[best] + 1, len(self._stamps) - 1)], tuple(shown))

    def _rises(self) -> tuple[Array, list[int]]:
        """Return the evidence of each fault since its best onset, and the index of that onset among the seconds kept."""
        gains, seconds = np.array(self._gains), np.arange(len(self._gains))[:, None]
        before = (gains - np.minimum.accumulate(gains, axis=0)) / np.maximum(seconds, 1)  # nats per s
        rises = gains[-1] - gains - np.where(self._comes, FASTER * before, 0.0) * (len(gains) - 1 - seconds)
        rises[self._comes & (seconds < KNOWN_LOAD)] = 0.0
        latest = len(gains) - 1 - rises[::-1].argmax(axis=0)
        return np.maximum(rises.max(axis=0), 0.0), latest.tolist()


def evidence_of(fault: Fault, spread: float) -> str:
    """Return size and standard deviation of a fault as text."""
    size = fault.size
    if fault.kind == "softer":
        k = fault.cause.rpartition(".")[2]
        low, high = max(size - 2.0 * spread, 0.0), size + 2.0 * spread
        return f"{k} {100.0 * size:.0f} % lower ({100.0 * low:.0f} to {100.0 * high:.0f})"
    if fault.is_load:
        unit = "kg" if fault.cause == "tip.payload" else "kg/m"
        return f"by {size:.2g} {unit} (+- {max(spread, 0.1):.1g})"
    if fault.kind == "late":
        return f"by {1e3 * size:.0f} ms (+- {max(1e3 * spread, 1.0):.0f})"
    if fault.channel.startswith("cylinder_force"):
        return f"by {size:+.0f} N (+- {spread:.0f})"
    return f"by {math.degrees(size):+.2f} deg (+- {math.degrees(spread):.2f})"


def explains(named: Alarm, stream: Stream, deviation: Alarm) -> bool:
    """Return True if a named fault explains a deviation: a load those of forces, a sensor that of its channel."""
    is_load = named.kind in ("more", "less") and stream is Stream.FORCES
    return is_load or (named.channel == deviation.channel and named.kind == "off")
