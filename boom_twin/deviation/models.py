"""Kalman filters on cylinder lengths: the prediction from lengths alone, and the estimate from all sensors.

A transducer reads the length of its cylinder, oil compressed. Its drive, the length with unloaded oil, is a state:

    length_i = d_i + c_i F_i - tau_i (length_i' - d_i'),    F_i, its force, linear in drives, load and modes (`posture`).

Recordings of drives themselves are the case c_i = 0 of that reading; the boom keeps its oil.

States: modal coordinates and rates of the vibration about static equilibrium; a fast and a slow part of the force at the tip
that the model does not know (Gauss-Markov, `FAST` and `SLOW` seconds); length, rate and acceleration of the drives. The
estimate adds zeros of IMU, angle sensors and force sensors.

A closed valve locks the oil, so its drive stands still: that is a reading of rate zero. Three models interact (H. Blom and
Y. Bar-Shalom, IEEE Trans. Automat. Control 33 (1988), 780-783): valves as they are believed to be; all valves open; valves as
believed under a load that has just come. Where the second explains the lengths best, valves whose rates differ from zero are
believed open, until they stand still. The estimate has the first two, each with the readings of all sensors.

How far a drive's acceleration changes, and how large the fast load is, is learnt: the variance that a state is expected to have
goes to the one that it shows (expectation maximisation, one step a sample).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.jit import by_reference, inner, kernel
from ..types import Array, Stream

VALVES, OPEN, BURST, ALL_VALVES, ALL_OPEN = range(5)  # models: three of the prediction, two of the estimate
ANGLES, IMU, FORCES = map(list(Stream).index, (Stream.ANGLES, Stream.IMU, Stream.FORCES))  # codes of these streams
PREDICTION, ESTIMATE = range(2)  # mixtures of these
STARTED, FED, FED_STAMP = range(3)  # of `status`

FAST, SLOW = 0.25, 60.0  # s, correlation times of the two parts of the load
LEARN_LOAD = 3.0  # s, in which the size of the fast load is learnt
SURPRISE = 9.0  # times its variance: most that one sample counts for in that
DRIVE_TIME = 0.12  # s, correlation time of a drive's acceleration
JERK = 3e-3  # m^2/s^5, density of the jerk of a drive that begins to move
LEAST_JERK, MOST_JERK = 1e-3, 10.0  # m^2/s^5
JERK_RISE, JERK_FALL = 0.05, 0.5  # s, in which that density is learnt
CLOSED_RATE, CLOSED_ACCELERATION = 1e-5, 1e-3  # m/s, m/s^2, noise of the reading that a closed valve's drive stands still
LEAK = 1e-14  # m^2/s, random walk of a drive
OPENS, CLOSES = 0.3, 1.0  # 1/s, rates at which valves open, and are closed again
COMES, STAYS = 0.2, 1.0  # 1/s, rates at which a load comes, and is usual again
OPENED, SHUT = 4.0, 3.0  # standard deviations of a drive's rate: beyond the one it moves, below the other it may stand still
SHUT_TIME = 0.15  # s below the second before its valve is believed closed
LONGEST_STEP = 0.02  # s of one transition
IMU_ZERO, IMU_DRIFT = 0.3, 3e-3  # m/s^2; m/s^2 in a root second
IMU_TURN, IMU_SCALE = 0.1, 0.1  # rad, by which it may be mounted askew; share by which it may read too much
ANGLE_ZERO, ANGLE_DRIFT = 2e-4, 1e-5  # rad; rad in a root second: sensors' zeros, and the error of the model's statics
FORCE_ZERO, FORCE_DRIFT = 1.0, 0.03  # share of the force; in a root second
INEXACT = 0.03  # share of the tip's acceleration that modes left out and those there are wrong by
LEARN_NOISE = 0.02  # of a reading, by which the noise of its channel is learnt
CONTRADICTION = 8.0  # standard deviations of the predicted tip, by which the estimate may be off it
MOST_EXCESS = 1e6  # times the variance that a channel is stated to have
LEARN_LENGTH = 0.02  # likewise of a length's noise, by third differences
UNEVEN = 0.5  # share of the time between two lengths by which the one before may differ, for differences of them
DEAF_WAY, DEAF_RATE = 0.05, 0.02  # m, m/s: how far a drive is, and how fast, whose transducer fails
DOF = 4.0  # degrees of freedom of Student's t, by which innovations of the estimate are weighed
PATIENCE = 1_000_000_000  # ns without readings after which the estimate is the prediction again
OLDEST = 0.1  # s, most that a reading may be late


class SensorNoise(NamedTuple):
    """Variances of sensors, and sizes of loads (N): usual, least, at the start of a session, just come."""

    length2: float
    angle2: float
    acceleration2: float
    force2: float
    usual_load: float
    least_load: float
    first_load: float
    burst_load: float


@by_reference
class Filters(NamedTuple):
    """Filters of one boom; n cylinders, m modes at most, s states, p of them of the prediction (zeros behind).

    x, p : (5, s), (5, s, s) states and covariances of the models. chances : (5,) of them, in each mixture one in all.
    mean, spread : (2, s), (2, s, s) of the mixtures. load2 : (2,) variance of the fast load, N^2, of prediction and estimate.
    jerk : (n,) m^2/s^5. is_open : (n,) 1 where a valve is believed open. still : (n,) s since its drive began to stand still.
    status : (3,) whether it has begun, whether the estimate has readings of its own, stamp of the newest of these.
    masked, deaf : (c,), (n,) measured channels, and strokes, that the estimate is not to use. noise : variances.
    excess : (c,) times the variance that channels are stated to have. length2 : (n,) variances of lengths as learnt, m^2.
    before, interval : (n, 3), (1,) the three lengths before (m), and the time between the newest two, s.
    places, weights, counts : (s, k), (s, k), (s,) columns of the transition matrix by row. variances : (s,) of its noise.
    felt : (2,) specific force predicted at the tip, m/s^2. shaking : (1,) mean square of its acceleration, m^2/s^4.
    angle : (1,) of the tip, rad. strokes : (n, 3) predicted lengths (m), their rates and accelerations.
    innovations : (n, 2) newest lengths less what the prediction's mixture expected before them (m), and their variances.
    pulls : (n,) predicted forces, N. evidence : (1,) logarithm of the likelihood of all that was read, up to a constant.
    The others are scratch.
    """

    x: Array
    p: Array
    chances: Array
    mean: Array
    spread: Array
    load2: Array
    jerk: Array
    is_open: NDArray[np.int64]
    still: Array
    status: NDArray[np.int64]
    masked: NDArray[np.bool_]
    deaf: NDArray[np.bool_]
    excess: Array
    length2: Array
    before: Array
    interval: Array
    noise: SensorNoise
    places: NDArray[np.int64]
    weights: Array
    counts: NDArray[np.int64]
    variances: Array
    felt: Array
    pulls: Array
    evidence: Array
    half: Array
    turned: Array
    mixed_x: Array
    mixed_p: Array
    row: Array
    gain: Array
    rows: Array
    likely: Array
    switch: Array
    shaking: Array
    angle: Array
    strokes: Array
    innovations: Array


def new_filters(joints: int, modes: int, channels: int, noise: SensorNoise) -> Filters:
    """Return filters of a boom with so many joints, modes at most, and measured channels."""
    n, states = joints, 2 * modes + 4 + 3 * joints + 4 + 2 * joints
    return Filters(
        x=np.zeros((5, states)), p=np.zeros((5, states, states)), chances=np.zeros(5), mean=np.zeros((2, states)),
        spread=np.zeros((2, states, states)), load2=np.zeros(2), jerk=np.zeros(n), is_open=np.zeros(n, np.int64),
        still=np.zeros(n), status=np.zeros(3, np.int64), masked=np.zeros(channels, np.bool_),
        deaf=np.zeros(n, np.bool_), excess=np.ones(channels), length2=np.full(n, noise.length2), before=np.full((n, 3), np.nan),
        interval=np.zeros(1), noise=noise,
        places=np.zeros((states, 6 + n), np.int64), weights=np.zeros((states, 6 + n)), counts=np.zeros(states, np.int64),
        variances=np.zeros(states), felt=np.zeros(2), pulls=np.zeros(n), evidence=np.zeros(1), half=np.zeros((states, states)),
        turned=np.zeros((states, states)), mixed_x=np.zeros((3, states)), mixed_p=np.zeros((3, states, states)),
        row=np.zeros(states), gain=np.zeros(states), rows=np.zeros((9, states)), likely=np.zeros(5),
        switch=np.zeros((3, 3)), shaking=np.zeros(1), angle=np.zeros(1), strokes=np.zeros((n, 3)),
        innovations=np.zeros((n, 2)),
    )  # fmt: skip


# -- places of the states -----------------------------------------------------------------------------------------------------


@inner
def force_place(p):
    """Return the first place of the fast load (2), behind the modes' coordinates and rates; the slow one (2) follows."""
    return 2 * p.modes[0]


