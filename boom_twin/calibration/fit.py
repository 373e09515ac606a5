"""Maximum-likelihood estimate of the unknowns, its covariance, and the unknowns that sessions cannot tell apart.

The innovations e of a Kalman filter with variances S have the log likelihood -sum (e^2 / S + log S) / 2. Scoring (Gauss-Newton
with the Fisher information of both) finds its maximum with the priors. The covariance is H^-1 J H^-1 (H. White, Econometrica 50
(1982), 1-25), J from sums of the score over blocks, so that it holds for innovations that are not white; and it allows for
parameters that are taken to be known but may be wrong (consider covariance; B. Tapley et al., Statistical Orbit Determination,
ch. 6).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from ..types import Array
from .problem import CalibrationProblem, Noise, likelihood_cost
from .unknowns import Unknown

MOST = 12  # passes
HALVINGS = 5  # of a step that makes the fit worse
LARGEST = 1.0  # standard deviations of the prior, of a step
ENOUGH = 0.1  # standard deviations of the estimate, of a step
NEAR = 1.0  # standard deviations of the estimate, of a step, from which on the noise is no more learnt


@dataclass(frozen=True)
class Fit:
    """Result of a fit; deviations of p unknowns are in units of the priors'."""

    deviations: Array  # (p,), of the unknowns from their present values
    information: Array  # (p, p), Fisher's, without the priors
    scatter: Array  # (p, p), covariance of the score, from blocks of readings
    pull: Array  # (p,), score and pull of the priors that are left; 0 but where a bound stops the fit
    by_model: Array  # (p, q), change of the score by parameters taken to be known, by the deviation that they may be wrong by
    misfits: Array  # (c,), rms of each channel's normalised innovations with the stated noise; 1: noise alone, or no readings
    passes: int

    @property
    def precision(self) -> Array:
        """Information with that of the priors, (p, p)."""
        return np.asarray(self.information + np.eye(len(self.deviations)))

    def covariance(self) -> Array:
        """Return the covariance of the deviations, (p, p); variances are at least those for white innovations."""
        white = np.linalg.inv(self.precision)
        found = white @ (self.scatter + np.eye(len(white))) @ white
        factors = np.sqrt(np.maximum(1.0, np.diag(white) / np.diag(found)))
        shifts = white @ self.by_model
        return np.asarray(factors[:, None] * found * factors + shifts @ shifts.T)

    def without(self, left_out: Sequence[int], least: Array) -> Array:
        """Return the deviations (p,) of at least `least` (p,) that fit best where those in places `left_out` stay 0.

        What was fitted together cannot be taken apart: a zero that makes up for another's would be wrong without that.
        """
        fixed = np.zeros(len(self.deviations), bool)
        fixed[list(left_out)] = True
        found = np.where(fixed, 0.0, self.deviations)
        if fixed.any() and not fixed.all():
            moved = self.precision[np.ix_(~fixed, fixed)] @ self.deviations[fixed]
            found[~fixed] += bounded_minimum(self.precision[np.ix_(~fixed, ~fixed)], moved, (least - found)[~fixed])
        return found


def bounded_minimum(precision: Array, pull: Array, least: Array) -> Array:
    """Return the x >= `least` that minimises x^T `precision` x / 2 - `pull`^T x; shapes (p, p), (p,), (p,)."""
    root = np.linalg.cholesky(precision)
    return np.asarray(lsq_linear(root.T, np.linalg.solve(root, pull), (least, np.inf), "bvls").x)


