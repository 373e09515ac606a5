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

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import NamedTuple

import numpy as np

from ..errors import SolverError
from ..estimation.load_spectrum import TipLoad, TipLoadFinder
from ..scene.schema import Scene
from ..scene.summary import weight_of
from ..types import NANO, Array
from .forward_model import CalibrationProblem, ForwardModel, boom_of
from .least_squares import Fit, Tell, fitted_in_holds
from .load_filter import Innovations, LoadPrior, filter_model, gained_variance, innovations, stroke_error, tilted
from .load_modes import modes_along
from .noise_model import ResidualBlocks
from .sessions import SessionCourse

LENGTH, SAMPLES = 0.01, 1.5  # s, of the blocks at least, and samples in them on average
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
WIDER = 1.5  # by which intervals are wider than that: what swings longer is not seen in spans, see docs/calibrate.md


class Pass(NamedTuple):
    """One session at a trial: white residuals (b, c), their derivatives (p, b, c), and the load (b, 2), N."""

    white: Array
    slopes: Array
    loads: Array


def fitted_under_load(problem: CalibrationProblem, quiet: Fit, tell: Tell) -> Fit:
    """The fit with an unknown load.

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
    weight = weight_of(problem.scene)
    count = 0

    def stepped(deviations: Array, priors: Sequence[LoadPrior], most: int, enough: float) -> tuple[Array, list[Pass]]:
        nonlocal count
        for _ in range(most):
            tell()
            passes, count = _passes(problem, deviations, priors), count + 1
            deviations, size = _after_step(problem, passes, deviations)
            if size < enough:
                break
        return deviations, passes

    free = LoadPrior(np.full(2, (FREE * weight) ** 2), STAYS * weight)
    deviations, passes = stepped(fitted_in_holds(problem), [free] * len(problem.parts), FIRST, NEAR)
    rates = np.full(2, (QUIET * weight) ** 2)
    for number in range(ROUNDS):
        priors = _likely_priors(problem, deviations, free, rates, number >= GUESSED)
        rates = priors[0].rates
        deviations, passes = stepped(deviations, priors, 1, 0.0)
    deviations, passes = stepped(deviations, priors, LAST, SMALL)
    measured = sum(int(np.count_nonzero(each.white)) for each in passes)
    misfit = float(np.sqrt(sum(np.sum(each.white**2) for each in passes) / max(measured - len(deviations), 1)))
    scatter = WIDER**2 * _scatter(passes, round(SPAN / problem.length))
    passed, load = quiet.passes + count, _load(problem, passes)
    return Fit(deviations, _information(passes), scatter, misfit, passed, quiet.whitening, load)


def is_plausible(load: TipLoad | None, scene: Scene) -> bool:
    """Whether a load may be one: pulses, or no larger than wind. A drifting encoder looks like a large load that wanders."""
    if load is None or load.pulses is not None:
        return True
    return load.rms <= GUSTS * weight_of(scene)


def _after_step(problem: CalibrationProblem, passes: Sequence[Pass], deviations: Array) -> tuple[Array, float]:
    """Deviations after a step of Gauss and Newton, and how long it would be at its full length, in those of the estimate."""
    least = np.array([unknown.least for unknown in problem.unknowns])
    information = _information(passes) + np.eye(len(deviations))
    pull = -deviations - sum(np.einsum("pbc,bc->p", each.slopes, each.white) for each in passes)
    step = np.linalg.solve(information, pull)
    size = float(np.sqrt(step @ information @ step / len(step)))
    shorter = min(1.0, FURTHEST / max(float(np.abs(step).max()), 1e-12))
    return np.maximum(deviations + shorter * step, least), size


def _information(passes: Sequence[Pass]) -> Array:
    return np.asarray(sum(np.einsum("pbc,qbc->pq", each.slopes, each.slopes) for each in passes))


def _scatter(passes: Sequence[Pass], span: int) -> Array:
    """Covariance of the sums that are to vanish, from those over spans of so many blocks."""
    found = np.zeros((len(passes[0].slopes),) * 2)
    for each in passes:
        pulls = np.einsum("pbc,bc->bp", each.slopes, each.white)
        sums = np.add.reduceat(pulls, np.arange(0, len(pulls), span))
        found += sums.T @ sums
    return found


def _jumps(loads: Array, length: float, free: LoadPrior) -> Array:
    """Variance that the load gains at every block, shape (b, 2), N^2: far more than if let `free` where it jumps, else 0."""
    half = round(0.5 * FLANK / length)
    change = np.zeros(loads.shape)
    change[half:-half] = np.abs(loads[2 * half :] - loads[: -2 * half])
    is_jump = change > JUMP * 1.4826 * np.median(change, axis=0)
    near = np.array([np.convolve(column, np.ones(2 * half + 1), "same") > 0.5 for column in is_jump.T]).T
    return near * FREER * free.rates * length


def _load(problem: CalibrationProblem, passes: Sequence[Pass]) -> TipLoad | None:
    """Size and frequency of what varies of the load, from the sessions on end; what stays is not told from weight and zeros."""
    finder = TipLoadFinder()
    for (course, blocks), each in zip(problem.parts, passes, strict=True):
        finder.add(course.start + np.round(blocks.times / NANO).astype(np.int64), each.loads - each.loads.mean(axis=0))
    return finder.load


def _filter(
    problem: CalibrationProblem, boom: Scene, course: SessionCourse, blocks: ResidualBlocks
) -> Callable[[LoadPrior, Array], Innovations]:
    """Innovations of columns of residuals (b, j, c) of one session of `boom`, given what is known of the load."""
    modes, along = modes_along(boom, course)
    rows = np.clip(np.rint(blocks.times / course.step).astype(int), 0, len(along) - 1)
    noise = problem.deviations**2 / np.maximum(blocks.counts[:, problem.used], 1.0)
    strokes = stroke_error(problem.stroke_variance, course)
    tilts = tilted(blocks.measured, course.strokes.shape[1])[:, problem.used]

    def run(prior: LoadPrior, columns: Array) -> Innovations:
        model = filter_model(modes, problem.used, strokes.corner, prior, problem.length)
        gained = gained_variance(model, prior, strokes, course.moving[rows], problem.length)
        return innovations(model, along[rows], noise, gained, tilts, columns)

    return run


def _likely_priors(
    problem: CalibrationProblem, deviations: Array, free: LoadPrior, rates: Array, seek: bool
) -> list[LoadPrior]:
    """What is known of the load in every session at a trial: its jumps, and rates of the greatest likelihood between them.

    Jumps are those of the load that a filter finds which lets it move freely; rates are `rates`, or sought from there on.
    """
    boom, sessions = boom_of(problem.scene, problem.values(deviations)), []
    for course, blocks in problem.parts:
        run, left = _filter(problem, boom, course, blocks), problem.left(deviations, course, blocks)[:, None]
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


def _passes(problem: CalibrationProblem, deviations: Array, priors: Sequence[LoadPrior]) -> list[Pass]:
    """Every session at a trial."""
    forward, booms = ForwardModel(problem.scene, problem.trials(deviations)), problem.booms(deviations, TRIAL)
    return [_pass(problem, forward, booms, deviations, *part, prior) for part, prior in zip(problem.parts, priors, strict=True)]


def _pass(
    problem: CalibrationProblem,
    forward: ForwardModel,
    booms: Mapping[int | None, Scene],
    deviations: Array,
    course: SessionCourse,
    blocks: ResidualBlocks,
    prior: LoadPrior,
) -> Pass:
    """One session at a trial.

    Parameters
    ----------
    booms : mapping of int or None to Scene
        See `CalibrationProblem.booms`.
    """
    predicted, slopes = problem.with_slopes(blocks.averaged(forward.move(course)), deviations)
    left = blocks.measured[:, problem.used] - predicted
    others = [i for i in range(len(slopes)) if i not in booms]

    def run(moved: int | None) -> Innovations:
        columns = [left, *-slopes[others]] if moved is None else [left - TRIAL * slopes[moved]]
        return _filter(problem, booms[moved], course, blocks)(prior, np.stack(columns, axis=1))

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        found = dict(zip(booms, pool.map(run, booms), strict=True))
    values, variances, loads = found[None]
    white = np.empty(slopes.shape)
    white[others] = values[:, 1:].swapaxes(0, 1)
    for i, other in found.items():
        if i is not None:
            white[i] = (other.values[:, 0] - values[:, 0]) / TRIAL
    if not (np.isfinite(values).all() and (variances > 0.0).all()):
        raise SolverError("the filter of the unknown load lost its digits on this boom.")
    root = np.sqrt(variances)
    return Pass(values[:, 0] / root, white / root, loads)
