"""Faults of a boom as hypotheses, and the decision which of them is named.

Every second has a gain of each hypothesis: the logarithm of its likelihood less that of the boom as it is believed to be. What
a hypothesis gains from the best onset on until now is its evidence. A cause is named if its posterior probability is high.
Three facts decide how much a gain counts.

- Innovations of one sample are not independent of those of the next: likelihoods are raised to the power `TEMPER`.
- What no hypothesis has, such as a valve that opens under a load, may rule a second: its likelihood ratio is bounded by the
  chance of that, exp(-`MOST_GAIN`).
- A load that the boom has had from the start is its scene's. Only what gains faster than before is a load that came.
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

LOSS, OIL_LOSS, LOAD = 0.25, 0.1, 0.02  # shares: of k or EI, of k of all cylinders, of the boom's mass
LATE = 0.02  # s
HEAD_START = 30.0  # nats of the hypothesis that nothing is wrong: parameters that are 2 % off gain as much
TEMPER = math.log(20.0) / 25.0  # power of likelihoods: 25 nats more make a cause 20 times as probable
MOST_GAIN = 12.0  # nats that a second may count for
FASTER = 1.5  # times as fast as before that a load has to gain
KNOWN_LOAD = 10  # s from a start, before which no load can be told from that of the scene
MEMORY = 60  # s of gains that are kept


class Fault(NamedTuple):
    """Fault of a boom.

    cause : parameter of the scene, a sensor, or the delay of a stream. kind : ``softer``, ``more``, ``less``, ``off`` or
    ``late``. size : share that is lost, kg, kg/m, s; or the change of a sensor's zero, rad, m/s^2 or N. The hypothesis of such
    a fault lets the zero drift by any amount. is_told : False if it is believed only so that no other is named for it.
    """

    cause: str
    kind: str
    size: float = 0.0
    is_told: bool = True

    @property
    def is_load(self) -> bool:
        """Return True if the boom carries more or less."""
        return self.kind in ("more", "less")

    @property
    def channel(self) -> str:
        """Channel of its alarm."""
        return "tip" if self.is_load else self.cause.partition(".")[0]


class Hypothesis(NamedTuple):
    """Boom with faults.

    scene : with them. payload, line_fill : how much more it carries, kg and kg/m. doubted : channels whose zeros may drift by
    any amount. delays : by which stamps of streams are late, s.
    """

    scene: Scene
    payload: float = 0.0
    line_fill: float = 0.0
    doubted: frozenset[str] = frozenset()
    delays: tuple[tuple[Stream, float], ...] = ()

    def load(self, payload: float, line_fill: float) -> dict[str, float]:
        """Return the load (kg, kg/m) of a twin where the load is said to be this; below 0 it is that of the scene."""
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
    """Return every single fault that is compared for a boom. Angles that drive the model have no zeros and no delay in it.

    Not told are warm oil, which softens all cylinders; the outermost section, which bends mostly in modes that the filter
    leaves out; and the zero of the IMU, for errors of the model in fast moves look like it.
    """
    mass, sections = explain(scene).mass, [name for name in parameter_names(scene) if name.endswith(".EI")]
    base = [name for name in parameter_names(scene) if name == "base.stiffness"]
    found = [Fault(name, "softer", LOSS, name != sections[-1]) for name in [*_springs(scene), *sections, *base]]
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

    place : of the fault among those compared. onset : stamp (ns) of the second from which on it gains. ranked : the
    three most probable causes with their posterior probabilities, then `UNKNOWN`; together one.
    """

    place: int
    onset: int
    ranked: tuple[tuple[str, float], ...]


class Evidence:
    """Evidence of faults, second by second.

    Parameters
    ----------
    faults : sequence of Fault
    odds : float
        Posterior probability from which on a cause is named.
    """

    def __init__(self, faults: Sequence[Fault], odds: float) -> None:
        self._odds = odds
        self._faults, none = tuple(faults), np.zeros(len(faults))
        self._comes = np.array([fault.is_load for fault in faults], bool)
        self._gains, self._stamps = deque([none], maxlen=MEMORY), deque([0], maxlen=MEMORY)

    def take(self, stamp: int, gains: Array) -> Verdict | None:
        """Take the gains of a second that begins at a stamp (ns); return the fault that is named by then, if any.

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
        """Return how much each fault has gained from its best onset on, and the place of that onset among the seconds kept."""
        gains, seconds = np.array(self._gains), np.arange(len(self._gains))[:, None]
        before = (gains - np.minimum.accumulate(gains, axis=0)) / np.maximum(seconds, 1)  # nats per s
        rises = gains[-1] - gains - np.where(self._comes, FASTER * before, 0.0) * (len(gains) - 1 - seconds)
        rises[self._comes & (seconds < KNOWN_LOAD)] = 0.0
        latest = len(gains) - 1 - rises[::-1].argmax(axis=0)
        return np.maximum(rises.max(axis=0), 0.0), latest.tolist()


def evidence_of(fault: Fault, spread: float) -> str:
    """Return size and standard deviation of a fault in figures."""
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
    """Return True if a named fault is what makes a channel of a stream deviate: a load for forces, the sensors of a joint."""
    is_load = named.kind in ("more", "less") and stream is Stream.FORCES
    return is_load or (named.channel == deviation.channel and named.kind == "off")
