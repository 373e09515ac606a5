"""Learn which valves are open, the jerk density, the variance of the load, and the noise of lengths."""

from __future__ import annotations

import math

from ..kernels.jit import inner
from .kalman import DRIVE_TIME
from .mixture import LEAST_CHANCE, copy_model, first_model
from .rows import reach2
from .states import BURST, ESTIMATE, FED, OPEN, PREDICTION, VALVES, drive_place, force_place

LEARN_LOAD = 3.0  # s, in which the variance of the fast load is learnt
SURPRISE = 9.0  # largest square of a value that counts in the learnt variance, in terms of the present variance
LEAST_JERK, MOST_JERK = 1e-3, 10.0  # m^2/s^5
OPENING = 1.0  # m/s^2, by which a valve that opens may accelerate the tip: standard deviation
JERK_RISE, JERK_FALL = 0.05, 0.5  # s, in which that density is learnt
LEAST_KNOWN = 0.1  # share of the variance of an acceleration that readings determine, at least
MOVING = 0.1  # m/s, by which a drive that moves carries the tip: standard deviation
OPENED = 5.0  # logarithm of the odds for a moving drive, above which its valve is believed open
SHUT_TIME = 0.15  # s with odds against it, after which a valve is believed closed
LEARN_LENGTH = 0.02  # share of a third difference that counts for the noise of a length
UNEVEN = 0.5  # largest relative change of the sampling interval within a third difference


@inner
def watch_valves(p, f, h, mixture, size):
    """Set valves of a mixture open or closed by the rates of their drives in its model in which all are open.

    When one opens, the models take over what that model knows, and a sudden load is as good as excluded, see `interact`.
    """
    n, drive, opened = p.drives.shape[0], drive_place(p), False
    first, is_open, still = first_model(mixture), f.is_open[mixture], f.still[mixture]
    moving = first + OPEN
    for i in range(n):
        at = drive + n + i
        odds = log_odds(f.x[moving, at], f.p[moving, at, at], MOVING * MOVING / max(reach2(p, 2 + i), 1e-9))
        still[i] = still[i] + h if odds < 0.0 else 0.0
        if odds > OPENED and f.chances[moving] > 0.5:
            opened |= is_open[i] == 0
            is_open[i] = 1
        elif still[i] > SHUT_TIME:
            is_open[i] = 0
    if opened:
        copy_model(f, moving, first + VALVES, size)
        copy_model(f, moving, first + BURST, size)
        f.chances[first + VALVES] += f.chances[first + BURST]
        f.chances[first + BURST] = LEAST_CHANCE


@inner
def log_odds(rate, variance, moving2):
    """Return the logarithm of the odds of a drive that moves, by a rate of variance `moving2`, against one that stands still.

    It is the Bayes factor of a rate that is known with `variance`.
    """
    known = max(variance, 1e-300)
    ratio = moving2 / known
    return 0.5 * (rate * rate / known * ratio / (1.0 + ratio) - math.log(1.0 + ratio))


@inner
def learn_jerk(p, f, h):
    """Learn the jerk density of the drives: 2/T times the mean square of the acceleration, a Gauss-Markov process.

    A closed valve has the density of one that opens: a smaller one would take a quick start for a load. An inclinometer
    cannot tell a quick start from its own error by acceleration, so its density is learnt there too.
    """
    n = p.drives.shape[0]
    for i in range(n):
        if f.is_open[PREDICTION, i] == 0 and not (p.reads_angle and p.sways[i]):
            f.jerk[i] = min(2.0 / DRIVE_TIME * OPENING * OPENING / max(reach2(p, 2 + i), 1e-9), MOST_JERK)
            continue
        at = drive_place(p) + 2 * n + i
        shown = 2.0 / DRIVE_TIME * (f.x[OPEN, at] * f.x[OPEN, at] + f.p[OPEN, at, at])
        known = max(1.0 - 2.0 / DRIVE_TIME * f.p[OPEN, at, at] / f.jerk[i], LEAST_KNOWN)
        time = JERK_RISE if shown > f.jerk[i] else JERK_FALL * known
        f.jerk[i] = min(max(f.jerk[i] + min(h / time, 1.0) * (shown - f.jerk[i]), LEAST_JERK), MOST_JERK)


@inner
def learn_length_noise(f, h, y):
    """Learn the noise of lengths from third differences, whose variance is 20 times that of the noise.

    Lengths that came `h` (s) after those before, and not in even steps with them, begin a new series of differences.
    """
    is_even, f.interval[0] = abs(h - f.interval[0]) < UNEVEN * h, h
    for i in range(y.shape[0]):
        if not is_even:
            f.before[i, 0] = f.before[i, 1] = f.before[i, 2] = math.nan
        third = y[i] - 3.0 * f.before[i, 0] + 3.0 * f.before[i, 1] - f.before[i, 2]
        if math.isfinite(third):
            found = f.length2[i] + LEARN_LENGTH * (third * third / 20.0 - f.length2[i])
            f.length2[i] = max(found, f.noise.length2)
        f.before[i, 2], f.before[i, 1], f.before[i, 0] = f.before[i, 1], f.before[i, 0], y[i]


@inner
def learn_load(p, f, h):
    """Learn the variance of the fast load, of the prediction and of the estimate."""
    for k in range(2):
        if k == ESTIMATE and f.status[FED] == 0:
            f.load2[ESTIMATE, 0], f.load2[ESTIMATE, 1] = f.load2[PREDICTION, 0], f.load2[PREDICTION, 1]
            return
        for a in range(2):
            at = force_place(p) + a
            f.load2[k, a] = learnt(f, f.load2[k, a], f.mean[k, at] * f.mean[k, at] + f.spread[k, at, at], h)


@inner
def learnt(f, before, shown, h):
    """Return a variance (N^2) after a step of its first-order filter towards what is shown.

    It stays below that of a load that has just come. A larger load is that, not a usual one.
    """
    found = before + min(h / LEARN_LOAD, 1.0) * (min(shown, SURPRISE * before) - before)
    return min(max(found, f.noise.least_load * f.noise.least_load), f.noise.burst_load * f.noise.burst_load)
