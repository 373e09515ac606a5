"""Kalman filters on cylinder lengths or joint angles: the prediction from these alone, and the estimate from all sensors.

A transducer reads the length of its cylinder, oil compressed. Its drive, the length with unloaded oil, is a state:

    length_i = d_i + x_i,    x_i = c_i E_i,    F_i = E_i + tau_i E_i',

with the oil's compression x_i (tension positive), the elastic force E_i, linear in drives, load and modes (`posture`), and the
force F_i on the pins, which has that of the damping d_i = k_i tau_i too.

Recordings of drives themselves are the case c_i = 0 of that reading; the boom keeps its oil. Where angles drive the model,
a row of an angle stands in the place of that of a length: by the linkage, an encoder reads the length of its cylinder.

States: modal coordinates and rates of the vibration about static equilibrium; a fast and a slow part of the force at the tip
that the model does not know (Gauss-Markov, `FAST` and `SLOW` seconds); length, rate and acceleration of the drives. The
estimate adds zeros of IMU, angle sensors and force sensors, and errors of further sensors.

A closed valve locks the oil, so its drive stands still: that is a reading of rate zero. Three models interact (H. Blom and
Y. Bar-Shalom, IEEE Trans. Automat. Control 33 (1988), 780-783): valves as they are believed to be; all valves open; valves as
believed under a load that has just come. Where the second explains the lengths best, valves whose drives move by the odds are
believed open, until they stand still. The estimate has the same models with the readings of all sensors, and valves of its own.

How far a drive's acceleration changes, and how large the fast load is, is learnt: the variance that a state is expected to have
goes to the one that it shows (expectation maximisation, one step a sample).
"""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from .kalman import (
    FAST,
    correct,
    first_variances,
    gain_after,
    log_innovation,
    make_transition,
    subtract,
    take_gains,
    take_innovation,
    transit,
)
from .learning import learn_jerk, learn_length_noise, learn_load, watch_valves
from .mixture import MEMORY, MODELS, copy_model, first_model, interact, mix, weigh_models
from .rows import SWAY_SHARE, column_row, drive_row, reach2, read, variance_of
from .states import (
    ALL_BURST,
    ALL_VALVES,
    BURST,
    DOUBTS,
    ESTIMATE,
    FED,
    OPEN,
    PREDICTION,
    VALVES,
    all_states,
    copy_place,
    drive_place,
    force_place,
    whole,
    zero_place,
)

JERK = 3e-3  # m^2/s^5, density of the jerk of a drive that begins to move
CLOSED_RATE, CLOSED_ACCELERATION = 1e-5, 1e-3  # m/s, m/s^2, noise of the reading that a closed valve's drive stands still
UNREAD = 0.1  # m, standard deviation of a moving drive before the first reading: more than oil is ever compressed by
FIRST_CHANCES = 0.89, 0.01, 0.1  # of the models; few sessions start in a move
LONGEST_STEP = 0.02  # s of one transition
CONTRADICTION = 8.0  # standard deviations by which the tips of estimate and prediction may differ
MOST_EXCESS = 1e6  # times the variance that a channel is stated to have


