"""Learns a baseline from healthy sessions: what parameters are off by, and how large the errors are that stay.

The errors (deviation of the model's error of angles and of the IMU, their noise, the detuning) are those under which the
innovations of all sessions are most probable, found by coordinate search on a grid of ratios; with them, the regression of all
sessions one after the other gives the parameters. A load at the tip that the model does not know, a pump's or the wind's, is a
nuisance: of each session the level is taken that makes its innovations most probable, and it is no part of the baseline.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from ..errors import UsageError
from ..types import NANO, Array
from .baseline import Baseline
from .inference.block_problem import BLOCK, BlockProblem
from .inference.fault_catalogue import Parameter
from .inference.holds import HoldProblem
from .inference.hypotheses import GATE, Regression
from .inference.innovation_filter import InnovationFilter

SEARCHED = ("angle_error", "force_error", "angle_noise", "force_noise", "detuning")
BOUNDS = {
    "angle_error": (3e-5, 2e-3), "force_error": (2e-3, 0.5), "angle_noise": (0.7, 3.0), "force_noise": (0.7, 5.0),
    "detuning": (2e-3, 0.1),
}  # fmt: skip
RATIOS = (2.0, 1.25)  # of the grid, coarse and fine
ROUNDS = 2
WIDER = 4.0  # times the covariance that is learnt, because the model is not exact
LEAST = 45.0  # s
FREQUENCY_ERRORS = (0.02, 0.01, 0.005, 0.0025)  # that are tried

Session = Sequence[BlockProblem]


class ShakenSession(NamedTuple):
    """A session, and the level (N) of the unknown load at the tip in it."""

    problems: Session
    level: float


def learn(
    sessions: Sequence[Session],
    known: tuple[Parameter, ...],
    joints: int,
    names: Sequence[str],
    progress: Callable[[float], None] = lambda share: None,
    levels: Sequence[float] = (0.0,),
) -> Baseline:
    """A baseline from the linear problems of healthy sessions of one rig, called `names`; `progress` is told the share done.

    An unknown load at the tip may be of any of `levels` (N) in each session.

    Raises
    ------
    UsageError
        Sessions shorter than `LEAST` in all.
    """
    span = sum(len(session) for session in sessions) * BLOCK * NANO
    if span < LEAST:
        raise UsageError(f"sessions = {span:.0f} s in all: too short to learn from. Give at least {LEAST:.0f} s, with moves.")
    best = Baseline(description="learnt", sessions=tuple(names))
    rounds = [(ratio, key) for ratio in RATIOS for _ in range(ROUNDS) for key in SEARCHED]
    shaken: list[ShakenSession] = []
    for done, (ratio, key) in enumerate(rounds):
        progress(done / len(rounds))
        if done % len(SEARCHED) == 0:
            shaken = [_under_load(session, known, joints, best, levels) for session in sessions]
        best = _line_search(shaken, known, joints, best, key, ratio)
    progress(1.0)
    regression, _ = _run(shaken, known, joints, best)
    holds = [problem.hold for session in sessions for problem in session if problem.hold is not None]
    best = _learn_frequencies(holds, regression, best)
    learnt = [i for i, each in enumerate(known) if each.healthy > 0.0]
    covariance = WIDER * regression.covariance[np.ix_(learnt, learnt)]
    return best.model_copy(
        update={
            "names": tuple(known[i].name for i in learnt),
            "mean": regression.mean[learnt].tolist(),
            "covariance": covariance.tolist(),
        }
    )


def _learn_frequencies(holds: Sequence[HoldProblem], regression: Regression, start: Baseline) -> Baseline:
    """Narrow the regression by the natural frequencies of holds, with the error of the model that makes them most probable."""
    before, found = (regression.mean, regression.covariance), []
    for error in FREQUENCY_ERRORS if any(len(hold.modes) for hold in holds) else ():
        regression.mean, regression.covariance = before
        log = 0.0
        for hold in holds:
            if len(hold.modes):
                sigmas = np.hypot(hold.sigmas, error)
                log += _log(regression, hold.frequencies / sigmas[:, None], 0.0) - float(np.log(sigmas).sum())
                first = hold.frequencies[:, 0] / sigmas
                log -= 0.5 * float(first @ first)
        found.append((log, error, regression.mean, regression.covariance))
    if not found:
        return start
    _, error, regression.mean, regression.covariance = max(found, key=lambda each: each[0])
    return start.model_copy(update={"frequency_error": error})


def _under_load(
    session: Session, known: tuple[Parameter, ...], joints: int, trial: Baseline, levels: Sequence[float]
) -> ShakenSession:
    """A session with that of the `levels` (N) under which it is most probable."""
    if len(levels) == 1:
        return ShakenSession(session, levels[0])
    found = (ShakenSession(session, level) for level in levels)
    return max(found, key=lambda shaken: _run([shaken], known, joints, trial)[1])


def _line_search(
    sessions: Sequence[ShakenSession], known: tuple[Parameter, ...], joints: int, start: Baseline, key: str, ratio: float
) -> Baseline:
    """Go up or down with one value as long as innovations get more probable."""
    low, high = BOUNDS[key]

    def logs(values: list[float]) -> list[float]:
        trials = [start.model_copy(update={key: value}) for value in values]
        with ThreadPoolExecutor(2) as pool:
            return list(pool.map(lambda trial: _run(sessions, known, joints, trial)[1], trials))

    now = getattr(start, key)
    down, here, up = logs([now / ratio, now, now * ratio])
    if max(down, up) <= here:
        return start
    factor = 1.0 / ratio if down > up else ratio
    best, value = max(down, up), now * factor
    if not low <= value <= high:
        return start.model_copy(update={key: min(max(value, low), high)})
    while low < value * factor < high and (found := logs([value * factor])[0]) > best:
        best, value = found, value * factor
    return start.model_copy(update={key: float(f"{value:.3g}")})


def _run(
    sessions: Sequence[ShakenSession], known: tuple[Parameter, ...], joints: int, trial: Baseline
) -> tuple[Regression, float]:
    """Regression over all sessions, and the logarithm of the probability of their innovations."""
    regression, log = Regression(*Baseline().healthy(known)), 0.0
    errors2, noise2 = trial.errors(joints) ** 2, trial.noise(joints) ** 2
    for session in sessions:
        whitening = InnovationFilter(joints + 2, 1 + len(known), BLOCK * NANO, trial.detuning, session.level)
        for problem in session.problems:
            whitening.tune(problem.modes)
            found = whitening.step(problem.table, problem.noise(noise2), errors2, problem.shaking, problem.travel)
            log += _log(regression, found.white, float(found.log))
    return regression, log


def _log(regression: Regression, white: Array, log: float) -> float:
    """Logarithm of the probability of one block, and the regression narrowed by it; outliers count as if at the gate."""
    first = white[:, 0]
    left, spread = regression.take(white, True)
    return log + 0.5 * float(first @ first) - 0.5 * float(np.minimum(left**2, GATE**2).sum()) - spread
