"""Corrections of the estimate by readings of all sensors."""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from .channels import READS_ACCELERATION, READS_ANGLE, READS_COORDINATE, READS_RATE, TIP_IMU_STATES, measurement_row
from .kalman import ANGLE_ZERO, correct
from .learning import SURPRISE
from .mixture import mix, weigh_models
from .rows import SWAY_SHARE, clear, read, variance_of
from .states import ALL_OPEN, ALL_VALVES, ESTIMATE, FED, FED_STAMP, PREDICTION, all_states, drive_place, zero_place

INEXACT = 0.03  # error of the model's accelerations and rates of turn: share of their root mean square at the site
LEARN_NOISE = 0.02  # weight of one reading in the learnt noise of its channel
LEARN_RATIO = 0.005  # weight of one reading in the mean square of its channel's normalised innovations
DOF = 4.0  # degrees of freedom of Student's t, the distribution of innovations of the estimate
SLOW = 5_000_000_000  # ns for which the position of a point keeps the estimate, beyond other readings
OLDEST = 0.1  # s, most that a reading may be late
CLEAR_RATE = 3.0  # standard deviations by which a reading's rate must differ from zero to tell of a lag


@kernel
def take_sensor(p, f, stream, first, residuals, stamp, newest):
    """Correct the estimate by the residuals of one sample against the prediction.

    Parameters
    ----------
    stream : int
        By `boom_twin.twin.blocks.CODES`; a stream without channels is left out.
    first : int
        First of its channels among the measured ones.
    residuals : ndarray, shape (k,)
        Those of its channels first; NaN where missing.
    stamp, newest : int
        Stamps of the sample, and of the newest lengths, ns.
    """
    age = (newest - stamp) * 1e-9
    last, usable, lag = first, False, p.channels[first].lag
    while last < p.channels.shape[0] and p.channels[last].stream == stream:
        usable |= math.isfinite(residuals[last - first]) and not f.masked[last]
        last += 1
    if not usable or age > OLDEST:
        return
    patience = SLOW if p.channels[first].kind == READS_COORDINATE else 0
    f.status[FED], f.status[FED_STAMP] = 1, max(f.status[FED_STAMP], newest + patience)
    f.likely[ALL_VALVES] = f.likely[ALL_OPEN] = 0.0
    for c in range(first, last):
        residual = residuals[c - first]
        if f.masked[c] or not math.isfinite(residual):
            continue
        channel = p.channels[c]
        admit_errors(p, f, max(channel.last, lag + 1) + 1)
        measurement_row(p, f, c, f.row)
        variance = channel.noise2
        if channel.kind == READS_ACCELERATION:
            variance += INEXACT * INEXACT * f.shaking[channel.site, 0]
        elif channel.kind == READS_RATE:
            variance += INEXACT * INEXACT * f.shaking[channel.site, 1]
        elif channel.kind == READS_ANGLE:
            variance += SWAY_SHARE * SWAY_SHARE * f.sway2[channel.index]
        if lag >= 0:
            variance += add_lag(p, f, lag, f.row)
        take_reading(p, f, c, residual, variance, age)
        if channel.kind == READS_ANGLE and f.deaf[channel.index]:
            replace_length(p, f, c, residual)
    weigh_models(f, ESTIMATE)
    mix(f, ESTIMATE, all_states(p))
    if lag >= 0:
        correct_stamps(p, f, lag)


@inner
def admit_errors(p, f, count):
    """Append states of sensor errors to the estimate until there are `count`, each with its first variance."""
    zero = zero_place(p)
    while p.behind[0] < count:
        at, p.behind[0] = zero + p.behind[0], p.behind[0] + 1
        for k in range(ALL_VALVES, ALL_OPEN + 1):
            f.x[k, at] = 0.0
            for i in range(at + 1):
                f.p[k, i, at] = f.p[k, at, i] = 0.0
            f.p[k, at, at] = p.errors[at - zero - TIP_IMU_STATES - 2 * p.drives.shape[0]].first ** 2