@kernel
def start_models(p, f, speed, swing, may_move):
    """Start at rest at the drives of the posture.

    In the model of open valves drives may move at `speed` (m/s), and the tip may vibrate by `swing` (m); in all models if the
    boom `may_move`.
    """
    n, m, size = p.drives.shape[0], p.modes[0], all_states(p)
    load, drive = force_place(p), drive_place(p)
    noise, x, covariance = f.noise, f.x[VALVES], f.p[VALVES]
    f.x[:], f.p[:] = 0.0, 0.0  # of the estimate's models too: a share of 0 of what is not a number would not be 0
    f.load2[:] = noise.usual_load * noise.usual_load
    for a in range(2):
        covariance[load + a, load + a] = f.load2[0, a]
        covariance[load + 2 + a, load + 2 + a] = noise.first_load * noise.first_load
        covariance[load + 4 + a, load + 4 + a] = f.load2[0, a] / (FAST * FAST)
    for j in range(m):
        omega2 = p.omega[j] * p.omega[j]
        off2 = 0.1 * reach2(p, 2 + n + j) * f.load2[0, 0] / (omega2 * omega2)
        covariance[j, j], covariance[m + j, m + j] = off2, omega2 * off2
    for i in range(n):
        x[drive + i] = p.drives[i]
        covariance[drive + i, drive + i] = f.noise.length2 * first_scale(p, i)
        covariance[drive + n + i, drive + n + i] = CLOSED_RATE * CLOSED_RATE
        f.jerk[i], f.is_open[PREDICTION, i], f.still[PREDICTION, i] = JERK, 1 if may_move else 0, 0.0
        f.length2[i], f.pulls[i] = noise.length2, p.pulled[i]
        f.before[i, 0] = f.before[i, 1] = f.before[i, 2] = math.nan
    f.bends[:], f.swing[:], f.sway2[:] = 0.0, 0.0, 0.0
    copy_model(f, VALVES, OPEN, size)
    add_motion(p, f, speed, swing)
    if may_move:
        copy_model(f, OPEN, VALVES, size)
    copy_model(f, VALVES, BURST, size)
    f.chances[VALVES], f.chances[OPEN], f.chances[BURST] = FIRST_CHANCES
    f.excess[:], f.ratio[:], f.shaking[:] = 1.0, 1.0, 0.0
    mix(f, PREDICTION, zero_place(p))
    take_prediction(p, f, 1.0)
    f.status[FED] = 0


@inner
def add_motion(p, f, speed, swing):
    """Let drives of the model of open valves move at `speed` (m/s), and the tip vibrate by `swing` (m).

    A length is the sum of the drive and the oil's compression. In a move neither is that at rest, so the first reading gives
    their sum only. It is taken here because it does not tell this model from those of rest, which it has made.
    """
    n, m, drive, size = p.drives.shape[0], p.modes[0], drive_place(p), zero_place(p)
    x, covariance = f.x[OPEN], f.p[OPEN]
    for j in range(m):
        omega2, motion2, off2 = p.omega[j] * p.omega[j], reach2(p, 2 + n + j), 0.0
        if j == 0 and motion2 > 0.0:
            off2 = swing * swing / motion2
        for i in range(n):
            off2 += (p.forces[2 + n + j, i] * speed) ** 2 / (omega2 * omega2 * omega2)
        covariance[j, j] += off2
        covariance[m + j, m + j] += omega2 * off2
    for i in range(n):
        covariance[drive + i, drive + i] = UNREAD * UNREAD
        covariance[drive + n + i, drive + n + i] += speed * speed
    for i in range(n):
        drive_row(p, f, i, x, f.row, size)
        correct(x, covariance, f.row, f.gains[0], 0.0, f.noise.length2, size)


@inner
def first_scale(p, i):
    """Return the variance of drive `i` over that of what drives the model; an inclinometer needs its neighbour's reading."""
    if not p.reads_angle:
        return 1.0
    return (2.0 if p.absolute[i] else 1.0) / (p.slope[i] * p.slope[i])


@kernel
def step_models(p, f, h, y):
    """Step all models by `h` (s) to readings `y` that drive the model (n; lengths in m or angles in rad; NaN = missing)."""
    size, mixtures = zero_place(p), 1 + f.status[FED]
    learn_length_noise(f, h, y)
    burst2 = f.noise.burst_load * f.noise.burst_load
    if h > 0.0:
        steps = max(1, math.ceil(h / LONGEST_STEP - 1e-6))
        for mixture in range(mixtures):
            # other sensors, or angles, tell soon whether a valve has opened
            memory = 0.0 if p.reads_angle or mixture == ESTIMATE else MEMORY
            interact(f, mixture, states_of(p, mixture), h, memory)
        make_transition(p, f, h / steps)
        for mixture in range(mixtures):
            first, states = first_model(mixture), states_of(p, mixture)
            for k in range(first, first + MODELS):
                least2 = burst2 if k == first + BURST else 0.0
                for _ in range(steps):
                    transit(p, f, k, states, h / steps, f.load2[mixture], least2)
                if k != first + OPEN:
                    hold_still(p, f, k, f.is_open[mixture], states)
    note_innovations(p, f, y)
    evidence = 0.0
    for mixture in range(mixtures):
        first = first_model(mixture)
        for k in range(first, first + MODELS):
            f.likely[k] = take_lengths(p, f, k, states_of(p, mixture), y)
        evidence = weigh_models(f, mixture)
        mix(f, mixture, states_of(p, mixture))
    if f.status[FED] == 1:
        doubt_estimate(p, f, size)
    f.evidence[0] += evidence
    if h > 0.0:
        for mixture in range(mixtures):
            watch_valves(p, f, h, mixture, states_of(p, mixture))
        learn_jerk(p, f, h)
        learn_load(p, f, h)
    if f.status[FED] == 0:
        take_prediction(p, f, 1.0)


