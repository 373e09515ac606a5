"""Adaptive fixed-lag smoother of the cylinder strokes: a bank of Kalman smoothers, weighted by how well each one predicts.

Every smoother of the bank takes a stroke for an integrated white jerk of its own density q (m^2/s^5), measured with variance r
(m^2). A node is a stamp in the window; for each stroke it holds the estimate x = (position, velocity, acceleration) given
everything up to now, and the covariance C of that estimate's error with the newest one's:

    predict:   x- = F x,  P- = F P F^T + q Q,  C_j <- C_j F^T           (newest node, then every older node j)
    measure:   nu = y - x-_0,  s = P-_00 + r,  x_j += C_j[:, 0] nu / s,  C_j <- C_j (I - k h^T)^T

Node 0 is the newest, with C_0 = P. (Rauch-Tung-Striebel smoothing in its fixed-lag form; Anderson and Moore, Optimal
Filtering, 1979, ch. 7.) C depends on stamps alone, so all strokes share it.

Which density a stroke has now is a Markov chain: with rate `CHANGES` (1/s) it is drawn anew from `PRIOR`. Its probabilities
follow from the likelihoods of the innovations (Blom and Bar-Shalom, 1988),

    mu <- (1 - p) mu + p pi,  p = 1 - exp(-CHANGES h);    mu <- mu N(nu; 0, s) / sum,

and weigh the smoothers' estimates, in the whole window: the past of a stroke that has begun to move in haste is revised with
it. States are not mixed, unlike in the interacting form: a quick filter's noisy acceleration would upset a quiet one for
longer than that takes to come back by itself, and covariances would depend on the samples.

A density has a corner frequency, omega_c = (q / (r T))^(1/6), T the time between samples: what is slower passes, gain
1 / (1 + (omega / omega_c)^6). It also sets the lag after which smoothing has nothing left to gain.

A motion that is too quick for the quickest smoother surprises all of them. A running mean of the least normalised innovation
squared tells; while it lasts, the power of the innovations beyond what noise explains counts as variance of the stroke.

What noise it passes on is written again, in the frequency domain, in `boom_twin.analysis.modal.StrokeNoise` and in
`boom_twin.calibration.sessions`: change them together.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.jit import inner
from ..types import Array

JERK_DENSITIES = np.array([4e-4, 5e-2, 20.0])
"""Of white jerk, m^2/s^5: that of a move of the rig (0.05 m in 1.5 s), of a start or stop in half a second, of haste."""
PRIOR = np.array([0.7, 0.15, 0.15])
"""Their probabilities when nothing is known."""
CHANGES = 0.1
"""How often a stroke's density is drawn anew, 1/s; five times more or less changes errors by 2 %."""
LAG = 1.09
"""Lag of a smoother in units of 1 / omega_c."""
QUIET = 1e-12  # variance of velocity and acceleration at the start: the boom starts at rest
SMOOTHING = 0.05  # weight of the newest interval in the usual one
LASTING = 0.1  # s, over which surprise is taken
LARGEST = 9.0  # normalised innovation squared that counts at most, so that one outlier of a sensor is no motion
LOST, FOUND = 4.0, 2.0  # mean of it, 1 or less for noise, above which a motion is not followed, and below which it is again


class FilterTuning(NamedTuple):
    """Numbers of the bank; m smoothers.

    variance : of a reading, m^2. densities, prior : (m,) m^2/s^5, and their probabilities when nothing is known.
    lags : (m,) s, for samples a second apart; they go with the sixth root of the time between samples.
    """

    variance: float
    densities: Array
    prior: Array
    lags: Array


def filter_tuning(variance: float, agility: float) -> FilterTuning:
    """Of strokes measured with `variance` (m^2), for densities `agility` times the usual ones."""
    return FilterTuning(variance, agility * JERK_DENSITIES, PRIOR.copy(), LAG / corners(variance, 1.0, agility))