@inner
def drive_place(p):
    """Return the first place of the drives (n); their rates (n) and accelerations (n) follow."""
    return 2 * p.modes[0] + 4


@inner
def zero_place(p):
    """Return how many states the prediction has; zeros (2), mount, scale of the IMU, zeros of angles and forces follow."""
    return 2 * p.modes[0] + 4 + 3 * p.drives.shape[0]


@inner
def all_states(p):
    """Return the number of states of the estimate."""
    return zero_place(p) + 4 + 2 * p.drives.shape[0]


# -- rows: what is read of the states -----------------------------------------------------------------------------------------


@inner
def clear(row, size):
    """Set the first `size` entries to zero."""
    for k in range(size):
        row[k] = 0.0


@inner
def column_row(p, columns, at, scale, row):
    """Write the row of a quantity that changes by `scale` times a column of `columns` (c, ..) a state, see `Posture`."""
    n, m = p.drives.shape[0], p.modes[0]
    clear(row, all_states(p))
    load, drive = force_place(p), drive_place(p)
    for j in range(m):
        row[j] = scale * columns[2 + n + j, at]
    for a in range(2):
        row[load + a] = row[load + 2 + a] = scale * columns[a, at]
    for i in range(n):
        row[drive + i] = scale * columns[2 + i, at]