@inner
def states_of(p, mixture):
    """Return the number of states of a mixture's models."""
    return zero_place(p) if mixture == PREDICTION else all_states(p)


@inner
def hold_still(p, f, k, is_open, size):
    """Correct model `k` by readings of zero rate and acceleration of drives behind closed valves."""
    n, drive, count, gains, width = p.drives.shape[0], drive_place(p), 0, f.gains[0], whole(size)
    keep_unread(p, f, k, size)
    for i in range(n):
        if is_open[i] == 0 and not f.deaf[i]:
            for order in (1, 2):
                at, gain = drive + order * n + i, gains[count]
                for j in range(width):
                    gain[j] = f.p[k, at, j]
                for c in range(count):
                    subtract(gain, gains[c, at], gains[c], size)
                noise = CLOSED_RATE if order == 1 else CLOSED_ACCELERATION
                expected = gain[at] + noise * noise
                count = take_innovation(f.x[k], f.p[k], gains, count, -f.x[k, at], expected, size)
    take_gains(f.p[k], gains, count, size)
    restore_unread(p, f, k, size)


@inner
def note_innovations(p, f, y):
    """Write the rows of readings `y`, these less their mean predicted by the mixture, and the variances of the difference."""
    n = y.shape[0]
    size = zero_place(p) if p.reads_angle else drive_place(p) + n  # a length does not depend on the states behind
    for i in range(n):
        mean, square, row = 0.0, 0.0, f.driving[i]
        reading, first = drive_row(p, f, i, f.x[VALVES], row, size), read(row, f.x[VALVES], size)
        f.offsets[i] = reading - first
        for k in range(BURST + 1):
            apart = read(row, f.x[k], size) - first
            mean += f.chances[k] * apart
            square += f.chances[k] * (apart * apart + variance_of(row, f.p[k], f.gain, size))
        f.innovations[i, 0], f.innovations[i, 1] = y[i] - reading - mean, square - mean * mean + drive_noise2(p, f, i)
        if math.isfinite(y[i]) and not f.deaf[i]:
            log_innovation(f, i, f.innovations[i, 0], f.innovations[i, 1])


@inner
def drive_noise2(p, f, i):
    """Return the variance of the noise of sensor `i` of those that drive the model."""
    return f.length2[i] + SWAY_SHARE * SWAY_SHARE * f.sway2[i] if p.reads_angle else f.length2[i]


@inner
def take_lengths(p, f, k, size, y):
    """Correct model `k` by readings `y` (n; NaN = missing); return their log likelihood."""
    total, count, gains = 0.0, 0, f.gains[0]
    keep_unread(p, f, k, size)
    for i in range(y.shape[0]):
        if math.isfinite(y[i]) and not f.deaf[i]:
            innovation = y[i] - f.offsets[i] - read(f.driving[i], f.x[k], size)
            expected = drive_noise2(p, f, i) + gain_after(f.p[k], f.driving[i], gains, count, size)
            count = take_innovation(f.x[k], f.p[k], gains, count, innovation, expected, size)
            total -= 0.5 * (innovation * innovation / expected + math.log(expected))
    take_gains(f.p[k], gains, count, size)
    restore_unread(p, f, k, size)
    return total