def corners(variance: float, interval: float, agility: float) -> Array:
    """Corner frequencies of the smoothers, the quietest first, rad/s, shape (m,).

    Parameters
    ----------
    variance : float
        Of a reading, m^2.
    interval : float
        Time between samples, s.
    agility : float
        Factor on the densities.
    """
    return np.asarray((agility * JERK_DENSITIES / (variance * interval)) ** (1.0 / 6.0))


FLAT = 0.01 ** (1.0 / 6.0)  # of a corner frequency: up to there a smoother passes 99 %


def filter_band(variance: float, rate: float, agility: float) -> tuple[Array, Array]:
    """Frequencies (Hz) up to which the smoothers follow a motion within 1 %, and their lags (s), the quietest first; (m,) each.

    Parameters
    ----------
    variance : float
        Of a reading, m^2.
    rate : float
        Samples a second, Hz.
    agility : float
        Factor on the densities.
    """
    found = corners(variance, 1.0 / rate, agility)
    return np.minimum(FLAT * found / (2.0 * np.pi), 0.5 * rate), LAG / found


class StrokeFilter(NamedTuple):
    """What the bank remembers; m smoothers, n strokes.

    x, c : (m, nodes, n, 3), (m, nodes, 3, 3), see the module. weights : (n, m) probabilities of the densities.
    usual : (1,) running mean of the time between samples, s. distances : (m,) scratch.
    nodes : (nodes, n, 3) estimates of the whole bank. covariance : (n, 3, 3) of their error at the newest node.
    surprise : (n,) running mean of the least normalised innovation squared. excess : (n,) m^2, see the module.
    is_lost : (n,) 1 while a stroke is not followed. began : (1,) 1 if one came to be so with the newest sample.
    span, shares, excesses : (1,) s, (n, m), (n,) time since they were set to zero, and integrals of weights and of the excess
    of strokes that are not followed over it.
    """

    x: Array
    c: Array
    weights: Array
    usual: Array
    distances: Array
    nodes: Array
    covariance: Array
    surprise: Array
    excess: Array
    is_lost: NDArray[np.int64]
    began: NDArray[np.int64]
    span: Array
    shares: Array
    excesses: Array


def new_filter(strokes: int, nodes: int) -> StrokeFilter:
    """For so many strokes, with room for so many nodes."""
    m = len(JERK_DENSITIES)
    return StrokeFilter(
        x=np.zeros((m, nodes, strokes, 3)), c=np.zeros((m, nodes, 3, 3)), weights=np.zeros((strokes, m)), usual=np.zeros(1),
        distances=np.zeros(m), nodes=np.zeros((nodes, strokes, 3)), covariance=np.zeros((strokes, 3, 3)),
        surprise=np.zeros(strokes), excess=np.zeros(strokes), is_lost=np.zeros(strokes, np.int64), began=np.zeros(1, np.int64),
        span=np.zeros(1), shares=np.zeros((strokes, m)), excesses=np.zeros(strokes),
    )  # fmt: skip


@inner
def start_filter(bank, tuning, y):
    """First node: strokes at rest at y (m), shape (n,)."""
    bank.usual[0], bank.began[0] = 0.0, 0
    for m in range(bank.x.shape[0]):
        for a in range(3):
            for b in range(3):
                bank.c[m, 0, a, b] = 0.0
        bank.c[m, 0, 0, 0], bank.c[m, 0, 1, 1], bank.c[m, 0, 2, 2] = tuning.variance, QUIET, QUIET
        for i in range(y.shape[0]):
            bank.x[m, 0, i, 0], bank.x[m, 0, i, 1], bank.x[m, 0, i, 2] = y[i], 0.0, 0.0
            bank.weights[i, m] = tuning.prior[m]
    for i in range(y.shape[0]):
        bank.surprise[i], bank.excess[i], bank.is_lost[i] = 0.0, 0.0, 0
    forget_integrals(bank)
    combine(bank, 1)


