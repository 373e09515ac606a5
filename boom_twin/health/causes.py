"""Fault hypotheses of a boom, and the decision which of them is named.

Faults of the boom are sizes of its parameters: losses of stiffness, loads, masses. Near the boom as believed the innovations r
of its filter are linear in these sizes x,

    r = sum_i S_i x_i + e,    S_i = (r - r_i) / size_i,

with r_i of the twin with fault i alone. A healthy boom has them too: they are `Settings.scene_error`, all the time. A fault is
a further size of one parameter from its onset on, of unknown amount. So for each onset its most likely size, the variance of
that, and the factor by which it is more probable than no fault are in closed form (generalised likelihood ratio: A. Willsky and
H. Jones, IEEE Trans. Automat. Control 21 (1976), 108-112). The evidence of a fault is the mean of that factor over all onsets.

A sensor whose zero drifts, or a late stream, is no size. Each second gives its twin a gain: its log likelihood less that of the
boom as believed, and less what errors of the scene explain. Its evidence is the mean over all onsets, too.

Two facts limit both. Successive innovations are not independent, so each counts as a share `INDEPENDENT`. And an effect outside
all hypotheses, such as a valve that opens under a load, may dominate a second: innovations beyond their deviation count less,
as in the filter, and no log likelihood of a second is so far below the best that it names a fault alone.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from ..config.settings import Settings
from ..deviation.kalman import ANGLE_ZERO
from ..deviation.predictor import LAG_FLOOR
from ..deviation.sensors import DOF
from ..deviation.states import Innovations
from ..scene.edit import loaded, parameter, parameter_names, with_parameters
from ..scene.schema import Scene
from ..scene.summary import explain
from ..types import Alarm, Array, Stream, StrokeReading, channels_of, sensor_kind
from .alarms import UNKNOWN, change_text

LOSS, OIL_LOSS, LOAD = 0.25, 0.1, 0.02  # relative loss of a k or EI, of k of all cylinders; load over the boom's mass
LATE = 0.02  # s, delay of the stamps of a stream
INDEPENDENT = 0.25  # share of successive innovations that count as independent
MEMORY = 60  # s in which an onset is looked for
TINY, NONE = 1e-12, -1e3  # least information; evidence of what cannot be


class Fault(NamedTuple):
    """Fault of a boom.

    cause : parameter of the scene, sensor, or delay of a stream. kind : ``softer``, ``more``, ``less``, ``off``, ``late``, or
    ``heavier`` of a section. size : relative loss, kg, kg/m, s, relative mass; or the change of a sensor's zero, rad, m/s^2 or
    N. The hypothesis ``off`` lets the zero drift by any amount. is_told : False without an alarm: it competes for its effect.
    """

    cause: str
    kind: str
    size: float = 0.0
    is_told: bool = True

    @property
    def is_size(self) -> bool:
        """Whether it is the size of a parameter of the boom."""
        return self.kind not in ("off", "late")

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
        elif kind == "heavier":
            scene = with_parameters(scene, {cause: (1.0 + size) * parameter(scene, cause)})
        elif kind == "off":
            name, channels = cause.removesuffix(".sensor"), channels_of(len(scene.joints))
            doubted |= set(channels[Stream.IMU]) if name == "tip_imu" else {name}
        elif kind == "late":
            delays.append((Stream(cause.removesuffix(".delay")), size))
        else:
            extra[cause] += size if kind == "more" else -size
    return Hypothesis(scene, extra["tip.payload"], extra["line_fill"], frozenset(doubted), tuple(delays))


def possible_faults(scene: Scene, reads: StrokeReading = StrokeReading.LENGTH) -> list[Fault]:
    """Return all single faults that are compared for a boom; warm oil, which softens all cylinders, and masses are none."""
    mass = explain(scene).mass
    found = [Fault(name, "softer", LOSS) for name in parameter_names(scene) if name.endswith((".k", ".EI", ".stiffness"))]
    found.append(Fault("oil.k", "softer", OIL_LOSS, False))
    found += [Fault(f"section_{i + 1}.mass", "heavier", LOSS, False) for i in range(len(scene.sections))]
    found.append(Fault("tip.payload", "more", LOAD * mass))
    found.append(Fault("line_fill", "more", 2.0 * LOAD * mass / scene.reach))
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
    """Probable fault.

    place : index among the faults compared. onset : stamp (ns) of the first second of its evidence. evidence : logarithm of
    the factor by which it is more probable than no fault. sizes : most likely sizes of all sizes of the boom that are ranked,
    by their index. ranked : the three most probable causes with their posterior probabilities, then `UNKNOWN` with the rest.
    """

    place: int
    onset: int
    evidence: float
    sizes: dict[int, float]
    ranked: tuple[tuple[str, float], ...]


class Scores(NamedTuple):
    """What the innovations of a second tell of sizes x: their log likelihood is slopes . x - x . information . x / 2."""

    slopes: Array
    information: Array


def scores(believed: Innovations, twins: Sequence[Innovations], sizes: Sequence[float]) -> Scores:
    """Return the scores of a second from the innovations of the boom as believed, and of twins with faults of these sizes.

    Innovations are weighted as by Student's t in the filter. A channel counts if all twins took as many of its readings.
    """
    alike = np.all([each.counts == believed.counts for each in twins], axis=0)
    taken = (np.arange(believed.values.shape[1]) < believed.counts[:, None]) & alike[:, None]
    deviations = np.sqrt(believed.variances[taken])
    changes = np.array([believed.values[taken] - each.values[taken] for each in twins])
    r, s = believed.values[taken] / deviations, changes / (deviations * np.array(sizes)[:, None])
    weighted = INDEPENDENT * np.minimum((DOF + 1.0) / (DOF + r * r), 1.0) * s
    return Scores(weighted @ r, weighted @ s.T)


class Evidence:
    """Evidence of faults, updated every second.

    Parameters
    ----------
    scene : Scene
    faults : sequence of Fault
    settings : Settings
        With the posterior probability required to name a cause, and the errors of the scene.
    least : sequence of float
        Smallest size of each fault that is told.
    named : collection of str
        Causes of named faults: their sizes may grow or shrink.
    """

    def __init__(
        self,
        scene: Scene,
        faults: Sequence[Fault],
        settings: Settings,
        least: Sequence[float],
        named: Collection[str] = (),
    ) -> None:
        self._odds, self._faults = settings.name_odds, tuple(faults)
        self._sure = math.log(settings.name_odds / (1.0 - settings.name_odds))
        self._needed = np.full(len(faults), NONE)  # evidence below which a fault is left out
        self._is_size = np.array([fault.is_size for fault in faults])
        sized = [fault for fault in faults if fault.is_size]
        self._sizes, self._least = np.array([fault.size for fault in sized]), np.array(least)[self._is_size]
        self._is_fault = np.array([fault.kind != "heavier" for fault in sized], bool)
        self._is_signed = np.array(
            [fault.cause in named or (fault.kind == "more" and parameter(scene, fault.cause) > 0.0) for fault in sized], bool
        )
        self._wrong = np.array([fault.kind != "more" for fault in sized], bool)
        errors = np.array([OIL_LOSS if fault.cause == "oil.k" else settings.scene_error for fault in sized])
        self._precisions = np.diag(errors[self._wrong] ** -2.0)
        n = len(sized)
        self._sums = deque([Scores(np.zeros(n), np.zeros((n, n)))], maxlen=MEMORY)
        self._gains = deque([np.zeros(len(faults) - n)], maxlen=MEMORY)
        self._stamps = deque([0], maxlen=MEMORY)

    def take(self, stamp: int, likelihoods: Array, found: Scores) -> Verdict | None:
        """Take a second that begins at a stamp (ns); return the verdict if a fault is probable.

        `likelihoods` (1 + faults,) in nats, the boom as believed first; `found` of the faults that are sizes.
        """
        bounded = np.maximum(INDEPENDENT * likelihoods, INDEPENDENT * likelihoods.max() - self._sure)
        self._gains.append(self._gains[-1] + (bounded[1:] - bounded[0])[~self._is_size])
        self._sums.append(Scores(*(old + new for old, new in zip(self._sums[-1], found, strict=True))))
        self._stamps.append(stamp)
        sizes, factors, explained = self._sizes_by_onset()
        every = np.empty((len(factors), len(self._faults)))
        every[:, self._is_size] = factors
        every[:, ~self._is_size] = self._gains[-1] - np.array(self._gains)[:-1] - explained[:, None]
        best, onsets = every.max(axis=0), len(every) - 1 - every[::-1].argmax(axis=0)
        evidence = best + np.log(np.exp(every - best).mean(axis=0))
        evidence[evidence < self._needed] = NONE
        causes = {"": 0.0} | {fault.cause: each for fault, each in zip(self._faults, evidence.tolist(), strict=True)}
        weights = np.exp(np.array(list(causes.values())) - max(causes.values()))  # all are equally probable before
        chances = dict(zip(causes, (weights / weights.sum()).tolist(), strict=True))
        place = int(np.argmax(evidence))
        if chances[self._faults[place].cause] < self._odds:
            return None
        ranked = sorted(((cause, chance) for cause, chance in chances.items() if cause), key=lambda each: -each[1])[:3]
        ranked.append((UNKNOWN, max(0.0, 1.0 - sum(chance for _, chance in ranked))))
        shown, likely = {cause for cause, _ in ranked}, np.full(len(self._faults), math.nan)
        likely[self._is_size] = np.where(self._is_fault, sizes[onsets[self._is_size], np.arange(len(self._sizes))], math.nan)
        found_sizes = {i: size for i, size in enumerate(likely.tolist()) if size == size and self._faults[i].cause in shown}
        return Verdict(place, self._stamps[onsets[place] + 1], float(evidence[place]), found_sizes, tuple(ranked))

    def _sizes_by_onset(self) -> tuple[Array, Array, Array]:
        """Return the likeliest sizes by onset and fault, the logarithms of their factors, and what errors of the scene explain.

        With slopes b and information G since an onset, and errors x of the scene of covariance P, the size of fault j is
        (b_j - G_j. x) / (G_jj - G_j. P G_.j). One over the denominator is its variance.
        """
        slopes, information = (np.array(each) for each in zip(*self._sums, strict=True))
        b, g, w = slopes[-1] - slopes[:-1], information[-1] - information[:-1], self._wrong
        covariance = np.linalg.inv(self._precisions + information[-1][np.ix_(w, w)])
        errors, shared = covariance @ slopes[-1][w], g[:, :, w]
        explained = np.maximum(b[:, w] @ errors - 0.5 * np.einsum("i,kij,j->k", errors, shared[:, w], errors), 0.0)
        known = np.einsum("kii->ki", g) - np.einsum("kfi,ij,kfj->kf", shared, covariance, shared)
        sizes = (b - shared @ errors) / np.maximum(known, TINY)
        ratio = self._sizes**2 * np.maximum(known, TINY)  # of the variances of a fault's size, before and after
        factors = 0.5 * (sizes**2 * known * ratio / (1.0 + ratio) - np.log1p(ratio)) + self._above(sizes, ratio)
        return sizes, np.where(self._is_fault, factors, NONE), explained

    def _above(self, sizes: Array, ratio: Array) -> Array:
        """Return how much more probable sizes are above the least ones than they were before; logarithm of the factor."""
        means, deviations = sizes * ratio / (1.0 + ratio), self._sizes / np.sqrt(1.0 + ratio)
        above, below = log_ndtr((means - self._least) / deviations), log_ndtr((-means - self._least) / deviations)
        after = np.where(self._is_signed, np.logaddexp(above, below) - math.log(2.0), above)
        return np.asarray(after - log_ndtr(-self._least / self._sizes))

    def postpone(self, place: int, evidence: float) -> None:
        """Leave out a sensor or a lag whose size is not sure until its evidence has grown by what a name needs."""
        self._needed[place] = evidence + self._sure


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
