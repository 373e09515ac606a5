"""Hypothesis test of faults: how well each explains what was measured, how large it is; Bayesian regression of the healthy.

Innovations are linear in the parameters, so all that they say is an information matrix L and a vector l. With the healthy
deviations of all parameters (mean m, covariance P) integrated out,

    L' = L (I + P L)^-1,   l' = (I + L P)^-1 (l - L m),

a fault whose coefficients c have the prior N(0, F) is more probable than none by the factor

    ln B = l_c' (L_cc + F^-1)^-1 l_c / 2 - ln det(I + F L_cc) / 2.

F is what such faults usually are. A sensor may be off by any amount: where the estimate is larger, F is taken for as large as
makes the measurements most probable, l^2 / L^2 - 1 / L (evidence maximised by the prior's width; MacKay, ch. 28). Else of two
causes that do the same in one posture that would be named of which such a size is more usual: an encoder's 20 mrad were 3 mm of
the stroke, with a probability of 0.96.

A fault has one of two shapes: it is as large all the time, or it grows steadily (two coefficients: what it was at the
beginning, and its rate), the second being much less probable from the outset: slow gusts look like that, too. A slow fault of
any cause thus has an equal chance beside a drifting sensor.

How large the unknown load at the tip is belongs to every hypothesis, that of no fault too: the evidence comes from filters of
several levels of it (see `innovation_filter`), and the probability of a fault is the sum over all levels. So a boom that
is shaken is not taken for a faulty one, nor a faulty one for one that is shaken.

(Gaussian model comparison; MacKay, Information Theory, Inference, and Learning Algorithms, 2003, ch. 28.) What even the best
explanation leaves is compared with what noise leaves; where it is more, all logarithms are divided by the ratio, so that a
model that is not quite right is not quite sure. Signatures are not quite right either: logarithms are divided by 1 + `CRUDE` of
the largest. Half of what signatures are wrong by is another error in every posture, and averages out over them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...kernels.jit import SameTypes
from ...types import Array
from .evidence_kernels import GROWN, Faults, add_rows, fit_faults, integrate_out
from .fault_catalogue import Form, Parameter, variances
from .kalman_update import correct, has_strayed
from .normal_distribution import log_normal_below

STEADY, GROWING = 0, 1
BOUNDLESS = (Form.ANGLE, Form.STROKE, Form.IMU)  # of sensors whose zero may be off by any amount
LASTING = (Form.DELAY, Form.SCALE, Form.ANGLE_SCALE, Form.IMU_SCALE, Form.IMU_TURN)  # lags, scales and mounts do not grow
CRUDE = 0.001  # see above
AS_WELL = 12.0  # ln by which a level of the load may be less probable than the best and still explain the evidence

_add_rows, _integrate_out = SameTypes(add_rows), SameTypes(integrate_out)


@dataclass(frozen=True)
class Evidence:
    """What some blocks say, of coefficients of faults, under one level of the load at the tip or several.

    Attributes
    ----------
    matrix, vector : ndarray, shape (..., coefficients, coefficients), (..., coefficients)
        L and l.
    squares : ndarray, shape (...)
        Sum of the squares of the innovations, all coefficients 0.
    rows : float
        Their number; less where they count less.
    log : ndarray, shape (...)
        Logarithm of their probability with all coefficients 0.
    """

    matrix: Array
    vector: Array
    squares: Array
    rows: float
    log: Array

    @staticmethod
    def none(coefficients: int, levels: tuple[int, ...] = ()) -> Evidence:
        """Of no blocks."""
        size = (*levels, coefficients)
        return Evidence(np.zeros((*size, coefficients)), np.zeros(size), np.zeros(levels), 0, np.zeros(levels))

    @staticmethod
    def of(white: Array, log: Array) -> Evidence:
        """Of blocks, from whitened innovations, shape (..., rows, 1 + coefficients)."""
        left, signature = white[..., :1], white[..., 1:]
        matrix, vector = signature.mT @ signature, (signature.mT @ left)[..., 0]
        return Evidence(matrix, vector, (left.mT @ left)[..., 0, 0], white.shape[-2], log)

    def with_rows(self, white: Array, log: Array, weight: float = 1.0) -> Evidence:
        """With what further blocks say, counting `weight` times as much; innovations as in `of`, of several levels."""
        *given, white = map(np.ascontiguousarray, (self.matrix, self.vector, self.squares, white))
        matrix, vector, squares = map(np.empty_like, given)
        _add_rows(*given, white, weight, matrix, vector, squares)
        return Evidence(matrix, vector, squares, self.rows + weight * white.shape[-2], self.log + weight * log)

    def weighted(self, weight: float) -> Evidence:
        """Counting `weight` times as much."""
        matrix, vector = weight * self.matrix, weight * self.vector
        return Evidence(matrix, vector, weight * self.squares, weight * self.rows, weight * self.log)

    def of_levels(self, levels: slice) -> Evidence:
        """Under some of the levels."""
        matrix, vector, squares, log = (each[levels] for each in (self.matrix, self.vector, self.squares, self.log))
        return Evidence(matrix, vector, squares, self.rows, log)

    def __add__(self, other: Evidence) -> Evidence:
        return Evidence(
            self.matrix + other.matrix, self.vector + other.vector, self.squares + other.squares, self.rows + other.rows,
            self.log + other.log,
        )  # fmt: skip

    def about(self, coefficients: Array, kept: Sequence[int]) -> Evidence:
        """Where there is a fault of these coefficients: of deviations from it of those that are kept, by their places."""
        by, at = self.matrix @ coefficients, np.asarray(kept)
        explained = (2.0 * self.vector - by) @ coefficients
        matrix, vector = self.matrix.take(at, axis=-2).take(at, axis=-1), (self.vector - by)[..., at]
        return Evidence(matrix, vector, self.squares - explained, self.rows, self.log + 0.5 * explained)

    def given(self, mean: Array, covariance: Array) -> Evidence:
        """With healthy deviations of the first coefficients integrated out: L', l', squares and logarithm that are then left.

        Parameters
        ----------
        mean, covariance : ndarray, shape (k,), (k, k)
            Of the first k coefficients; the others have none.
        """
        count, k, levels = self.vector.shape[-1], len(mean), self.log.shape
        given = self.matrix.reshape(-1, count, count), self.vector.reshape(-1, count), mean, covariance
        matrix, vector, *healthy = map(np.ascontiguousarray, given)
        scratch = np.empty((k, k)), np.empty((k, count + 1)), np.empty((k, k))
        left, reduced, fitted, log_det = np.empty_like(matrix), np.empty_like(vector), np.empty(levels), np.empty(levels)
        _integrate_out(matrix, vector, *healthy, *scratch, left, reduced, fitted.reshape(-1), log_det.reshape(-1))
        log, squares = self.log + 0.5 * (fitted - log_det), self.squares - fitted
        return Evidence(left.reshape(self.matrix.shape), reduced.reshape(self.vector.shape), squares, self.rows, log)


class Explanation(NamedTuple):
    """One fault after the measurements.

    Attributes
    ----------
    place : int
        Its parameter.
    level : int
        Of the load at the tip, from 0, that goes best with it.
    log_factor : float
        ln of how much more probable the measurements are than without a fault, each with the load that goes best with it.
    value, sigma : float
        Estimate and deviation of the parameter, now.
    rate, rate_sigma : float
        Of its growth, per s; 0 where it is steady.
    """

    place: int
    level: int
    log_factor: float
    value: float
    sigma: float
    rate: float = 0.0
    rate_sigma: float = 0.0

    @property
    def is_growing(self) -> bool:
        """Whether it has that shape, and it shows."""
        return abs(self.rate) > 4.0 * self.rate_sigma


class Cause(NamedTuple):
    """Explanations that have one cause, the most probable first, and their probability together, if there is a fault.

    Attributes
    ----------
    alone : float
        Probability by this evidence alone, whatever was known before.
    steady : float
        Likewise, if faults do not grow: by that shape alone.
    """

    name: str
    probability: float
    parts: tuple[Explanation, ...]
    alone: float
    steady: float


@dataclass(frozen=True)
class Verdict:
    """All causes, the most probable first.

    Attributes
    ----------
    causes : tuple of Cause
    excess : float
        Squares that the best explanation leaves over those that noise leaves, at least 1.
    none_excess : float
        Likewise where there is no fault, the least of all levels of the load at the tip that go about as well with that as the
        best does: pulses and gusts are no Gauss-Markov process, rest suits a low level, a steep flank a high one.
    level : int
        Of the load at the tip, from 0, that goes best with what is most probable of all, no fault among it.
    strength : float
        ln of how much more probable a fault is than none, with the excess taken into account, by all filters.
    """

    causes: tuple[Cause, ...]
    excess: float
    none_excess: float
    level: int
    strength: float

    @property
    def best(self) -> Explanation:
        """Of the most probable cause."""
        return self.causes[0].parts[0]


class HypothesisTest:
    """Explains evidence. Coefficients: of every parameter what it is at the beginning, then of those that may grow the rate.

    Parameters
    ----------
    known : tuple of Parameter

    Attributes
    ----------
    growing : ndarray of int
        Places of the parameters that may grow.
    coefficient_count : int
    """

    def __init__(self, known: tuple[Parameter, ...]) -> None:
        self.known = known
        self._places = np.array([i for i, each in enumerate(known) if each.faulty > 0.0])
        may_grow = np.array([known[i].form not in LASTING for i in self._places])
        self.growing = self._places[may_grow]
        self.coefficient_count = len(known) + len(self.growing)
        self._rate_of = {int(place): len(known) + k for k, place in enumerate(self.growing)}
        self._faulty = variances(known, "faulty")[self._places]
        least = np.array([known[i].least for i in self._places])
        self._faults = Faults(
            self._places, self._faulty, np.array([known[i].form in BOUNDLESS for i in self._places]), least,
            log_normal_below(-least / np.sqrt(self._faulty)), np.flatnonzero(may_grow),
            len(known) + np.arange(len(self.growing)),
        )  # fmt: skip
        self._fit_faults = SameTypes(fit_faults)
        self._explained = np.concatenate([self._places, self.growing])  # by both shapes: what follows is of these
        self._priors = np.log([known[i].prior for i in self._explained])
        self._names = tuple(dict.fromkeys(known[i].cause for i in self._places))
        self._group = [self._names.index(known[i].cause) for i in self._explained]

    def explain(
        self,
        evidence: Evidence,
        mean: Array,
        covariance: Array,
        span: float,
        carried: Mapping[str, float],
        postures: float = 1.0,
        healthy_too: Evidence | None = None,
    ) -> Verdict:
        """Weigh all faults.

        Parameters
        ----------
        evidence : Evidence
            Of all levels of the load at the tip, one axis.
        mean, covariance : ndarray
            Of the parameters while all was well.
        span : float
            Time (s) that the evidence has taken.
        carried : mapping of str to float
            ln of how probable causes were before this evidence; 0 for others.
        postures : float
            In how many the evidence was collected.
        healthy_too : Evidence, optional
            Of the same rows by filters to which the boom is as a healthy one: each fault is as strong as by both at most.

        Returns
        -------
        Verdict
            How well each fault explains the evidence, and how large it would be.
        """
        healthy = evidence.given(mean, covariance)
        logs, fits = healthy.log, self._fits(healthy, span)
        factors, best, excess = self._weighed(logs, healthy.squares, healthy.rows, fits)
        strengths = factors.max(axis=0) / excess
        if healthy_too is not None and strengths.max() > 0.0:
            also = healthy_too.given(mean, covariance)
            both = np.concatenate([logs, also.log]), np.concatenate([healthy.squares, also.squares])
            by_both, _, excess_of_both = self._weighed(*both, healthy.rows, np.concatenate([fits, self._fits(also, span)]))
            strengths = np.minimum(strengths, by_both.max(axis=0) / excess_of_both)
        priors = self._priors.copy()
        seen = (healthy.matrix.diagonal(axis1=-2, axis2=-1)[:, self._explained] > 0.0).any(axis=0)
        priors[~seen] = -np.inf if seen.any() else 0.0  # what shows in no reading, say an IMU that is not there
        crude = 0.5 * CRUDE * (1.0 + 1.0 / postures)
        weights = factors / (excess * (1.0 + crude * max(0.0, float(factors[best])))) + priors
        alone = np.exp(weights - weights.max()).sum(axis=0)
        shares = alone * np.exp([carried.get(self.known[place].cause, 0.0) for place in self._explained])
        levels = np.argmax(factors, axis=0)
        at = np.arange(len(levels))
        which = self._explained.tolist(), levels.tolist(), factors[levels, at].tolist()
        found = [Explanation(*each) for each in zip(*which, *fits[levels, 2:, at].T.tolist(), strict=True)]
        is_faulty, none = float(factors[best]) > 0.0, int(np.argmax(logs))
        as_well = logs > logs[none] - AS_WELL
        none_excess = max(1.0, float(healthy.squares[as_well].min()) / max(healthy.rows, 1.0))
        constant = weights[:, : len(self._places)]
        steady = np.zeros_like(alone)
        steady[: len(self._places)] = np.exp(constant - constant.max()).sum(axis=0)
        causes = self._grouped(found, *(each / each.sum() for each in (shares, alone, steady)))
        return Verdict(causes, excess, none_excess, int(best[0]) if is_faulty else none, float(strengths.max()))

    def _fits(self, healthy: Evidence, span: float) -> Array:
        """How well every explanation goes with evidence; shape (levels, 6, explanations), see `fit_faults`."""
        found = np.empty((len(healthy.log), 6, len(self._explained)))
        self._fit_faults(self._faults, healthy.matrix, healthy.vector, span, found)
        return found

    @staticmethod
    def _weighed(logs: Array, squares: Array, rows: float, fits: Array) -> tuple[Array, tuple[np.intp, ...], float]:
        """Log factors over no fault under the load that suits that (levels, explanations); the largest's place, its excess."""
        factors = fits[:, 0] + (logs - logs.max())[:, None]
        best = np.unravel_index(int(np.argmax(factors)), factors.shape)
        left = float(squares[best[0]] - fits[best[0], 1, best[1]])
        return factors, best, max(1.0, left / max(rows, 1.0))

    def least_told(self, information: Array, strength: float) -> Array:
        """Sizes (parameters,) of steady faults whose expected log factor is `strength`, by their information (parameters,).

        Infinite of parameters that are never faulty, or of which nothing is known.
        """
        found, known = np.full(len(self.known), np.inf), information[self._places]
        spread = self._faulty / (1.0 + self._faulty * np.maximum(known, 1e-300))
        wanted = 2.0 * strength + np.log1p(self._faulty * known)
        found[self._places] = np.sqrt(wanted / spread) / np.maximum(known, 1e-300)
        return found

    def _grouped(self, found: list[Explanation], shares: Array, alone: Array, steady: Array) -> tuple[Cause, ...]:
        groups: dict[int, list[int]] = {}
        for i in np.argsort(-shares, kind="stable").tolist():
            groups.setdefault(self._group[i], []).append(i)
        sums = [np.bincount(self._group, each).tolist() for each in (shares, alone, steady)]
        causes = [
            Cause(self._names[group], sums[0][group], tuple(found[i] for i in at), sums[1][group], sums[2][group])
            for group, at in groups.items()
        ]
        return tuple(sorted(causes, key=lambda cause: -cause.probability))

    def fit(self, evidence: Evidence, coefficients: Array, mean: Array, covariance: Array) -> tuple[Array, Array]:
        """How well faults of known coefficients (coefficients,) go with evidence.

        Returns
        -------
        logs, squares : ndarray, shape (levels,)
            By level of the load: ln of how probable the measurements are, and squares left over those that noise leaves.
        """
        healthy = evidence.about(coefficients, range(len(mean))).given(mean, covariance)
        return healthy.log, healthy.squares / max(healthy.rows, 1.0)

    def change(
        self, evidence: Evidence, each: Explanation, span: float, middle: float, mean: Array, covariance: Array
    ) -> tuple[Array, Array, float, float]:
        """How well a fault, `span` (s) after its evidence began, goes with evidence of the same filter about `middle` (s).

        Returns
        -------
        logs, squares : ndarray, shape (levels,)
            As `fit` gives them.
        changed : float
            ln of how much more probable it is that its size, or its rate if it may grow, is another one by then than that they
            are what they were, each with the load that goes best with it: the flank of a pump's pulse is no other size.
        moved : float
            By what share of its size it would have changed by the middle.
        """
        rate = [self._rate_of[each.place]] if each.place in self._rate_of else []
        healthy = evidence.about(self.coefficients(each, span), [*range(len(mean)), *rate]).given(mean, covariance)
        own = np.array([each.place, len(mean)][: 1 + len(rate)])
        prior2 = self.known[each.place].faulty ** 2 * np.array([1.0, GROWN**-2])[: len(own)]
        vector, matrix = healthy.vector[:, own], healthy.matrix[:, own[:, None], own]
        spread = np.eye(len(own)) + prior2[:, None] * matrix
        found = np.linalg.solve(spread, (prior2 * vector)[..., None])[..., 0]
        gains = 0.5 * (vector * found).sum(axis=-1) - 0.5 * np.linalg.slogdet(spread)[1]
        logs = healthy.log + gains
        level = int(np.argmax(logs))
        changed, by = float(logs[level] - healthy.log.max()), float(found[level] @ np.array([1.0, middle])[: len(own)])
        return healthy.log, healthy.squares / max(healthy.rows, 1.0), changed, abs(by) / max(abs(each.value), 1e-300)

    def coefficients(self, each: Explanation, span: float) -> Array:
        """Of the fault alone, `span` (s) after its evidence began; shape (coefficients,)."""
        found = np.zeros(self.coefficient_count)
        found[each.place] = each.value - each.rate * span
        if each.place in self._rate_of:
            found[self._rate_of[each.place]] = each.rate
        return found