@inner
def keep_unread(p, f, k, size):
    """Write to scratch what model `k` knows of drives whose transducers are left out, for `restore_unread`.

    Lengths of other cylinders depend on such a drive only by how it turns the boom, which is linear near the posture alone. So
    they do not correct it, but their expected errors contain its variance: a consider state (S. Schmidt, Advances in Control
    Systems 3 (1966), 293-340). Copies of late readings contain the drive as it was, so they are consider states too: corrected
    without the drive, they would no longer tell of it.
    """
    if not f.deaf.any():
        return
    for i in range(size):
        if is_unread(p, f, i):
            f.kept_mean[i] = f.x[k, i]
            for j in range(size):
                f.kept[i, j] = f.p[k, i, j]


@inner
def restore_unread(p, f, k, size):
    """Undo what readings since `keep_unread` told model `k` of drives whose transducers are left out."""
    if not f.deaf.any():
        return
    for i in range(size):
        if is_unread(p, f, i):
            f.x[k, i] = f.kept_mean[i]
            for j in range(size):
                if is_unread(p, f, j):
                    f.p[k, i, j] = f.kept[i, j]


@inner
def is_unread(p, f, i):
    """Return True if state `i` is of a drive whose transducer is left out, or the copy of a late reading."""
    n, at = p.drives.shape[0], i - drive_place(p)
    return i >= copy_place(p) or (0 <= at < 3 * n and f.deaf[at % n])


@inner
def doubt_estimate(p, f, size):
    """Doubt the estimate if its tip is far off the predicted one; channels with excess noise lose weight.

    Either may be wrong: the prediction where a valve opens unseen, the estimate where a sensor fails. So both are equally
    likely from then on.
    """
    n, is_doubted = p.drives.shape[0], False
    for a in range(2):
        column_row(p, p.readings, n + a, 1.0, f.row)
        apart = read(f.row, f.mean[ESTIMATE], size) - read(f.row, f.mean[PREDICTION], size)
        variance = variance_of(f.row, f.spread[ESTIMATE], f.gain, size) + variance_of(f.row, f.spread[PREDICTION], f.gain, size)
        is_doubted |= apart * apart > CONTRADICTION * CONTRADICTION * variance
    if is_doubted:
        f.status[DOUBTS] += 1
        for c in range(f.excess.shape[0]):
            f.excess[c] = min(f.excess[c] * f.excess[c], MOST_EXCESS)
        take_prediction(p, f, 0.5)


@kernel
def take_prediction(p, f, share):
    """Give the prediction a `share` of the probability of the estimate; of a share of 1 the estimate is the prediction.

    Mean and covariance are those of both together,

        x = (1 - s) x_e + s x_p,    P = (1 - s) P_e + s P_p + s (1 - s) (x_e - x_p) (x_e - x_p)^T.

    The prediction knows nothing of sensors' errors. A valve that is open in either is open.
    """
    p.delayed[0] = 0
    size, every, n, kept = zero_place(p), all_states(p), p.drives.shape[0], 1.0 - share
    first_variances(p, f, f.gain)
    for i in range(n):
        if kept == 0.0 or f.is_open[PREDICTION, i] == 1:
            f.is_open[ESTIMATE, i], f.still[ESTIMATE, i] = f.is_open[PREDICTION, i], f.still[PREDICTION, i]
    for k in range(ALL_VALVES, ALL_BURST + 1):
        source = k - ALL_VALVES
        f.chances[k] = kept * f.chances[k] + share * f.chances[source]
        for i in range(every):
            f.row[i] = f.x[k, i] - (f.x[source, i] if i < size else 0.0)
            f.x[k, i] -= share * f.row[i]
        for i in range(every):
            for j in range(every):
                f.p[k, i, j] = kept * (f.p[k, i, j] + share * f.row[i] * f.row[j])
                if i < size and j < size:
                    f.p[k, i, j] += share * f.p[source, i, j]
            if i >= size:
                f.p[k, i, i] += share * f.gain[i]
    mix(f, ESTIMATE, every)