def fitted(problem: CalibrationProblem, assumed: Sequence[Unknown], tell: Callable[[], None]) -> Fit:
    """Return the fit; `assumed` are parameters taken to be known, `tell` is called before every pass over the sessions."""
    at, stated, furthest, learning = problem.start(), problem.sensor_noise(), np.inf, True
    for passes in range(1, MOST + 1):
        tell()
        if learning:
            noise = problem.noise(at, stated)
        (base,) = problem.innovations([problem.values(at)], noise)
        slopes = problem.slopes(at, noise, base)
        score, information = _score(slopes, base)
        precision, pull = information + np.eye(len(at)), score.sum(axis=1) - at
        if furthest < ENOUGH or passes == MOST:
            break
        step = bounded_minimum(precision, pull, problem.least - at)
        step /= max(1.0, float(np.abs(step).max()) / LARGEST)
        step = _shortened(problem, at, step, noise, base)
        at, furthest = at + step, float((np.abs(step) / np.sqrt(np.diag(np.linalg.inv(precision)))).max())
        if learning and furthest < NEAR:
            noise = problem.noise(at, np.maximum(stated, stated * _mean_squares(problem, base)))
            learning = False
    sums = np.array([np.bincount(problem.blocks, row) for row in score])
    by_model = _together(slopes, problem.slopes_by_model(at, assumed, noise, base), base)
    misfits = np.sqrt(_mean_squares(problem, base) * noise.channels / stated)
    return Fit(at, information, sums @ sums.T, pull, by_model, misfits, passes)


def _shortened(problem: CalibrationProblem, at: Array, step: Array, noise: Noise, base: Array) -> Array:
    before = likelihood_cost(base) + 0.5 * at @ at
    for _ in range(HALVINGS):
        (found,) = problem.innovations([problem.values(at + step)], noise)
        if likelihood_cost(found) + 0.5 * (at + step) @ (at + step) <= before:
            break
        step = 0.5 * step
    return step


def _mean_squares(problem: CalibrationProblem, base: Array) -> Array:
    """Return the mean square of the normalised innovations of each channel; 1 for one without readings."""
    counts = np.bincount(problem.channels, minlength=len(problem.names))
    sums = np.bincount(problem.channels, base[:, 0] ** 2 / base[:, 1], len(problem.names))
    return np.asarray(np.where(counts > 0, sums / np.maximum(counts, 1), 1.0))


def _score(slopes: Array, base: Array) -> tuple[Array, Array]:
    innovation, variance = base.T
    by_innovation, by_variance = slopes[:, :, 0], slopes[:, :, 1] / variance
    excess = innovation**2 / variance - 1.0
    score = -by_innovation * (innovation / variance) + 0.5 * by_variance * excess
    return score, _together(slopes, slopes, base)


def _together(slopes: Array, others: Array, base: Array) -> Array:
    """Return the Fisher information of the parameters of `slopes` (p, r, 2) with those of `others` (q, r, 2), (p, q)."""
    variance = base[:, 1]
    innovations = (slopes[:, :, 0] / variance) @ others[:, :, 0].T
    return np.asarray(innovations + 0.5 * (slopes[:, :, 1] / variance**2) @ others[:, :, 1].T)


TOGETHER = 0.7  # correlation from which on two unknowns count as one group


@dataclass(frozen=True)
class InseparableUnknowns:
    """Unknowns that the sessions cannot tell apart or determine; one alone: the sessions do not show it."""

    names: tuple[str, ...]

    def __str__(self) -> str:
        what = f"{self.names[0]}: these sessions do not show it" if len(self.names) == 1 else (
            f"{', '.join(self.names)}: these sessions cannot tell them apart"
        )  # fmt: skip
        return f"{what}. Left as before. Record rests in other postures, after moves that make the boom swing."


def groups_of(problem: CalibrationProblem, fit: Fit) -> list[InseparableUnknowns]:
    """Return groups of unknowns with estimates too uncertain to be of use; a group holds those that are confused."""
    covariance = fit.covariance()
    spread = np.sqrt(np.diag(covariance))
    vague = spread > np.array([unknown.kind.useful / unknown.kind.prior for unknown in problem.unknowns])
    tied = np.abs(covariance) > TOGETHER * np.outer(spread, spread)
    groups, left = [], set(np.flatnonzero(vague).tolist())
    while left:
        group: set[int] = set()
        grown = {min(left)}
        while grown != group:
            group, grown = grown, grown | set(np.flatnonzero(tied[sorted(grown)].any(axis=0) & vague).tolist())
        left -= group
        groups.append(InseparableUnknowns(tuple(problem.unknowns[i].name for i in sorted(group))))
    return groups