@inner
def length_row(p, i, row):
    """Write the row of what the stroke transducer of cylinder `i` reads."""
    n, m = p.drives.shape[0], p.modes[0]
    column_row(p, p.forces, i, p.oil_read[i], row)
    row[drive_place(p) + i] += 1.0
    for j in range(m):
        row[m + j] = -p.lag[i] * p.oil_read[i] * p.forces[2 + n + j, i]


@inner
def rate_row(p, a, row):
    """Write the row of the velocity of the tip (x, y, angle: `a`)."""
    n, m = p.drives.shape[0], p.modes[0]
    clear(row, all_states(p))
    drive = drive_place(p)
    for j in range(m):
        row[m + j] = p.readings[2 + n + j, n + a]
    for i in range(n):
        row[drive + n + i] = p.readings[2 + i, n + a]


@inner
def acceleration_row(p, a, row):
    """Write the row of the acceleration of the tip (x, y, angle: `a`), less what its curved way needs at its speed."""
    n, m = p.drives.shape[0], p.modes[0]
    clear(row, all_states(p))
    load, drive = force_place(p), drive_place(p)
    for i in range(n):
        row[drive + 2 * n + i] = p.readings[2 + i, n + a]
    for j in range(m):
        at, omega2 = 2 + n + j, p.omega[j] * p.omega[j]
        motion = p.readings[at, n + a]
        row[j], row[m + j] = -omega2 * motion, -p.decay[j] * motion
        for b in range(2):
            share = motion * p.readings[at, n + b]
            row[load + b] += share
            row[load + 2 + b] += share
        for i in range(n):
            row[drive + 2 * n + i] -= motion * p.forces[at, i] / omega2


@inner
def read(row, x, size):
    """Return the reading of a row."""
    total = 0.0
    for k in range(size):
        total += row[k] * x[k]
    return total


@inner
def about_rest(p, row, x, size):
    """Return the reading of a row less that at rest."""
    total, drive = read(row, x, size), drive_place(p)
    for i in range(p.drives.shape[0]):
        total -= row[drive + i] * p.drives[i]
    return total


@inner
def variance_of(row, covariance, gain, size):
    """Return the variance of the reading of a row; `gain` is scratch."""
    spread_of(row, covariance, gain, size)
    return max(read(row, gain, size), 0.0)


@inner
def spread_of(row, covariance, gain, size):
    """Write the covariance of all states with the reading of a row."""
    clear(gain, size)
    for k in range(size):
        if row[k] != 0.0:
            weight, line = row[k], covariance[k]
            for i in range(size):
                gain[i] += weight * line[i]


# -- transition ---------------------------------------------------------------------------------------------------------------


@inner
def put_weight(f, row, place, weight):
    """Add an entry to a row of the transition matrix."""
    f.places[row, f.counts[row]], f.weights[row, f.counts[row]] = place, weight
    f.counts[row] += 1