@inner
def take_strokes(bank, tuning, count, h, y):
    """Add a node at h seconds after the newest of `count`, measured as y (m), shape (n,); NaN = not measured."""
    bank.usual[0] = h if bank.usual[0] == 0.0 else bank.usual[0] + SMOOTHING * (min(h, 2.0 * bank.usual[0]) - bank.usual[0])
    for m in range(bank.x.shape[0]):
        add_node(bank.x[m], bank.c[m], count, h, tuning.densities[m])
    share, drawn = -math.expm1(-h / LASTING), -math.expm1(-CHANGES * h)
    bank.began[0] = 0
    for i in range(y.shape[0]):
        if math.isfinite(y[i]):
            weigh(bank, tuning, i, drawn, watch(bank, tuning, i, y[i], share))
    for m in range(bank.x.shape[0]):
        measure(bank.x[m], bank.c[m], count + 1, y, tuning.variance)
    combine(bank, count + 1)
    integrate(bank, h)


@inner
def add_node(x, c, count, h, density):
    """Shift `count` nodes back by one, and predict a new node 0 at h seconds later; x (nodes, n, 3), c (nodes, 3, 3)."""
    f, g = h, 0.5 * h * h
    for j in range(count, 0, -1):
        for i in range(x.shape[1]):
            for a in range(3):
                x[j, i, a] = x[j - 1, i, a]
        for a in range(3):
            c[j, a, 0] = c[j - 1, a, 0] + f * c[j - 1, a, 1] + g * c[j - 1, a, 2]
            c[j, a, 1] = c[j - 1, a, 1] + f * c[j - 1, a, 2]
            c[j, a, 2] = c[j - 1, a, 2]
    for i in range(x.shape[1]):
        x[0, i, 0] = x[1, i, 0] + f * x[1, i, 1] + g * x[1, i, 2]
        x[0, i, 1] = x[1, i, 1] + f * x[1, i, 2]
        x[0, i, 2] = x[1, i, 2]
    new, old = c[0], c[1]
    for b in range(3):
        new[0, b] = old[0, b] + f * old[1, b] + g * old[2, b]
        new[1, b] = old[1, b] + f * old[2, b]
        new[2, b] = old[2, b]
    new[0, 0] += density * h**5 / 20.0
    new[0, 1] += density * h**4 / 8.0
    new[1, 0] += density * h**4 / 8.0
    new[0, 2] += density * h**3 / 6.0
    new[2, 0] += density * h**3 / 6.0
    new[1, 1] += density * h**3 / 3.0
    new[1, 2] += density * h**2 / 2.0
    new[2, 1] += density * h**2 / 2.0
    new[2, 2] += density * h


@inner
def measure(x, c, count, y, variance):
    """Correct all `count` nodes by strokes y, shape (n,); one that is not measured (NaN) stays as predicted."""
    spread = c[0, 0, 0] + variance
    gain = (c[0, 0, 0] / spread, c[0, 1, 0] / spread, c[0, 2, 0] / spread)
    for i in range(y.shape[0]):
        if math.isfinite(y[i]):
            surprise = (y[i] - x[0, i, 0]) / spread
            for j in range(count):
                for a in range(3):
                    x[j, i, a] += c[j, a, 0] * surprise
    for j in range(count):
        for a in range(3):
            first = c[j, a, 0]
            for b in range(3):
                c[j, a, b] -= first * gain[b]


@inner
def watch(bank, tuning, i, y, share):
    """Whether stroke i, measured as y (m), surprises every smoother lately, of which the newest sample is a `share`.

    Leaves normalised innovations squared in `distances`.
    """
    least, excess = math.inf, 0.0
    for m in range(bank.x.shape[0]):
        surprise, spread = y - bank.x[m, 0, i, 0], bank.c[m, 0, 0, 0] + tuning.variance
        bank.distances[m] = surprise * surprise / spread
        if bank.distances[m] < least:
            least, excess = bank.distances[m], surprise * surprise - spread
    bank.surprise[i] += share * (min(least, LARGEST) - bank.surprise[i])
    bank.excess[i] += share * (excess - bank.excess[i])
    if bank.is_lost[i] == 0 and bank.surprise[i] > LOST:
        bank.is_lost[i] = bank.began[0] = 1
    elif bank.surprise[i] < FOUND:
        bank.is_lost[i] = 0
    return least


