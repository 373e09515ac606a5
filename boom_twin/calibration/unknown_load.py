"""Unknown load at the tip as a nuisance of a calibration: how strong it is, and filters that discount what it explains.

The force f (2), N, is taken for a Gaussian process of independent components with the covariance

    sigma^2 (exp(-|t - s| / T) + 1),

a Gauss-Markov process as in `boom_twin.estimation.tip_estimate`, and a constant as large: pulses of a pump push one way. So
what residuals tell of parameters counts only as far as no such force could have made it. With G what f of sigma = 1 N does
to residuals that are white but for it (`load_response`), their covariance is 1 + sigma^2 G G^T. By the eigenvalues g^2 and
vectors v of G^T G and the directions u = G v / g they are whitened directly, and the logarithm of the probability of residuals
r is, but for a constant,

    1/2 sum [ sigma^2 g^2 (u . r)^2 / (1 + sigma^2 g^2) - ln(1 + sigma^2 g^2) ].

sigma is where this is largest (type II maximum likelihood; Rasmussen and Williams, Gaussian Processes for Machine Learning,
2006, ch. 5). Sessions are cut into windows, each with a load of its own, so that time and memory grow with their length only.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..estimation.tip_estimate import LOAD_TIME, MOST_LOAD
from ..scene.schema import Scene
from ..types import Array
from .forward_model import CalibrationProblem
from .load_response import STEP, ModesAlong, modes_along, response
from .noise_model import LoadWindow, NoiseModel, ResidualBlocks, Whitening
from .sessions import SessionCourse

WINDOW = 800  # blocks, at most
LEVELS = np.geomspace(0.3, MOST_LOAD, 120)  # N, of sigma, that are tried; what would need more is no load
CLEAR = 10.0  # by which a load makes residuals more probable, as a logarithm, before it is believed
WEAK = 1e-4  # variance over that of noise, below which a direction is left out
CHUNK = 64  # forces whose response is whitened at once
RMS = 2.0  # of the force's magnitude over sigma: two components, each of them a process and a constant


class _Seen(NamedTuple):
    """A window of blocks: `directions` u, and `gains` g^2, of a load of 1 N, (u . r)^2 as `squares`."""

    first: int
    end: int
    directions: Array
    gains: Array
    squares: Array


def with_load(
    problem: CalibrationProblem, deviations: Array, noise: NoiseModel, level: float | None = None
) -> tuple[list[Whitening], float]:
    """Filters for every session with an unknown load, and its sigma, N (0: none).

    Parameters
    ----------
    deviations : ndarray, shape (p,)
        Of the unknowns from their present values, at which the boom is looked at.
    level : float, optional
        sigma, N; by default that which the residuals tell.
    """
    residuals, _ = problem.moving(deviations, [Whitening(noise)] * len(problem.parts))
    boom, channels = problem.boom(deviations), len(problem.channels)
    found, first = [], 0
    for course, blocks in problem.parts:
        count = len(blocks.times) - len(noise.past)
        white = residuals[first : first + count * channels].reshape(count, channels)
        found.append(_seen(problem, boom, course, blocks, noise, white))
        first += white.size
    if level is None:
        level = _level([window for windows in found for window in windows])
    return [Whitening(noise, tuple(_at_level(window, level) for window in windows if level > 0.0)) for windows in found], level


def _level(windows: list[_Seen]) -> float:
    """The most probable sigma, N; 0 where none is much more probable than no load."""
    if not windows:
        return 0.0
    gains = np.concatenate([window.gains for window in windows])
    squares = np.concatenate([window.squares for window in windows])
    excess = LEVELS[:, None] ** 2 * gains
    logs = 0.5 * (squares * excess / (1.0 + excess) - np.log1p(excess)).sum(axis=1)
    return float(LEVELS[np.argmax(logs)]) if logs.max() > CLEAR else 0.0


def _at_level(window: _Seen, level: float) -> LoadWindow:
    excess = level**2 * window.gains
    strong = excess > WEAK
    return LoadWindow(window.first, window.end, window.directions[:, strong], excess[strong])


def _seen(
    problem: CalibrationProblem, boom: Scene, course: SessionCourse, blocks: ResidualBlocks, noise: NoiseModel, white: Array
) -> list[_Seen]:
    """What a load does in a session, by windows."""
    pieces = math.ceil(problem.length / STEP - 1e-9)
    step = problem.length / pieces
    modes = modes_along(boom, course, np.asarray(step * (0.5 + np.arange(pieces * len(blocks.times)))))
    if not modes.omega.shape[1]:
        return []
    gaps, order = problem.gaps(blocks), len(noise.past)
    bounds = np.linspace(0, len(white), 1 + math.ceil(len(white) / WINDOW)).astype(int).tolist()
    found = []
    for first, end in pairwise(bounds):
        needed = slice(pieces * first, pieces * (end + order))
        shown = response(ModesAlong(*(each[needed] for each in modes)), problem.length, pieces)[..., problem.used]
        shown = _correlated(shown, problem.length) + gaps[first : end + order]
        parts = [noise(shown[i : i + CHUNK]) for i in range(0, len(shown), CHUNK)]
        seen = np.concatenate(parts).reshape(len(shown), -1)
        gains, turn = np.linalg.eigh(seen @ seen.T)
        clear = gains > WEAK / LEVELS[-1] ** 2
        directions = seen.T @ (turn[:, clear] / np.sqrt(gains[clear]))
        found.append(_Seen(first, end, directions, gains[clear], (white[first:end].ravel() @ directions) ** 2))
    return found


def _correlated(shown: Array, length: float) -> Array:
    """From what forces of single blocks do, shape (2 b + rest, b, c), what independent parts of the process do."""
    blocks = shown.shape[1]
    times = length * np.arange(blocks)
    root = np.linalg.cholesky(np.exp(-np.abs(times[:, None] - times) / LOAD_TIME) + 1.0)
    forces = (root.T @ shown[: 2 * blocks].reshape(blocks, -1)).reshape(2 * blocks, *shown.shape[1:])
    return np.concatenate([forces, shown[2 * blocks :]])
