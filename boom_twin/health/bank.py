"""The bank of hypotheses: how well each fault explains what was measured since it began, and how large it then is.

Innovations are linear in the parameters, so all that they say is an information matrix L and a vector l. With the healthy
deviations of all parameters (mean m, covariance P) integrated out,

    L' = L (I + P L)^-1,   l' = (I + L P)^-1 (l - L m),

a fault with prior N(0, F) in some parameters f is more probable than none by the factor

    ln B = l_f^T (L_ff + F^-1)^-1 l_f / 2 - ln det(I + F L_ff) / 2,

and one that is unknown by the factor of a model whose errors are many times larger. (Gaussian model comparison; MacKay,
Information Theory, Inference, and Learning Algorithms, 2003, ch. 28.) What even the best explanation leaves is compared with
what noise leaves; where it is more, all logarithms are divided by the ratio, so that a model that is not quite right is not
quite sure.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log

import numpy as np
from scipy.special import log_ndtr

from ..records import Array
from .parameters import Hypothesis, Parameter, variances

UNKNOWN = "unknown"


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
        matrix, reduced = 0.5 * (matrix + matrix.T), np.asarray(reduced, float)
        return Evidence(matrix, reduced, self.squares - fitted, self.rows, log, self.unknown)


@dataclass(frozen=True)
class Explanation:
    """One hypothesis after the measurements.

    Attributes
    ----------
    cause : str
        `UNKNOWN` for none of the others.
    log_factor : float
        ln of how much more probable the measurements are than without a fault.
    fitted : float
        What it takes off the sum of squares.
    places : tuple of int
        Parameters that it has.
    values, sigmas : ndarray, shape (len(places),)
        Their estimates and deviations.
    """

    cause: str
    log_factor: float
    fitted: float
    places: tuple[int, ...]
    values: Array
    sigmas: Array


@dataclass(frozen=True)
class Verdict:
    """All hypotheses, the most probable first.

    Attributes
    ----------
    found : tuple of Explanation
    probabilities : ndarray, shape (len(found),)
        Of the explanations beside each other, given that there is a fault.
    excess : float
        Squares that the best explanation leaves over those that noise leaves, at least 1.
    """

    found: tuple[Explanation, ...]
    probabilities: Array
    excess: float

    @property
    def strength(self) -> float:
        """ln of how much more probable the best explanation is than no fault, with the excess taken into account."""
        return self.found[0].log_factor / self.excess


class Bank:
    """Explains evidence.

    Parameters
    ----------
    known : tuple of Parameter
    causes : tuple of Hypothesis
    """

    def __init__(self, known: tuple[Parameter, ...], causes: tuple[Hypothesis, ...]) -> None:
        self.known, self.causes = known, causes
        self._faulty = variances(known, "faulty")
        self._priors = {each.cause: log(each.prior) for each in causes} | {UNKNOWN: log(1e-2)}

    def explain(self, evidence: Evidence, mean: Array, covariance: Array) -> Verdict:
        """Weigh all hypotheses; `mean` and `covariance` are those of the parameters while all was well."""
        healthy = evidence.given(mean, covariance)
        found = [self._explain(each, healthy) for each in self.causes]
        left = healthy.squares - max(each.fitted for each in found)
        excess = max(1.0, left / max(healthy.rows, 1))
        empty = np.zeros(0)
        found.append(Explanation(UNKNOWN, healthy.unknown - healthy.log, 0.0, (), empty, empty))
        weights = np.array([each.log_factor / excess + self._priors[each.cause] for each in found])
        order = np.argsort(-weights)
        shares = np.exp(weights[order] - weights.max())
        return Verdict(tuple(found[i] for i in order), shares / shares.sum(), excess)

    def support(self, evidence: Evidence, each: Explanation, mean: Array, covariance: Array) -> float:
        """ln of how much more probable `evidence` is with that fault, of the size that is estimated, than without any."""
        healthy = evidence.given(mean, covariance)
        if each.cause == UNKNOWN:
            return healthy.unknown - healthy.log
        matrix, vector = healthy.matrix[np.ix_(each.places, each.places)], healthy.vector[list(each.places)]
        return float(vector @ each.values - 0.5 * each.values @ matrix @ each.values)

    def _explain(self, each: Hypothesis, healthy: Evidence) -> Explanation:
        places = list(each.places)
        matrix, vector = healthy.matrix[np.ix_(places, places)], healthy.vector[places]
        prior = self._faulty[places]
        spread = np.eye(len(places)) + matrix * prior
        posterior = prior[:, None] * np.linalg.inv(spread)
        values, sigmas = posterior @ vector, np.sqrt(np.diag(posterior))
        _, log_det = np.linalg.slogdet(spread)
        fitted = float(vector @ values)
        factor = 0.5 * fitted - 0.5 * float(log_det)
        if len(places) == 1 and self.known[places[0]].one_sided:
            factor += float(log_ndtr(values[0] / sigmas[0])) + log(2.0)
        return Explanation(each.cause, factor, fitted, each.places, values, sigmas)