@inner
def make_transition(p, f, h):
    """Write the transition over `h` (s), inputs of the modes held, and the variances that the drives gain; loads follow."""
    n, m, load, drive = p.drives.shape[0], p.modes[0], force_place(p), drive_place(p)
    for k in range(all_states(p)):
        f.counts[k], f.variances[k] = 0, 0.0
    for j in range(m):
        omega2, half = p.omega[j] * p.omega[j], 0.5 * p.decay[j]
        swing = math.sqrt(max(omega2 - half * half, 1e-12))
        left, c, s = math.exp(-half * h), math.cos(swing * h), math.sin(swing * h)
        qq, qv = left * (c + half / swing * s), left * s / swing
        vq, vv = -left * omega2 / swing * s, left * (c - half / swing * s)
        put_weight(f, j, j, qq)
        put_weight(f, j, m + j, qv)
        put_weight(f, m + j, j, vq)
        put_weight(f, m + j, m + j, vv)
        still, moving = (1.0 - qq) / omega2, -vq / omega2
        for a in range(2):
            motion = p.readings[2 + n + j, n + a]
            for b in range(2):
                put_weight(f, j, load + 2 * b + a, still * motion)
                put_weight(f, m + j, load + 2 * b + a, moving * motion)
        for i in range(n):
            push = -p.forces[2 + n + j, i] / omega2
            put_weight(f, j, drive + 2 * n + i, still * push)
            put_weight(f, m + j, drive + 2 * n + i, moving * push)
    for a in range(2):
        put_weight(f, load + a, load + a, math.exp(-h / FAST))
        put_weight(f, load + 2 + a, load + 2 + a, math.exp(-h / SLOW))
    kept = math.exp(-h / DRIVE_TIME)
    for i in range(n):
        put_weight(f, drive + i, drive + i, 1.0)
        put_weight(f, drive + i, drive + n + i, h)
        put_weight(f, drive + i, drive + 2 * n + i, 0.5 * h * h)
        put_weight(f, drive + n + i, drive + n + i, 1.0)
        put_weight(f, drive + n + i, drive + 2 * n + i, h)
        put_weight(f, drive + 2 * n + i, drive + 2 * n + i, kept)
        f.variances[drive + i], f.variances[drive + 2 * n + i] = LEAK * h, f.jerk[i] * h
    zero = zero_place(p)
    for k in range(zero, all_states(p)):
        put_weight(f, k, k, 1.0)
    for a in range(2):
        f.variances[zero + a] = IMU_DRIFT * IMU_DRIFT * h
    for i in range(n):
        f.variances[zero + 4 + i] = ANGLE_DRIFT * ANGLE_DRIFT * h
        f.variances[zero + 4 + n + i] = (FORCE_DRIFT * f.pulls[i]) ** 2 * h


@inner
def transit(p, f, k, size, h, load2):
    """Take model `k` with its first `size` states over the transition; its fast load has the variance `load2` (N^2)."""
    x, covariance, load = f.x[k], f.p[k], force_place(p)
    for i in range(size):
        total = 0.0
        for c in range(f.counts[i]):
            total += f.weights[i, c] * x[f.places[i, c]]
        f.row[i] = total
    for i in range(size):
        x[i] = f.row[i]
    multiply(f, covariance, f.half, size)
    for i in range(size):
        for j in range(size):
            f.turned[i, j] = f.half[j, i]
    multiply(f, f.turned, covariance, size)
    for i in range(size):
        covariance[i, i] += f.variances[i]
    slow2 = f.noise.least_load * f.noise.least_load + load2
    for a in range(2):
        covariance[load + a, load + a] += load2 * (1.0 - math.exp(-2.0 * h / FAST))
        covariance[load + 2 + a, load + 2 + a] += slow2 * (1.0 - math.exp(-2.0 * h / SLOW))


@inner
def multiply(f, right, found, size):
    """Write the product of the transition matrix and `right` (s, s)."""
    for i in range(size):
        for j in range(size):
            found[i, j] = 0.0
        for c in range(f.counts[i]):
            weight, line = f.weights[i, c], right[f.places[i, c]]
            for j in range(size):
                found[i, j] += weight * line[j]


# -- measurement --------------------------------------------------------------------------------------------------------------


@inner
def correct(x, covariance, row, gain, innovation, variance, size):
    """Take a reading into a state and its covariance; returns the variance of the innovation."""
    spread_of(row, covariance, gain, size)
    expected = variance
    for k in range(size):
        expected += row[k] * gain[k]
    share = innovation / expected
    for i in range(size):
        x[i] += gain[i] * share
        part = gain[i] / expected
        for k in range(size):
            covariance[i, k] -= part * gain[k]
    return expected


@inner
def hold_still(p, f, k, size):
    """Take the readings of model `k` that drives behind closed valves stand still."""
    n, drive = p.drives.shape[0], drive_place(p)
    for i in range(n):
        if f.is_open[i] == 0 and not (k >= ALL_VALVES and f.deaf[i]):
            for order in (1, 2):
                at = drive + order * n + i
                clear(f.row, size)
                f.row[at] = 1.0
                noise = CLOSED_RATE if order == 1 else CLOSED_ACCELERATION
                correct(f.x[k], f.p[k], f.row, f.gain, -f.x[k, at], noise * noise, size)


@inner
def length_of(p, i, row, x, size):
    """Return what the stroke transducer of cylinder `i` reads by a state, m; `row` is that of `length_row`."""
    return p.drives[i] + p.oil_read[i] * p.pulled[i] + about_rest(p, row, x, size)


