"""Nonlinear least squares of the unknowns, with what is likely before as one more measurement of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ..records import Array
from .blocks import Blocks
from .course import Course
from .problem import Problem
from .whitening import Whitening, whitening_of

MOST = 12  # evaluations of a round
ROUNDS = 2
ENOUGH = 1e-5  # relative change of the sum of squares, and of the unknowns
HOLD, STILL = 1.0, 1e-3  # a hold of so long (s), in which no stroke moves by more (m)
HOLDS = 40  # most that are looked at

Tell = Callable[[], None]
Evaluate = Callable[[Array], tuple[Array, Array]]


@dataclass(frozen=True)
class Fit:
    """Result of a fit; deviations are in units of the priors'.

    Attributes
    ----------
    deviations : ndarray, shape (p,)
        Of the unknowns from their present values.
    information : ndarray, shape (p, p)
        J^T J of the white residuals: the inverse of their covariance if these were white indeed.
    scatter : ndarray, shape (p, p)
        Covariance of J^T w over realisations w of the white noise, which is `information` for noise that is.
    misfit : float
        Root mean square of the white residuals, 1 where noise alone is left; what is above 1 counts as noise.
    passes : int
    whitening : Whitening
    """

    deviations: Array
    information: Array
    scatter: Array
    misfit: float
    passes: int
    whitening: Whitening

    def covariance(self, more: Array | float = 0.0) -> Array:
        """Of the deviations, with the priors, and with `more` information.

        None is smaller than white noise would give: few realisations may happen to pull little.
        """
        spread, prior = max(1.0, self.misfit) ** 2, np.eye(len(self.deviations))
        white = np.linalg.inv((self.information + more) / spread + prior)
        found = white @ ((self.scatter + more) / spread + prior) @ white
        factors = np.sqrt(np.maximum(1.0, np.diag(white) / np.diag(found)))
        return np.asarray(factors[:, None] * found * factors)


def fitted(problem: Problem, tell: Tell) -> Fit:
    """Minimise; `tell` is called before every pass over the sessions.

    A stiffness that is wrong makes the boom swing at a wrong frequency, and after some swings measured and predicted ones are
    out of step, from where least squares do not find back. So the means over holds are fitted first, as equilibria. The noise
    rings at the boom's frequencies, too: it is made anew at the first estimate of the swinging boom, and the fit repeated.
    """
    least = np.array([unknown.least for unknown in problem.unknowns])
    deviations, _ = _minimised(_in_holds(problem), problem.start, least)
    passes = 0
    for _ in range(ROUNDS):
        noise = problem.noise(deviations)
        whitening = whitening_of([each[::2] for each in noise], problem.length)

        def moving(deviations: Array, whitening: Whitening = whitening) -> tuple[Array, Array]:
            tell()
            return problem.moving(deviations, whitening)

        deviations, more = _minimised(moving, deviations, least)
        passes += more
    residuals, slopes = problem.moving(deviations, whitening)
    freedom = max(int(np.count_nonzero(residuals)) - len(deviations), 1)
    misfit = float(np.sqrt(np.sum(residuals**2) / freedom))
    return Fit(deviations, slopes.T @ slopes, _scatter(noise, whitening, slopes), misfit, passes, whitening)


def _scatter(noise: list[Array], whitening: Whitening, slopes: Array) -> Array:
    """Covariance of J^T w over realisations that the filter was not made from; sessions are independent, so theirs add up."""
    found, first = np.zeros((slopes.shape[1], slopes.shape[1])), 0
    for each in noise:
        white = whitening(each[1::2]).reshape(len(each[1::2]), -1)
        pulls = white @ slopes[first : first + white.shape[1]]
        found += pulls.T @ pulls / len(pulls)
        first += white.shape[1]
    return found


def _in_holds(problem: Problem) -> Evaluate:
    """Residuals of the means over holds and their derivatives, in deviations of single samples."""
    found = [hold for course, blocks in problem.parts for hold in _holds(course, blocks)]
    found = found[:: 1 + len(found) // HOLDS]
    if not found:
        return lambda deviations: (np.zeros(0), np.zeros((0, len(deviations))))
    strokes, measured = (np.array(each) for each in zip(*found, strict=True))

    def evaluate(deviations: Array) -> tuple[Array, Array]:
        predicted, slopes = problem.resting(deviations, strokes)
        left = (measured[:, problem.used] - predicted) / problem.deviations
        known = np.isfinite(left)
        return left[known], -(slopes / problem.deviations)[:, known].T

    return evaluate


def _holds(course: Course, blocks: Blocks) -> list[tuple[Array, Array]]:
    """Means of strokes and of readings over holds, one after the other."""
    length = float(blocks.times[1] - blocks.times[0])
    group = max(1, round(HOLD / length))
    rows = round(group * length / course.step)
    found = []
    for number in range(len(blocks.times) // group):
        part = course.strokes[number * rows : (number + 1) * rows]
        if np.ptp(part, axis=0).max() < STILL:
            found.append((part.mean(axis=0), blocks.measured[number * group : (number + 1) * group].mean(axis=0)))
    return found


def _minimised(evaluate: Evaluate, start: Array, least: Array) -> tuple[Array, int]:
    """Deviations of least squares with the priors, and evaluations that they took."""
    known: dict[bytes, tuple[Array, Array]] = {}

    def both(deviations: Array) -> tuple[Array, Array]:
        key = deviations.tobytes()
        if key not in known:
            known.clear()
            residuals, slopes = evaluate(deviations)
            known[key] = np.concatenate([residuals, deviations]), np.concatenate([slopes, np.eye(len(deviations))])
        return known[key]

    found = least_squares(
        lambda x: both(x)[0], start, lambda x: both(x)[1], (least, np.inf), "dogbox", ENOUGH, ENOUGH, None, max_nfev=MOST
    )
    return found.x, int(found.nfev)
