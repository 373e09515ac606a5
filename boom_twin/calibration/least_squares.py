"""Nonlinear least squares with priors, and the unknowns that the sessions can tell apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, lsq_linear

from ..deviation.load_spectrum import TipLoad
from ..errors import BoomTwinError
from ..scene.kinematics import strokes_of_posture
from ..types import Array
from .forward_model import CalibrationProblem
from .noise_model import NoiseModel, ResidualBlocks, whitening_of
from .sessions import SessionCourse

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
    whitening : NoiseModel
    load : TipLoad or None
        The unknown load at the tip that was taken into account.
    """

    deviations: Array
    information: Array
    scatter: Array
    misfit: float
    passes: int
    whitening: NoiseModel
    load: TipLoad | None = None

    def covariance(self, more: Array | float = 0.0) -> Array:
        """Return the covariance of the deviations, with the priors, and with `more` information.

        Variances are at least those for white noise, because few realisations may underestimate them.
        """
        spread, prior = max(1.0, self.misfit) ** 2, np.eye(len(self.deviations))
        white = np.linalg.inv(self._precision(more))
        found = white @ ((self.scatter + more) / spread + prior) @ white
        factors = np.sqrt(np.maximum(1.0, np.diag(white) / np.diag(found)))
        return np.asarray(factors[:, None] * found * factors)

    def _precision(self, more: Array | float = 0.0) -> Array:
        """Return the inverse of the covariance (p, p) for white noise, with the priors."""
        return np.asarray((self.information + more) / max(1.0, self.misfit) ** 2 + np.eye(len(self.deviations)))

    def without(self, left_out: Sequence[int], least: Array) -> Array:
        """Return the deviations (p,) of at least `least` (p,) that fit best where those in places `left_out` stay 0.

        What was fitted together cannot be taken apart: a zero that makes up for another's would be wrong without that.
        """
        fixed = np.zeros(len(self.deviations), bool)
        fixed[list(left_out)] = True
        found, precision = np.where(fixed, 0.0, self.deviations), self._precision()
        if fixed.any() and not fixed.all():
            moved = precision[np.ix_(~fixed, fixed)] @ self.deviations[fixed]
            found[~fixed] += bounded_minimum(precision[np.ix_(~fixed, ~fixed)], moved, (least - found)[~fixed])
        return found


def bounded_minimum(precision: Array, pull: Array, least: Array) -> Array:
    """Return the x >= `least` that minimises x^T `precision` x / 2 - `pull`^T x; shapes (p, p), (p,), (p,)."""
    root = np.linalg.cholesky(precision)
    return np.asarray(lsq_linear(root.T, np.linalg.solve(root, pull), (least, np.inf), "bvls").x)


def fitted(problem: CalibrationProblem, tell: Tell) -> Fit:
    """Return the fit by least squares; `tell` is called before every pass over the sessions.

    A wrong stiffness gives a wrong natural frequency. After some periods the predicted vibration is out of phase with the
    measured one, and least squares do not converge. So the means over rest periods are fitted first, as equilibria. The noise
    excites the natural frequencies too. Its realisations are therefore made anew at the first estimate, and the fit is
    repeated.
    """
    deviations, passes = fitted_in_holds(problem), 0
    for _ in range(ROUNDS):
        noise = problem.noise(deviations)
        whitening = whitening_of([each[::2] for each in noise], problem.length)

        def moving(deviations: Array, whitening: NoiseModel = whitening) -> tuple[Array, Array]:
            tell()
            return problem.moving(deviations, whitening)

        deviations, more = _minimised(moving, deviations, problem.least)
        passes += more
    residuals, slopes = problem.moving(deviations, whitening)
    freedom = max(int(np.count_nonzero(residuals)) - len(deviations), 1)
    misfit = float(np.sqrt(np.sum(residuals**2) / freedom))
    return Fit(deviations, slopes.T @ slopes, _scatter(noise, whitening, slopes), misfit, passes, whitening)


def fitted_in_holds(problem: CalibrationProblem) -> Array:
    """Return the deviations that fit the means over rest periods."""
    return _minimised(_in_holds(problem), problem.start, problem.least)[0]