@inner
def note_innovations(p, f, y):
    """Write lengths `y` less the mean of the prediction's mixture before them, and the variances of that."""
    n = y.shape[0]
    size = drive_place(p) + n  # a length does not depend on the states behind
    for i in range(n):
        mean = square = 0.0
        length_row(p, i, f.row)
        for k in range(BURST + 1):
            innovation = y[i] - length_of(p, i, f.row, f.x[k], size)
            mean += f.chances[k] * innovation
            square += f.chances[k] * (innovation * innovation + variance_of(f.row, f.p[k], f.gain, size))
        f.innovations[i, 0], f.innovations[i, 1] = mean, square - mean * mean + f.length2[i]


@inner
def take_lengths(p, f, k, size, y):
    """Take lengths `y` (n, m; NaN = missing) into model `k`; returns the logarithm of their likelihood."""
    total = 0.0
    for i in range(y.shape[0]):
        if math.isfinite(y[i]) and not (k >= ALL_VALVES and f.deaf[i]):
            length_row(p, i, f.row)
            innovation = y[i] - length_of(p, i, f.row, f.x[k], size)
            expected = correct(f.x[k], f.p[k], f.row, f.gain, innovation, f.length2[i], size)
            total -= 0.5 * (innovation * innovation / expected + math.log(expected))
    return total


# -- interacting models -------------------------------------------------------------------------------------------------------


@inner
def start_models(p, f, speed, swing):
    """Begin at rest at the drives of the posture; drives may be as fast as `speed` (m/s), the tip may swing by `swing` (m)."""
    n, m, size = p.drives.shape[0], p.modes[0], all_states(p)
    load, drive = force_place(p), drive_place(p)
    noise, x, covariance = f.noise, f.x[VALVES], f.p[VALVES]
    for i in range(f.x.shape[1]):
        x[i] = 0.0
        for k in range(f.x.shape[1]):
            covariance[i, k] = 0.0
    f.load2[0] = f.load2[1] = noise.usual_load * noise.usual_load
    for a in range(2):
        covariance[load + a, load + a] = f.load2[0]
        covariance[load + 2 + a, load + 2 + a] = noise.first_load * noise.first_load
    for j in range(m):
        motion2 = p.readings[2 + n + j, n] ** 2 + p.readings[2 + n + j, n + 1] ** 2
        omega2 = p.omega[j] * p.omega[j]
        off2 = 0.1 * motion2 * f.load2[0] / (omega2 * omega2)
        if j == 0 and motion2 > 0.0:
            off2 += swing * swing / motion2
        for i in range(n):
            off2 += (p.forces[2 + n + j, i] * speed) ** 2 / (omega2 * omega2 * omega2)
        covariance[j, j], covariance[m + j, m + j] = off2, omega2 * off2
    for i in range(n):
        x[drive + i] = p.drives[i]
        covariance[drive + i, drive + i] = f.noise.length2
        covariance[drive + n + i, drive + n + i] = CLOSED_RATE * CLOSED_RATE + speed * speed
        f.jerk[i], f.is_open[i], f.still[i] = JERK, 1 if speed > 0.0 else 0, 0.0
        f.length2[i], f.pulls[i] = noise.length2, p.pulled[i]
        f.before[i, 0] = f.before[i, 1] = f.before[i, 2] = math.nan
    copy_model(f, VALVES, OPEN, size)
    copy_model(f, VALVES, BURST, size)
    f.chances[VALVES], f.chances[OPEN], f.chances[BURST] = 0.8, 0.1, 0.1
    f.excess[:], f.shaking[0] = 1.0, 0.0
    mix(f, PREDICTION, zero_place(p))
    follow_prediction(p, f)
    f.status[STARTED], f.status[FED] = 1, 0


@inner
def copy_model(f, source, target, size):
    """Copy state and covariance of a model."""
    for i in range(size):
        f.x[target, i] = f.x[source, i]
        for k in range(size):
            f.p[target, i, k] = f.p[source, i, k]


@inner
def models_of(mixture):
    """Return the first model of a mixture, and how many it has."""
    return (VALVES, 3) if mixture == PREDICTION else (ALL_VALVES, 2)


