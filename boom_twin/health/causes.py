"""Evidence of fault hypotheses of a boom, and the decision which of them is named.

A fault of the boom has a size: a loss of stiffness, a load, a mass. Near the boom as believed, the innovations r of its filter
are linear in all sizes x,

    r = sum_i S_i x_i + e,    S_i = (r - r_i) / size_i,

with r_i of the twin with fault i alone. The sizes of a healthy boom are not zero. Their lasting part has the standard deviation
`Settings.scene_error`. Because no model of a moving boom is exact, a further part is `UNSTEADY` times as large and independent
in each second. One size is the unknown load that the filter expects. If that is too large, the filter follows noise, and a
heavier boom, which the load moves less, predicts better.

A fault is a further size of one parameter from its onset on, of unknown amount. For each onset, its most likely size, the
variance of that size, and its likelihood ratio to no fault have a closed form (generalised likelihood ratio: A. Willsky and
H. Jones, IEEE Trans. Automat. Control 21 (1976), 108-112). The evidence of a fault is the mean ratio over all onsets.

A sensor whose zero drifts, or a late stream, has no size. Each second gives its twin a gain: its log likelihood less that of
the boom as believed, and less what errors of the scene explain. Its evidence is also a mean over all onsets.

Successive innovations are correlated, so each counts as a share `INDEPENDENT`. An effect outside all hypotheses, such as a
valve that opens under a load, may dominate a second. So innovations beyond their deviation have less weight, as in the filter.
The log likelihood of a second is bounded: one second cannot name a fault.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

import numpy as np

from ..config.settings import Settings
from ..deviation.sensors import DOF
from ..deviation.states import Innovations
from ..scene.edit import parameter
from ..scene.schema import Scene
from ..types import Array
from .alarms import UNKNOWN
from .faults import OIL_LOSS, Fault

INDEPENDENT = 0.35  # share of successive innovations that count as independent
UNSTEADY = 3.0  # errors of a second over lasting ones
MEMORY = 60  # s in which an onset is looked for
RATIO = 1.4  # ratio of successive trial sizes of a fault
TINY, NONE = 1e-12, -1e3  # least information; evidence of an impossible fault


class Verdict(NamedTuple):
    """Probable fault.

    place : index of the fault. onset : stamp (ns) of the first second of its evidence. evidence : log likelihood ratio to no
    fault. sizes : most likely size of each ranked fault that has one, by index. ranked : the three most probable causes with
    their posterior probabilities, then `UNKNOWN` with the rest.
    """

    place: int
    onset: int
    evidence: float
    sizes: dict[int, float]
    ranked: tuple[tuple[str, float], ...]


class Likeliest(NamedTuple):
    """Most likely size of a fault.

    spread : standard deviation by the jackknife over seconds, valid for an inexact model. onset : number of the first second
    from which this size, or half of it, is likelier than none: a fault grows to its size. whole : number of the first second
    from which this size is likelier than half of it. probability : log posterior probability density, up to a constant common
    to all faults. agreement : sum of the gains of all seconds over the root of the sum of their squares. If gains are
    independent and symmetric about zero, it exceeds t with a probability below exp(-t^2/2) (B. Efron, J. Amer. Stat. Assoc. 64
    (1969), 1278-1302). Each gain is bounded by the evidence that a name needs.
    """

    size: float
    spread: float
    onset: int
    whole: int
    probability: float
    agreement: float


class Scores(NamedTuple):
    """Log likelihood of the innovations of a second as a function of sizes x: slopes . x - x . information . x / 2."""

    slopes: Array
    information: Array


def scores(believed: Innovations, twins: Sequence[Innovations], sizes: Sequence[float]) -> Scores:
    """Return the scores of a second from the innovations of the boom as believed, and of twins with faults of these sizes.

    Innovations have the weights of Student's t, as in the filter. A channel counts if all twins took as many readings of it.
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
        They have the posterior probability required to name a cause, and the errors of the scene.
    errors : sequence of float
        Standard deviation of each size in healthy booms.
    certain : float
        Smallest size of a fault that can be named, in these standard deviations.
    named : collection of str
        Causes of named faults: their sizes may grow or shrink.

    Attributes
    ----------
    sure : float
        Logarithm of the odds required to name a cause.
    """

    def __init__(
        self,
        scene: Scene,
        faults: Sequence[Fault],
        settings: Settings,
        errors: Sequence[float],
        certain: float,
        named: Collection[str] = (),
    ) -> None:
        self._odds, self._faults = settings.name_odds, tuple(faults)
        self.sure = math.log(settings.name_odds / (1.0 - settings.name_odds))
        self._is_size = np.array([fault.is_size for fault in faults])
        sized = [fault for fault in faults if fault.is_size]
        self._sizes, own = np.array([fault.size for fault in sized]), np.array(errors)[self._is_size]
        self._least, self._unsteady = certain * own, np.diag((UNSTEADY * own) ** 2)
        self._is_fault = np.array([fault.kind not in ("heavier", "quieter") for fault in sized], bool)
        self._is_signed = np.array(
            [fault.cause in named or (fault.kind == "more" and parameter(scene, fault.cause) > 0.0) for fault in sized], bool
        )
        self._wrong = np.array([fault.kind != "more" for fault in sized], bool)
        own = np.where([fault.cause == "oil.k" for fault in sized], OIL_LOSS, own)
        self._precisions = np.diag(own[self._wrong] ** -2.0)
        n = len(sized)
        self._sums = deque([Scores(np.zeros(n), np.zeros((n, n)))], maxlen=MEMORY)
        self._gains = deque([np.zeros(len(faults) - n)], maxlen=MEMORY)
        self._stamps = deque([0], maxlen=MEMORY)

    def take(self, stamp: int, likelihoods: Array, found: Scores) -> Verdict | None:
        """Take a second that begins at a stamp (ns); return the verdict if a fault is probable.

        `likelihoods` (1 + faults,) in nats, the boom as believed first; `found` of the faults that are sizes.
        """
        bounded = np.maximum(INDEPENDENT * likelihoods, INDEPENDENT * likelihoods.max() - self.sure)
        self._gains.append(self._gains[-1] + (bounded[1:] - bounded[0])[~self._is_size])
        steady = np.linalg.inv(np.eye(len(self._sizes)) + found.information @ self._unsteady)
        self._sums.append(Scores(*(old + steady @ new for old, new in zip(self._sums[-1], found, strict=True))))
        self._stamps.append(stamp)
        sizes, factors, explained = self._sizes_by_onset()
        every = np.empty((len(factors), len(self._faults)))
        every[:, self._is_size] = factors
        every[:, ~self._is_size] = self._gains[-1] - np.array(self._gains)[:-1] - explained[:, None]
        best, onsets = every.max(axis=0), len(every) - 1 - every[::-1].argmax(axis=0)
        evidence = best + np.log(np.exp(every - best).mean(axis=0))
        causes = {"": 0.0}
        for fault, each in zip(self._faults, evidence.tolist(), strict=True):  # a named fault may have ended, or changed
            causes[fault.cause] = np.logaddexp(causes.get(fault.cause, NONE), each)
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
        """Return the log ratio of posterior to prior probability that each size exceeds its smallest value."""
        from scipy.special import log_ndtr  # not at the start of every twin

        means, deviations = sizes * ratio / (1.0 + ratio), self._sizes / np.sqrt(1.0 + ratio)
        above, below = log_ndtr((means - self._least) / deviations), log_ndtr((-means - self._least) / deviations)
        after = np.where(self._is_signed, np.logaddexp(above, below) - math.log(2.0), above)
        return np.asarray(after - log_ndtr(-self._least / self._sizes))


def likeliest(size: float, least: float, sure: float, gain: Callable[[float], Array]) -> Likeliest | None:
    """Return the most likely size by twins of larger and smaller sizes, until the likelihood falls on both sides.

    Parameters
    ----------
    size : float
        First trial, and prior standard deviation of the size.
    least : float
        Smallest trial, if likelihood grows towards small sizes.
    sure : float
        Upper bound on the gain of a second.
    gain : callable
        Size -> gain of log likelihood over that of no fault, of each second that may be the first, shape (k,).

    Returns
    -------
    Likeliest or None
        None if the smallest trial is the most likely one.
    """

    def gained(size: float) -> Array:
        """Return the gain of a size by onset: the sum of those of the seconds from there."""
        return np.asarray(gain(size)[::-1].cumsum()[::-1])

    sizes = [size / RATIO, size]
    gains = [gained(each) for each in sizes]
    while gains[-1].max() > gains[-2].max():
        sizes.append(RATIO * sizes[-1])
        gains.append(gained(sizes[-1]))
    while gains[0].max() > gains[1].max() and abs(sizes[0]) > least:
        sizes.insert(0, sizes[0] / RATIO)
        gains.insert(0, gained(sizes[0]))
    best = int(np.argmax([each.max() for each in gains]))
    if best == 0:
        return None
    first, changes = int(gains[best].argmax()), np.array(sizes[best - 1 : best + 2]) - sizes[best]
    curves, slopes, _ = np.polyfit(changes, [each[first:] for each in gains[best - 1 : best + 2]], 2)
    change = float(np.clip(-0.5 * slopes[0] / curves[0], changes.min(), changes.max()))
    with np.errstate(divide="ignore", invalid="ignore"):  # nothing is left without the only second
        without = 0.5 * np.diff(slopes + 2.0 * curves * change, append=0.0) / (curves[0] + np.diff(curves, append=0.0))
    found = sizes[best] + change
    probability = INDEPENDENT * float(gains[best][first]) - 0.5 * (found / size) ** 2
    full, half = gain(found), gain(0.5 * found)
    own = np.clip(INDEPENDENT * full[first:], -sure, sure)
    agreement = float(own.sum() / max(np.linalg.norm(own), TINY))
    onset, whole = (int(each[::-1].cumsum()[::-1].argmax()) for each in (half, full - half))
    return Likeliest(found, float(np.linalg.norm(without)), min(first, onset), whole, probability, agreement)