@inner
def add_lag(p, f, lag, row):
    """Add the column of a stream's lag to a row, minus the rate of the reading; return the variance by an uncertain rate.

    A rate that may be zero tells nothing of the lag. The lag is then noise.
    """
    size, at, rates, h = zero_place(p), zero_place(p) + lag, f.rows[2], f.interval[1]
    if h == 0.0:
        return 0.0
    clear(rates, all_states(p))
    for i in range(size):
        if row[i] != 0.0:
            rates[i] -= row[i] / h
            for c in range(f.counts[i]):
                rates[f.places[i, c]] += row[i] / h * f.weights[i, c]
    rate, variance = read(rates, f.mean[ESTIMATE], size), variance_of(rates, f.spread[ESTIMATE], f.gain, size)
    if rate * rate > CLEAR_RATE * CLEAR_RATE * variance:
        row[at] = -rate
    else:
        variance += rate * rate
    return variance * f.spread[ESTIMATE, at, at]


@inner
def correct_stamps(p, f, lag):
    """Add the estimated lag to the lags of its streams, and set its state to zero: rows are linear about the estimate."""
    at = zero_place(p) + lag
    change = f.mean[ESTIMATE, at]
    for k in range(ALL_VALVES, ALL_OPEN + 1):
        f.x[k, at] -= change
    f.mean[ESTIMATE, at] = 0.0
    for c in range(p.channels.shape[0]):
        if p.channels[c].lag == lag and (c == 0 or p.channels[c].stream != p.channels[c - 1].stream):
            f.lags[p.channels[c].stream] += change


@inner
def replace_length(p, f, c, residual):
    """Correct the prediction by the residual of the angle sensor `c`, because the stroke transducer of its cylinder fails.

    The mean of the mixture follows in the next step: further residuals of the sample are against the old one.
    """
    size = zero_place(p)
    measurement_row(p, f, c, f.row)
    for k in range(ALL_VALVES):
        innovation = residual
        for j in range(size):
            innovation -= f.row[j] * (f.x[k, j] - f.mean[PREDICTION, j])
        correct(f.x[k], f.p[k], f.row, f.gain, innovation, p.channels[c].noise2 + ANGLE_ZERO * ANGLE_ZERO, size)


@inner
def take_reading(p, f, channel, residual, variance, age):
    """Correct the estimate by a residual of the quantity in `f.row`, `age` s old, of a measured channel.

    Its noise is learnt: innovations that are larger than expected raise it until they are as expected. The evidence
    scales innovations by their recent mean square: a model gains nothing by stating a smaller variance.
    """
    size, every, m = zero_place(p), all_states(p), p.modes[0]
    n, drive = p.drives.shape[0], drive_place(p)
    if age > 0.0:
        for j in range(m):
            q, v = f.row[j], f.row[m + j]
            f.row[j], f.row[m + j] = q + age * p.omega[j] * p.omega[j] * v, v - age * (q - p.decay[j] * v)
        for i in range(n):
            f.row[drive + n + i] -= age * f.row[drive + i]
    f.row[size + p.channels[channel].zero] = 1.0
    variance *= max(f.excess[channel], 1.0)
    shown, likelihood, ratio = 0.0, 0.0, f.ratio[channel]
    for k in range(ALL_VALVES, ALL_OPEN + 1):
        innovation = residual
        for i in range(every):
            known = f.mean[PREDICTION, i] if i < size else 0.0
            innovation -= f.row[i] * (f.x[k, i] - known)
        expected = variance + variance_of(f.row, f.p[k], f.gain, every)
        normalised2 = innovation * innovation / expected
        shown += f.chances[k] * normalised2
        tail = 1.0 + normalised2 / (DOF * ratio)
        likelihood += f.chances[k] / math.sqrt(ratio * expected * tail ** (DOF + 1.0))
        weight = min((DOF + 1.0) / (DOF + normalised2), 1.0)
        expected = correct(f.x[k], f.p[k], f.row, f.gain, innovation, variance / weight, every)
        f.likely[k] -= 0.5 * (innovation * innovation / expected + math.log(expected))
    f.evidence[0] += math.log(max(likelihood, 1e-300))
    f.ratio[channel] += LEARN_RATIO * (min(shown, SURPRISE * ratio) - ratio)
    f.excess[channel] = max(f.excess[channel] * (1.0 + LEARN_NOISE * (min(shown, SURPRISE) - 1.0)), 1.0)