@inner
def interact(f, mixture, size, h):
    """Mix the models of a mixture before a step of `h` (s), by the rates at which valves and load change."""
    first, count = models_of(mixture)
    opens, closes = 1.0 - math.exp(-OPENS * h), 1.0 - math.exp(-CLOSES * h)
    comes, stays = 1.0 - math.exp(-COMES * h), 1.0 - math.exp(-STAYS * h)
    if count == 2:
        comes = 0.0
    switch = f.switch
    switch[VALVES, VALVES], switch[VALVES, OPEN], switch[VALVES, BURST] = 1.0 - opens - comes, opens, comes
    switch[OPEN, VALVES], switch[OPEN, OPEN], switch[OPEN, BURST] = closes, 1.0 - closes, 0.0
    switch[BURST, VALVES], switch[BURST, OPEN], switch[BURST, BURST] = stays, opens, 1.0 - stays - opens
    for target in range(count):
        new = 0.0
        for source in range(count):
            new += f.chances[first + source] * switch[source, target]
        f.likely[target] = new
        mean, spread = f.mixed_x[target], f.mixed_p[target]
        clear(mean, size)
        for i in range(size):
            clear(spread[i], size)
        for source in range(count):
            add_mean(f, first + source, f.chances[first + source] * switch[source, target] / new, mean, size)
        for source in range(count):
            share = f.chances[first + source] * switch[source, target] / new
            add_spread(f, first + source, share, mean, spread, size)
    for target in range(count):
        f.chances[first + target] = f.likely[target]
        for i in range(size):
            f.x[first + target, i] = f.mixed_x[target, i]
            for k in range(size):
                f.p[first + target, i, k] = f.mixed_p[target, i, k]


@inner
def add_mean(f, model, share, mean, size):
    """Add a share of a model's state to a mean."""
    for i in range(size):
        mean[i] += share * f.x[model, i]


@inner
def add_spread(f, model, share, mean, spread, size):
    """Add a share of a model's covariance, and of how far its state is from the mean, to a covariance."""
    if share < 1e-12:
        return
    for i in range(size):
        apart = share * (f.x[model, i] - mean[i])
        for k in range(size):
            spread[i, k] += share * f.p[model, i, k] + apart * (f.x[model, k] - mean[k])


@inner
def mix(f, mixture, size):
    """Write mean and covariance of a mixture."""
    first, count = models_of(mixture)
    mean, spread = f.mean[mixture], f.spread[mixture]
    clear(mean, size)
    for i in range(size):
        clear(spread[i], size)
    for k in range(count):
        add_mean(f, first + k, f.chances[first + k], mean, size)
    for k in range(count):
        add_spread(f, first + k, f.chances[first + k], mean, spread, size)


@kernel
def step_models(p, f, h, y):
    """Take all models `h` (s) on to lengths `y` (n, m; NaN = missing)."""
    size, every = zero_place(p), all_states(p)
    learn_length_noise(f, h, y)
    usual2 = f.load2[0]
    burst2 = max(f.noise.burst_load * f.noise.burst_load, usual2)
    if h > 0.0:
        steps = max(1, math.ceil(h / LONGEST_STEP - 1e-6))
        interact(f, PREDICTION, size, h)
        if f.status[FED] == 1:
            interact(f, ESTIMATE, every, h)
        make_transition(p, f, h / steps)
        for _ in range(steps):
            for k in range(3):
                transit(p, f, k, size, h / steps, burst2 if k == BURST else usual2)
            if f.status[FED] == 1:
                all2 = f.load2[1] + f.chances[BURST] * (burst2 - f.load2[1])
                for k in range(2):
                    transit(p, f, ALL_VALVES + k, every, h / steps, all2)
        hold_still(p, f, VALVES, size)
        hold_still(p, f, BURST, size)
        if f.status[FED] == 1:
            hold_still(p, f, ALL_VALVES, every)
    note_innovations(p, f, y)
    for k in range(3):
        f.likely[k] = take_lengths(p, f, k, size, y)
    weigh_models(f, PREDICTION)
    mix(f, PREDICTION, size)
    if f.status[FED] == 1:
        for k in range(2):
            f.likely[ALL_VALVES + k] = take_lengths(p, f, ALL_VALVES + k, every, y)
        weigh_models(f, ESTIMATE)
        mix(f, ESTIMATE, every)
        leave_contradiction(p, f, size)
    if h > 0.0:
        watch_valves(p, f, h, size)
        learn_jerk(p, f, h)
        learn_load(p, f, h)
    if f.status[FED] == 0:
        follow_prediction(p, f)


@inner
def leave_contradiction(p, f, size):
    """Begin the estimate anew where its tip is far outside what the lengths allow; channels that surprised count for less.

    The difference of an estimate and one with fewer readings has at most the variance of the latter.
    """
    n = p.drives.shape[0]
    for a in range(2):
        column_row(p, p.readings, n + a, 1.0, f.row)
        apart = read(f.row, f.mean[ESTIMATE], size) - read(f.row, f.mean[PREDICTION], size)
        if apart * apart > CONTRADICTION * CONTRADICTION * variance_of(f.row, f.spread[PREDICTION], f.gain, size):
            f.status[FED] = 0
    if f.status[FED] == 0:
        for c in range(f.excess.shape[0]):
            f.excess[c] = min(f.excess[c] * f.excess[c], MOST_EXCESS)