def _scatter(noise: list[Array], whitening: NoiseModel, slopes: Array) -> Array:
    """Return the covariance of J^T w over realisations that the filter was not made from.

    Sessions are independent, so their covariances add up.
    """
    found, first = np.zeros((slopes.shape[1], slopes.shape[1])), 0
    for each in noise:
        white = whitening(each[1::2]).reshape(len(each[1::2]), -1)
        pulls = white @ slopes[first : first + white.shape[1]]
        found += pulls.T @ pulls / len(pulls)
        first += white.shape[1]
    return found


def _in_holds(problem: CalibrationProblem) -> Evaluate:
    """Return the function for the residuals of means over rest periods and their derivatives.

    Both are in standard deviations of single samples.
    """
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


def _holds(course: SessionCourse, blocks: ResidualBlocks) -> list[tuple[Array, Array]]:
    """Return the means of strokes and of readings over rest periods, in order."""
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
    """Return the deviations of least squares with the priors, and the number of evaluations."""
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


TOGETHER = 0.7  # correlation from which on two unknowns count as one group
MORE = 10.0  # s of a hold in another posture
HELPS = 0.5  # of the deviation left, from which on a posture is worth the way


@dataclass(frozen=True)
class InseparableUnknowns:
    """Unknowns that the sessions cannot tell apart or determine.

    Attributes
    ----------
    names : tuple of str
        One alone: the sessions do not show it.
    posture : str or None
        A posture of the scene in which a hold would tell them apart.
    enough : bool
        Whether it would do so fully.
    """

    names: tuple[str, ...]
    posture: str | None = None
    enough: bool = False

    def __str__(self) -> str:
        what = f"{self.names[0]}: these sessions do not show it" if len(self.names) == 1 else (
            f"{', '.join(self.names)}: these sessions cannot tell them apart"
        )  # fmt: skip
        if self.posture is None:
            return f"{what}; none of the scene's postures would. Left as before."
        verb = "would" if self.enough else "would help to"
        return f"{what}; a hold of {MORE:g} s in posture {self.posture} {verb}. Left as before."


def groups_of(problem: CalibrationProblem, fit: Fit) -> list[InseparableUnknowns]:
    """Return groups of unknowns with estimates too uncertain to be of use; a group holds those that are confused."""
    covariance = fit.covariance()
    spread = np.sqrt(np.diag(covariance))
    vague = spread > _useful(problem)
    tied = np.abs(covariance) > TOGETHER * np.outer(spread, spread)
    groups, left = [], set(np.flatnonzero(vague).tolist())
    while left:
        group: set[int] = set()
        grown = {min(left)}
        while grown != group:
            group, grown = grown, grown | set(np.flatnonzero(tied[sorted(grown)].any(axis=0) & vague).tolist())
        left -= group
        groups.append(_with_posture(problem, fit, sorted(group)))
    return groups


def _useful(problem: CalibrationProblem) -> Array:
    """Return the largest standard deviations of useful estimates, in units of the priors'."""
    return np.array([unknown.kind.useful / unknown.kind.prior for unknown in problem.unknowns])


def _with_posture(problem: CalibrationProblem, fit: Fit, group: list[int]) -> InseparableUnknowns:
    """Return the group with the posture that reduces its uncertainty most."""
    names, useful = tuple(problem.unknowns[i].name for i in group), _useful(problem)

    def left(more: Array | float) -> float:
        return float(np.max((np.sqrt(np.diag(fit.covariance(more))) / useful)[group]))

    found = {posture: left(more) for posture, more in _in_postures(problem, fit).items()}
    best = min(found, key=lambda posture: found[posture], default=None)
    if best is None or found[best] > max(1.0, HELPS * left(0.0)):
        return InseparableUnknowns(names)
    return InseparableUnknowns(names, best, found[best] <= 1.0)


def _in_postures(problem: CalibrationProblem, fit: Fit) -> dict[str, Array]:
    """Return the information (p, p) that a rest period in each of the scene's postures would add.

    Postures out of reach are left out.
    """
    found = {}
    for posture in problem.scene.postures or {}:
        try:
            _, slopes = problem.resting(fit.deviations, strokes_of_posture(problem.scene, posture)[None])
        except BoomTwinError:
            continue
        white = fit.whitening.of_constant(slopes[:, 0])
        found[posture] = MORE / problem.length * white @ white.T
    return found
