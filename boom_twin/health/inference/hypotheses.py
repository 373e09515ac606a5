"""Hypothesis test of faults: how well each explains what was measured, how large it is; Bayesian regression of the healthy.

Innovations are linear in the parameters, so all that they say is an information matrix L and a vector l. With the healthy
deviations of all parameters (mean m, covariance P) integrated out,

    L' = L (I + P L)^-1,   l' = (I + L P)^-1 (l - L m),

a fault with prior N(0, F) in one parameter f is more probable than none by the factor

    ln B = l_f^2 / (L_ff + 1/F) / 2 - ln(1 + F L_ff) / 2,

and one that is unknown by the factor of a model whose errors are many times larger. (Gaussian model comparison; MacKay,
Information Theory, Inference, and Learning Algorithms, 2003, ch. 28.) What even the best explanation leaves is compared with
what noise leaves; where it is more, all logarithms are divided by the ratio, so that a model that is not quite right is not
quite sure.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log

import numpy as np

from ...types import Array
from .fault_catalogue import Form, Parameter, variances

UNKNOWN, UNKNOWN_PRIOR = "unknown", 0.01
SLOWEST = 6.0  # s


@dataclass(frozen=True)
class Evidence:
    """What some blocks say.

    Attributes
    ----------
    matrix, vector : ndarray, shape (parameters, parameters), (parameters,)
        L and l.
    squares : float
        Sum of the squares of the innovations, all parameters 0.
    rows : int
        Their number.
    log, unknown : float
        Logarithm of their probability with all parameters 0, and with an unknown fault.
    """

    matrix: Array
    vector: Array
    squares: float
    rows: int
    log: float
    unknown: float

    @staticmethod
    def none(parameters: int) -> Evidence:
        """Of no blocks."""
        return Evidence(np.zeros((parameters, parameters)), np.zeros(parameters), 0.0, 0, 0.0, 0.0)

    @staticmethod
    def of(white: Array, log: float, unknown: float) -> Evidence:
        """Of one block, from whitened innovations, shape (rows, 1 + parameters)."""
        left, signature = white[:, 0], white[:, 1:]
        matrix, vector = np.asarray(signature.T @ signature), np.asarray(signature.T @ left)
        return Evidence(matrix, vector, float(left @ left), len(left), log, unknown)

    def __add__(self, other: Evidence) -> Evidence:
        return Evidence(
            self.matrix + other.matrix, self.vector + other.vector, self.squares + other.squares, self.rows + other.rows,
            self.log + other.log, self.unknown + other.unknown,
        )  # fmt: skip

    def turned(self, turn: Array) -> Evidence:
        """Of other parameters, of which these are `turn` times."""
        return Evidence(
            turn.T @ self.matrix @ turn, turn.T @ self.vector, self.squares, self.rows, self.log, self.unknown
        )  # fmt: skip

    def given(self, mean: Array, covariance: Array) -> Evidence:
        """With healthy deviations of all parameters integrated out: L', l', squares and logarithm that are then left."""
        vector = self.vector - self.matrix @ mean
        spread = np.eye(len(mean)) + self.matrix @ covariance
        solved = np.linalg.solve(spread, np.column_stack([self.matrix, vector]))
        matrix, reduced = solved[:, :-1], solved[:, -1]
        _, log_det = np.linalg.slogdet(spread)
        fitted = 2.0 * float(self.vector @ mean) - float(mean @ self.matrix @ mean) + float(vector @ covariance @ reduced)
        log = self.log + 0.5 * (fitted - float(log_det))
        symmetric: Array = np.asarray(0.5 * (matrix + matrix.T))
        return Evidence(symmetric, np.asarray(reduced), self.squares - fitted, self.rows, log, self.unknown)


@dataclass(frozen=True, slots=True)
class Explanation:
    """One fault after the measurements.

    Attributes
    ----------
    place : int or None
        Its parameter; None for a fault that is unknown.
    log_factor : float
        ln of how much more probable the measurements are than without a fault.
    value, sigma : float
        Estimate and deviation of the parameter.
    """

    place: int | None
    log_factor: float
    value: float = 0.0
    sigma: float = 0.0


@dataclass(frozen=True, slots=True)
class Cause:
    """Explanations that have one cause, the most probable first, and their probability together, if there is a fault."""

    name: str
    probability: float
    parts: tuple[Explanation, ...]


@dataclass(frozen=True, slots=True)
class Verdict:
    """All causes, the most probable first.

    Attributes
    ----------
    causes : tuple of Cause
    excess : float
        Squares that the best explanation leaves over those that noise leaves, at least 1.
    """

    causes: tuple[Cause, ...]
    excess: float

    @property
    def best(self) -> Explanation:
        """Of the most probable cause."""
        return self.causes[0].parts[0]

    @property
    def strength(self) -> float:
        """ln of how much more probable the best explanation is than no fault, with the excess taken into account."""
        return self.best.log_factor / self.excess


class HypothesisTest:
    """Explains evidence.

    Parameters
    ----------
    known : tuple of Parameter
    """

    def __init__(self, known: tuple[Parameter, ...]) -> None:
        self.known = known
        self._places = np.array([i for i, each in enumerate(known) if each.faulty > 0.0])
        self._faulty = variances(known, "faulty")[self._places]
        self._one_sided = np.array([known[i].one_sided for i in self._places])
        self._drifts = np.array([known[i].form is Form.DRIFT for i in self._places])
        self._priors = np.log([*(known[i].prior for i in self._places), UNKNOWN_PRIOR])

    def explain(self, evidence: Evidence, mean: Array, covariance: Array, span: float) -> Verdict:
        """Weigh all faults.

        Parameters
        ----------
        evidence : Evidence
        mean, covariance : ndarray
            Of the parameters while all was well.
        span : float
            Time (s) that the evidence has taken: what changes within less than `SLOWEST` is no drift.

        Returns
        -------
        Verdict
            How well each fault explains the evidence, and how large it would be.
        """
        from scipy.special import log_ndtr  # a twin that is well need not wait for it

        healthy = evidence.given(mean, covariance)
        matrix, vector = np.diag(healthy.matrix)[self._places], healthy.vector[self._places]
        spread = self._faulty / (1.0 + self._faulty * matrix)
        values, sigmas = spread * vector, np.sqrt(spread)
        fitted = vector * values
        factors = 0.5 * fitted - 0.5 * np.log1p(self._faulty * matrix)
        factors += np.where(self._one_sided, log_ndtr(values / sigmas) + log(2.0), 0.0)
        excess = max(1.0, (healthy.squares - float(fitted.max())) / max(healthy.rows, 1))
        weights = np.append(factors, healthy.unknown - healthy.log) / excess + self._priors
        weights[:-1][self._drifts & (span < SLOWEST)] = -np.inf
        shares = np.exp(weights - weights.max())
        found = [Explanation(int(p), *each) for p, *each in zip(self._places, factors, values, sigmas, strict=True)]
        found.append(Explanation(None, healthy.unknown - healthy.log))
        return Verdict(self._grouped(found, shares / shares.sum()), excess)

    def _grouped(self, found: list[Explanation], shares: Array) -> tuple[Cause, ...]:
        groups: dict[str, list[int]] = {}
        for i in np.argsort(-shares).tolist():
            place = found[i].place
            groups.setdefault(UNKNOWN if place is None else self.known[place].cause, []).append(i)
        causes = [Cause(name, float(shares[at].sum()), tuple(found[i] for i in at)) for name, at in groups.items()]
        return tuple(sorted(causes, key=lambda cause: -cause.probability))

    def support(self, evidence: Evidence, each: Explanation, mean: Array, covariance: Array) -> float:
        """ln of how much more probable `evidence` is with that fault, of the size that is estimated, than without any."""
        healthy = evidence.given(mean, covariance)
        if each.place is None:
            return healthy.unknown - healthy.log
        return float(each.value * (healthy.vector[each.place] - 0.5 * each.value * healthy.matrix[each.place, each.place]))


GATE = 4.5  # deviations
STRAYED = 5.0  # deviations of the prior
LEAST = 1e-3  # of the prior's variance, what must have been learnt for that


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
        self.restart()

    def restart(self) -> None:
        """Know no more than before anything was measured."""
        self.mean, self.covariance = self._prior

    @property
    def has_strayed(self) -> bool:
        """Whether what was learnt bit by bit is, all together, more than healthy parameters may be off by."""
        mean, covariance = self._prior
        learnt = np.diag(covariance) - np.diag(self.covariance)
        return bool(np.any((self.mean - mean) ** 2 > STRAYED**2 * np.maximum(learnt, LEAST * np.diag(covariance))))

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
        signature = white[:, 1:]
        gain = signature @ self.covariance
        root = np.linalg.cholesky(gain @ signature.T + np.eye(len(white)))
        step = np.linalg.solve(root, np.column_stack([white[:, 0] - signature @ self.mean, gain]))
        left = step[:, 0]
        if learn and np.abs(left).max() < GATE:
            self.mean = self.mean + step[:, 1:].T @ left
            self.covariance = self.covariance - step[:, 1:].T @ step[:, 1:]
        return left, float(np.log(np.diag(root)).sum())