@inner
def weigh(bank, tuning, i, drawn, least):
    """Probabilities of the densities of stroke i by `distances`, the least of them given; `drawn` anew with a probability."""
    total = 0.0
    for m in range(bank.x.shape[0]):
        expected = bank.weights[i, m] + drawn * (tuning.prior[m] - bank.weights[i, m])
        likelihood = math.exp(0.5 * (least - bank.distances[m])) / math.sqrt(bank.c[m, 0, 0, 0] + tuning.variance)
        bank.weights[i, m] = expected * likelihood
        total += bank.weights[i, m]
    for m in range(bank.x.shape[0]):
        bank.weights[i, m] /= total


@inner
def combine(bank, count):
    """Estimates of the whole bank at all `count` nodes, and the covariance of the newest one's error."""
    for j in range(count):
        for i in range(bank.weights.shape[0]):
            for a in range(3):
                mean = 0.0
                for m in range(bank.x.shape[0]):
                    mean += bank.weights[i, m] * bank.x[m, j, i, a]
                bank.nodes[j, i, a] = mean
    for i in range(bank.weights.shape[0]):
        for a in range(3):
            for b in range(3):
                total = 0.0
                for m in range(bank.x.shape[0]):
                    apart = (bank.x[m, 0, i, a] - bank.nodes[0, i, a]) * (bank.x[m, 0, i, b] - bank.nodes[0, i, b])
                    total += bank.weights[i, m] * (bank.c[m, 0, a, b] + apart)
                bank.covariance[i, a, b] = total
        if bank.is_lost[i]:
            bank.covariance[i, 0, 0] += max(bank.excess[i], 0.0)


@inner
def integrate(bank, h):
    """Go on with the integrals over time, by h seconds."""
    bank.span[0] += h
    for i in range(bank.weights.shape[0]):
        for m in range(bank.x.shape[0]):
            bank.shares[i, m] += h * bank.weights[i, m]
        if bank.is_lost[i]:
            bank.excesses[i] += h * max(bank.excess[i], 0.0)


@inner
def forget_integrals(bank):
    """Begin the integrals over time anew."""
    bank.span[0] = 0.0
    for i in range(bank.weights.shape[0]):
        bank.excesses[i] = 0.0
        for m in range(bank.x.shape[0]):
            bank.shares[i, m] = 0.0


@inner
def lag_of(bank, tuning):
    """Time (s) that strokes are smoothed for: that of the quickest stroke, each one's the mean over its densities."""
    shortest = math.inf
    for i in range(bank.weights.shape[0]):
        lag = 0.0
        for m in range(bank.x.shape[0]):
            lag += bank.weights[i, m] * tuning.lags[m]
        shortest = min(shortest, lag)
    return shortest * bank.usual[0] ** (1.0 / 6.0)


@inner
def drive_between(old, new, span, share):
    """Position and velocity on the quintic through two nodes of one stroke, (3,) each, `span` s apart; share in [0, 1]."""
    v, a = old[1] * span, 0.5 * old[2] * span * span
    gap = new[0] - old[0] - v - a
    speed = new[1] * span - v - 2.0 * a
    bend = new[2] * span * span - 2.0 * a
    c3 = 10.0 * gap - 4.0 * speed + 0.5 * bend
    c4 = -15.0 * gap + 7.0 * speed - bend
    c5 = 6.0 * gap - 3.0 * speed + 0.5 * bend
    u = share
    position = old[0] + u * (v + u * (a + u * (c3 + u * (c4 + u * c5))))
    velocity = (v + u * (2.0 * a + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / span
    return position, velocity