@inner
def weigh_models(f, mixture):
    """Bring the chances of a mixture's models up to date by their likelihoods."""
    first, count = models_of(mixture)
    most, total = f.likely[first], 0.0
    for k in range(1, count):
        most = max(most, f.likely[first + k])
    for k in range(count):
        f.chances[first + k] = max(f.chances[first + k] * math.exp(f.likely[first + k] - most), 1e-9)
        total += f.chances[first + k]
    for k in range(count):
        f.chances[first + k] /= total
    if mixture == ESTIMATE or f.status[FED] == 0:
        f.evidence[0] += most + math.log(total)


@inner
def watch_valves(p, f, h, size):
    """Believe valves open or closed by the rates of their drives in the model in which all are open."""
    n, drive, opened = p.drives.shape[0], drive_place(p), False
    for i in range(n):
        at = drive + n + i
        deviation = abs(f.x[OPEN, at]) / math.sqrt(max(f.p[OPEN, at, at], 1e-300))
        f.still[i] = f.still[i] + h if deviation < SHUT else 0.0
        if deviation > OPENED and f.chances[OPEN] > 0.5:
            if f.is_open[i] == 0:
                opened = True
                f.is_open[i] = 1
        elif f.still[i] > SHUT_TIME:
            f.is_open[i] = 0
    if opened:
        copy_model(f, OPEN, VALVES, size)
        copy_model(f, OPEN, BURST, size)
        if f.status[FED] == 1:
            copy_model(f, ALL_OPEN, ALL_VALVES, all_states(p))


@inner
def learn_jerk(p, f, h):
    """Learn how the accelerations of the drives change: a variance of 2/T (E a^2) is stationary under that density."""
    n = p.drives.shape[0]
    for i in range(n):
        at = drive_place(p) + 2 * n + i
        shown = 2.0 / DRIVE_TIME * (f.x[OPEN, at] * f.x[OPEN, at] + f.p[OPEN, at, at])
        time = JERK_RISE if shown > f.jerk[i] else JERK_FALL
        f.jerk[i] = min(max(f.jerk[i] + min(h / time, 1.0) * (shown - f.jerk[i]), LEAST_JERK), MOST_JERK)


@inner
def learn_length_noise(f, h, y):
    """Learn the noise of lengths from third differences, 20 times its variance; no cylinder moves so unevenly.

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
            f.load2[ESTIMATE] = f.load2[PREDICTION]
            return
        shown = 0.0
        for at in range(force_place(p), force_place(p) + 2):
            shown += 0.5 * (f.mean[k, at] * f.mean[k, at] + f.spread[k, at, at])
        f.load2[k] = learnt(f, f.load2[k], shown, h)


@inner
def learnt(f, before, shown, h):
    """Return a variance (N^2) brought towards what is shown."""
    found = before + min(h / LEARN_LOAD, 1.0) * (min(shown, SURPRISE * before) - before)
    return max(found, f.noise.least_load * f.noise.least_load)


@inner
def follow_prediction(p, f):
    """Make the estimate the prediction; nothing is known of the sensors' zeros."""
    size, every, n = zero_place(p), all_states(p), p.drives.shape[0]
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(f.pulls[i]))
    for k in range(2):
        for i in range(every):
            f.x[ALL_VALVES + k, i] = f.mean[PREDICTION, i] if i < size else 0.0
            for j in range(every):
                f.p[ALL_VALVES + k, i, j] = f.spread[PREDICTION, i, j] if i < size and j < size else 0.0
        covariance = f.p[ALL_VALVES + k]
        for a in range(2):
            covariance[size + a, size + a] = IMU_ZERO * IMU_ZERO
        covariance[size + 2, size + 2] = IMU_TURN * IMU_TURN
        covariance[size + 3, size + 3] = IMU_SCALE * IMU_SCALE
        for i in range(n):
            covariance[size + 4 + i, size + 4 + i] = ANGLE_ZERO * ANGLE_ZERO
            covariance[size + 4 + n + i, size + 4 + n + i] = (FORCE_ZERO * (abs(f.pulls[i]) + 0.1 * largest)) ** 2
            if f.deaf[i]:
                covariance[drive_place(p) + i, drive_place(p) + i] += DEAF_WAY * DEAF_WAY
                covariance[drive_place(p) + n + i, drive_place(p) + n + i] += DEAF_RATE * DEAF_RATE
    f.chances[ALL_VALVES], f.chances[ALL_OPEN] = f.chances[VALVES] + f.chances[BURST], f.chances[OPEN]
    mix(f, ESTIMATE, every)


