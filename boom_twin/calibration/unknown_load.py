"""Calibration under an unknown load at the tip: prediction-error estimates with the load as a nuisance.

The innovations v of the filter in `load_filter` depend on the parameters, by the prediction and by the modes alike. They are
uncorrelated with what came before, so their derivatives by the parameters, which are functions of what came before, have no
part in them where the parameters are right: sum v dv / s = 0 (Ljung, System Identification, 1999, ch. 7), solved by
Gauss-Newton steps. That holds where the innovations are white, so a load that is taken to be livelier than it is, or noise that
is not there, pulls the parameters: between its jumps the load has the rates of the greatest likelihood.

A payload m and a load f push alike: m a and -f. What tells them apart is that the load is steady, so nothing may be taken to be
known of the load while it changes: a pump's flanks keep step with the swings that the pump has made before. Where the load,
first estimated by a filter that lets it move freely, jumps, its part that stays is set free (`LoadPrior.jumps`).

Covariances are those of the sums over spans of `SPAN`, so that they hold for errors that are not white, too (White, 1982).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import NamedTuple

import numpy as np

from ..deviation.load_spectrum import TipLoad, TipLoadFinder
from ..errors import SolverError
from ..scene.schema import Scene
from ..scene.summary import weight_of
from ..system.cores import usable_cores
from ..types import NANO, Array
from .forward_model import CalibrationProblem, ForwardModel, boom_of
from .least_squares import Fit, Tell, bounded_minimum, fitted_in_holds
from .load_filter import Innovations, LoadPrior, filter_model, gained_variance, innovations, stroke_error, tilted
from .load_modes import PosturePath, modes_along, posture_path
from .noise_model import ResidualBlocks
from .sessions import SessionCourse

LENGTH, SAMPLES = 0.005, 1.0  # s, of the blocks at least, and samples in them: means over more of them flatten fast swings
FREE = 0.044  # a load that is let free: what it is likely to change by in a second, over the boom's weight
QUIET = 0.001  # likewise between its jumps, at first
GUSTS = 0.03  # root mean square of a load without pulses, over the boom's weight, up to which it may be wind
STAYS = 0.06  # standard deviation of what stays of it, over the boom's weight
FINER, FURTHER = (4.0, 2.0), 4  # factors by which the rates of the quiet load are looked at, and how often in a row
FLANK = 0.1  # s, over which changes of the load are looked at
FREER = 100.0  # times as free as it was let: where it jumps
JUMP = 4.0  # of these changes' usual size: a jump
TRIAL = 0.02  # of a prior deviation, for derivatives
FURTHEST = 0.7  # prior deviations in one step
FIRST, NEAR = 4, 1.0  # most steps with the load let free, and the step (in deviations of the estimate) that is the last one
ROUNDS, GUESSED = 5, 3  # of looking for the load's jumps, a step each; of these, with guessed rates
LAST, SMALL = 5, 0.05  # likewise of the steps after these
SPAN = 1.0  # s
WIDER = 2.0  # by which intervals are wider than that: the load's spectrum is not quite the one taken, see docs/calibrate.md


class _Part(NamedTuple):
    """Part of one session that is used."""

    course: SessionCourse
    blocks: ResidualBlocks
    path: PosturePath


Run = Callable[[LoadPrior, Array], Innovations]
"""Filter of one session, a function of the load prior and of columns of residuals (b, j, c)."""


class Pass(NamedTuple):
    """Results of one session at a trial: white residuals (b, c), their derivatives (p, b, c), and the load (b, 2), N."""

    white: Array
    slopes: Array
    loads: Array


def fitted_under_load(problem: CalibrationProblem, quiet: Fit, tell: Tell) -> Fit:
    """Return the fit with an unknown load.

    Parameters
    ----------
    problem : CalibrationProblem
        With blocks of `LENGTH` or little longer.
    quiet : Fit
        That without.
    tell : callable
        Called before every pass over the sessions.

    Raises
    ------
    SolverError
        The filter has no usable numbers for this boom, as for a single stiff section.
    """
    weight, count = weight_of(problem.scene), 0
    parts = [_Part(*part, posture_path(problem.scene, part[0])) for part in problem.parts]
    passes: list[Pass] = []

    def stepped(deviations: Array, runs: Sequence[Run], priors: Sequence[LoadPrior], anew: bool) -> tuple[Array, float]:
        nonlocal count, passes
        tell()
        passes, count = _passes(problem, parts, deviations, runs, priors, None if anew else passes), count + 1
        return _after_step(problem, passes, deviations)

    free = LoadPrior(np.full(2, (FREE * weight) ** 2), STAYS * weight)
    rates, deviations = np.full(2, (QUIET * weight) ** 2), fitted_in_holds(problem)
    for _ in range(FIRST):
        deviations, size = stepped(deviations, _runs(problem, parts, deviations), [free] * len(parts), True)
        if size < NEAR:
            break
    for number in range(ROUNDS):
        runs = _runs(problem, parts, deviations)
        priors = _likely_priors(problem, parts, deviations, runs, free, rates, number >= GUESSED)
        rates = priors[0].rates
        deviations, _ = stepped(deviations, runs, priors, number in (0, GUESSED))
    for number in range(LAST):
        deviations, size = stepped(deviations, _runs(problem, parts, deviations), priors, number == 0)
        if size < SMALL:
            break
    measured = sum(int(np.count_nonzero(each.white)) for each in passes)
    misfit = float(np.sqrt(sum(np.sum(each.white**2) for each in passes) / max(measured - len(deviations), 1)))
    scatter = WIDER**2 * _scatter(passes, round(SPAN / problem.length))
    passed, load = quiet.passes + count, _load(problem, passes)
    return Fit(deviations, _information(passes), scatter, misfit, passed, quiet.whitening, load)


def is_plausible(load: TipLoad | None, scene: Scene) -> bool:
    """Return True if the load has pulses or is no larger than wind, or if there is none.

    A drifting encoder looks like a large load that wanders.
    """
    if load is None or load.pulses is not None:
        return True
    return load.rms <= GUSTS * weight_of(scene)


def _after_step(problem: CalibrationProblem, passes: Sequence[Pass], deviations: Array) -> tuple[Array, float]:
    """Return the deviations after a step of Gauss and Newton, and its full length in deviations of the estimate."""
    information = _information(passes) + np.eye(len(deviations))
    pull = -deviations - sum(np.einsum("pbc,bc->p", each.slopes, each.white) for each in passes)
    step = bounded_minimum(information, pull, problem.least - deviations)
    size = float(np.sqrt(step @ information @ step / len(step)))
    shorter = min(1.0, FURTHEST / max(float(np.abs(step).max()), 1e-12))
    return deviations + shorter * step, size


def _information(passes: Sequence[Pass]) -> Array:
    return np.asarray(sum(np.einsum("pbc,qbc->pq", each.slopes, each.slopes) for each in passes))


def _scatter(passes: Sequence[Pass], span: int) -> Array:
    """Return the covariance of the sums that must vanish, from sums over spans of `span` blocks."""
    found = np.zeros((len(passes[0].slopes),) * 2)
    for each in passes:
        pulls = np.einsum("pbc,bc->bp", each.slopes, each.white)
        sums = np.add.reduceat(pulls, np.arange(0, len(pulls), span))
        found += sums.T @ sums
    return found


def _jumps(loads: Array, length: float, free: LoadPrior) -> Array:
    """Return the variance that the load gains at every block, shape (b, 2), N^2.

    It is far more than under `free` where the load jumps, else 0.
    """
    half = round(0.5 * FLANK / length)
    change = np.zeros(loads.shape)
    change[half:-half] = np.abs(loads[2 * half :] - loads[: -2 * half])
    is_jump = change > JUMP * 1.4826 * np.median(change, axis=0)
    near = np.array([np.convolve(column, np.ones(2 * half + 1), "same") > 0.5 for column in is_jump.T]).T
    return near * FREER * free.rates * length


def _load(problem: CalibrationProblem, passes: Sequence[Pass]) -> TipLoad | None:
    """Return size and frequency of the varying part of the load, from consecutive sessions.

    The constant part cannot be told from weight and zeros.
    """
    finder = TipLoadFinder()
    for (course, blocks), each in zip(problem.parts, passes, strict=True):
        finder.add(course.start + np.round(blocks.times / NANO).astype(np.int64), each.loads - each.loads.mean(axis=0))
    return finder.load


def _run(problem: CalibrationProblem, boom: Scene, part: _Part) -> Run:
    """Return the filter of one session of `boom`."""
    course, blocks, path = part
    modes = modes_along(boom, path)
    rows = np.clip(np.rint(blocks.times / course.step).astype(int), 0, len(path.places) - 1)
    places, paces = path.places[rows], np.gradient(path.places, course.step)[rows]
    noise = problem.deviations**2 / np.maximum(blocks.counts[:, problem.used], 1.0)
    strokes = stroke_error(problem.stroke_variance, course)
    tilts = tilted(blocks.measured, course.strokes.shape[1])[:, problem.used]

    def run(prior: LoadPrior, columns: Array) -> Innovations:
        model = filter_model(modes, problem.used, strokes.corner, prior, problem.length)
        gained = gained_variance(model, prior, strokes, course.moving[rows], problem.length)
        return innovations(model, places, paces, noise, gained, tilts, columns)

    return run


def _runs(problem: CalibrationProblem, parts: Sequence[_Part], deviations: Array) -> list[Run]:
    boom = boom_of(problem.scene, problem.values(deviations))
    return [_run(problem, boom, part) for part in parts]


def _likely_priors(
    problem: CalibrationProblem, parts: Sequence[_Part], deviations: Array, runs: Sequence[Run],
    free: LoadPrior, rates: Array, seek: bool,
) -> list[LoadPrior]:  # fmt: skip
    """Return the load priors of every session at a trial: jumps, and rates between them.

    Jumps are those of the load that the filter estimates under the prior `free`. Rates are `rates`, or if `seek` those of the
    greatest likelihood, sought from `rates` on.
    """
    sessions = []
    for part, run in zip(parts, runs, strict=True):
        left = problem.left(deviations, part.course, part.blocks)[:, None]
        sessions.append((run, left, _jumps(run(free, left).loads, problem.length, free)))

    def priors(rates: Array) -> list[LoadPrior]:
        return [LoadPrior(rates, free.constant, jumps) for _, _, jumps in sessions]

    if not seek:
        return priors(rates)

    def misfit(rates: Array) -> float:
        total = 0.0
        for (run, left, _), prior in zip(sessions, priors(rates), strict=True):
            values, variances, _ = run(prior, left)
            total += float(np.sum(np.log(variances) + values[:, 0] ** 2 / variances))
        return total

    found, least = rates, misfit(rates)
    for factor in FINER:
        for axis, way in product(range(2), (factor, 1.0 / factor)):
            for _ in range(FURTHER):
                trial = found.copy()
                trial[axis] *= way
                if (value := misfit(trial)) >= least:
                    break
                found, least = trial, value
    return priors(found)


def _passes(
    problem: CalibrationProblem, parts: Sequence[_Part], deviations: Array, runs: Sequence[Run],
    priors: Sequence[LoadPrior], kept: Sequence[Pass] | None,
) -> list[Pass]:  # fmt: skip
    """Return the passes of every session at a trial, with new derivatives or with those of `kept`.

    Any derivatives that depend on the past alone will do.
    """
    if kept is not None:
        return [
            before._replace(white=_white(found)[:, 0], loads=found.loads)
            for part, run, prior, before in zip(parts, runs, priors, kept, strict=True)
            for found in [run(prior, problem.left(deviations, part.course, part.blocks)[:, None])]
        ]
    forward, booms = ForwardModel(problem.scene, problem.trials(deviations)), problem.booms(deviations, TRIAL)
    return [
        _pass(
            problem, part, run, prior, problem.with_slopes(part.blocks.averaged(forward.move(part.course)), deviations), booms
        )
        for part, run, prior in zip(parts, runs, priors, strict=True)
    ]


def _checked(found: Innovations) -> Innovations:
    """Return the innovations; raise SolverError if they are not finite or a variance is not positive."""
    if not (np.isfinite(found.values).all() and (found.variances > 0.0).all()):
        raise SolverError("the filter of the unknown load lost its digits on this boom.")
    return found


def _white(found: Innovations) -> Array:
    """Return the innovations in their standard deviations, (b, j, c)."""
    return np.asarray(_checked(found).values / np.sqrt(found.variances)[:, None])


def _pass(
    problem: CalibrationProblem,
    part: _Part,
    run: Run,
    prior: LoadPrior,
    predicted: tuple[Array, Array],
    booms: Mapping[int | None, Scene],
) -> Pass:
    """Return the pass of one session at a trial.

    Parameters
    ----------
    run : callable
        Of the boom itself.
    predicted : ndarray, shape (b, c) and (p, b, c)
        With its derivatives.
    booms : mapping of int or None to Scene
        See `CalibrationProblem.booms`.
    """
    expected, slopes = predicted
    left = part.blocks.measured[:, problem.used] - expected
    others = [i for i in range(len(slopes)) if i not in booms]
    found = run(prior, np.stack([left, *-slopes[others]], axis=1))
    values, all_white = found.values[:, 0], _white(found)
    white, root = np.empty(slopes.shape), np.sqrt(found.variances)
    white[others] = all_white[:, 1:].swapaxes(0, 1)

    def moved(i: int) -> Array:
        other = _checked(_run(problem, booms[i], part)(prior, (left - TRIAL * slopes[i])[:, None]))
        return (other.values[:, 0] - values) / (TRIAL * root)

    acting = [i for i in booms if i is not None]
    with ThreadPoolExecutor(usable_cores()) as pool:
        for i, slope in zip(acting, pool.map(moved, acting), strict=True):
            white[i] = slope
    return Pass(all_white[:, 0], white, found.loads)