GATE = 4.5  # deviations
STRAYED = 5.0  # deviations of the prior
LEAST = 1e-3  # of the prior's variance, what must have been learnt for that

_has_strayed = SameTypes(has_strayed)


class Regression:
    """Parameters that are constant in time, normal before anything is measured; what is measured narrows them.

    Mean and covariance are never changed, but replaced: what was known at a time may be kept.

    Parameters
    ----------
    mean : ndarray, shape (parameters,)
    covariance : ndarray, shape (parameters, parameters)
        Of healthy parameters.
    """

    def __init__(self, mean: Array, covariance: Array) -> None:
        self._prior = mean, covariance
        self._prior2, self._size = covariance.diagonal().copy(), -1
        self._correct = SameTypes(correct)
        self.restart()

    def restart(self) -> None:
        """Know no more than before anything was measured."""
        self.mean, self.covariance = self._prior

    @property
    def has_strayed(self) -> bool:
        """Whether what was learnt bit by bit is, all together, more than healthy parameters may be off by."""
        return bool(_has_strayed(self.mean, self.covariance, self._prior[0], self._prior2, STRAYED, LEAST))

    def take(self, white: Array, learn: bool) -> tuple[Array, float]:
        """Narrow by whitened innovations, shape (rows, 1 + parameters), what is known.

        Parameters
        ----------
        white : ndarray
            Of one block.
        learn : bool
            False leaves everything as it is. A block with something left beyond `GATE`, which no healthy deviation explains, is
            never learnt from.

        Returns
        -------
        left : ndarray, shape (rows,)
            What is left, of unit variance each.
        spread : float
            Logarithm of the deviations that it had, in all.
        """
        white, signature = np.ascontiguousarray(white), np.ascontiguousarray(white[:, 1:])
        mean, covariance, left = self.mean[:, None].copy(), self.covariance.copy(), np.empty((len(white), 1))
        if self._size != len(white):
            self._size, (count, states) = len(white), signature.shape
            self._own = np.arange(count), np.eye(count), np.zeros(count)
            self._scratch = np.empty((count, count)), np.empty((count, states))
        measured, noise, others = self._own
        log = self._correct(measured, white, signature, noise, others, mean, covariance, *self._scratch, left)
        if learn and np.abs(left).max() < GATE:
            self.mean, self.covariance = mean[:, 0], covariance
        return left[:, 0], -log - 0.5 * float(left[:, 0] @ left[:, 0])