# -- readings of the estimate -------------------------------------------------------------------------------------------------


@inner
def take_reading(p, f, channel, residual, zero, variance, age):
    """Take a residual of a channel, of the quantity in `f.row` with its zero at place `zero`, `age` s ago.

    Its noise is learnt: innovations that are larger than expected raise it until they are as expected.
    """
    if not math.isfinite(residual):
        return
    size, every, m = zero_place(p), all_states(p), p.modes[0]
    n, drive = p.drives.shape[0], drive_place(p)
    if age > 0.0:
        for j in range(m):
            q, v = f.row[j], f.row[m + j]
            f.row[j], f.row[m + j] = q + age * p.omega[j] * p.omega[j] * v, v - age * (q - p.decay[j] * v)
        for i in range(n):
            f.row[drive + n + i] -= age * f.row[drive + i]
    f.row[zero] = 1.0
    variance *= max(f.excess[channel], 1.0)
    shown = 0.0
    for k in range(ALL_VALVES, ALL_OPEN + 1):
        innovation = residual
        for i in range(every):
            known = f.mean[PREDICTION, i] if i < size else 0.0
            innovation -= f.row[i] * (f.x[k, i] - known)
        expected = variance + variance_of(f.row, f.p[k], f.gain, every)
        shown += f.chances[k] * innovation * innovation / expected
        weight = min((DOF + 1.0) / (DOF + innovation * innovation / expected), 1.0)
        expected = correct(f.x[k], f.p[k], f.row, f.gain, innovation, variance / weight, every)
        f.likely[k] -= 0.5 * (innovation * innovation / expected + math.log(expected))
    f.excess[channel] = max(f.excess[channel] * (1.0 + LEARN_NOISE * (min(shown, SURPRISE) - 1.0)), 1.0)


@inner
def angle_row(p, i, row):
    """Write the row of angle sensor `i`."""
    column_row(p, p.readings, i, 1.0, row)


@inner
def specific_force_row(p, f, axis, c, s, row):
    """Write the row of the IMU's x or z (`axis` 0 or 1) at a tip whose angle has cosine `c` and sine `s`."""
    n = p.drives.shape[0]
    acceleration_row(p, 0, f.rows[0])
    acceleration_row(p, 1, f.rows[1])
    column_row(p, p.readings, n + 2, f.felt[1] if axis == 0 else -f.felt[0], row)
    along, across = (c, s) if axis == 0 else (-s, c)
    zero = zero_place(p)
    for k in range(zero):
        row[k] += along * f.rows[0, k] + across * f.rows[1, k]
    row[zero + 2], row[zero + 3] = f.felt[1] if axis == 0 else -f.felt[0], f.felt[axis]


@kernel
def take_sensor(p, f, stream, first, residuals, stamp, newest):
    """Take residuals of one sample against the prediction into the estimate.

    Parameters
    ----------
    stream : int
        By `boom_twin.twin.blocks.CODES`: angles (rad), IMU (m/s^2) or forces (N); the estimate leaves out all others.
    first : int
        First of its channels among the measured ones.
    residuals : ndarray, shape (k,)
        NaN where missing.
    stamp, newest : int
        Of the sample, and of the newest lengths, ns.
    """
    n, zero, age = p.drives.shape[0], zero_place(p), (newest - stamp) * 1e-9
    if stream != ANGLES and stream != IMU and stream != FORCES:
        return
    channels = 2 if stream == IMU else n
    usable = False
    for i in range(channels):
        usable |= math.isfinite(residuals[i]) and not f.masked[first + i]
    if not usable or age > OLDEST:
        return
    f.status[FED], f.status[FED_STAMP] = 1, newest
    c, s = math.cos(f.angle[0]), math.sin(f.angle[0])
    f.likely[ALL_VALVES] = f.likely[ALL_OPEN] = 0.0
    for i in range(channels):
        if f.masked[first + i]:
            continue
        if stream == ANGLES:
            angle_row(p, i, f.row)
            take_reading(p, f, first + i, residuals[i], zero + 4 + i, f.noise.angle2, age)
        elif stream == IMU:
            specific_force_row(p, f, i, c, s, f.row)
            inexact2 = INEXACT * INEXACT * f.shaking[0]
            take_reading(p, f, first + i, residuals[i], zero + i, f.noise.acceleration2 + inexact2, age)
        else:
            column_row(p, p.forces, i, 1.0, f.row)
            take_reading(p, f, first + i, residuals[i], zero + 4 + n + i, f.noise.force2, age)
    weigh_models(f, ESTIMATE)
    mix(f, ESTIMATE, all_states(p))
