"""Corrections of the estimate by readings of all sensors."""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from .channels import (
    READS_ACCELERATION,
    READS_ANGLE,
    READS_COORDINATE,
    READS_FORCE,
    READS_RATE,
    TIP_IMU_STATES,
    measurement_row,
)
from .delayed import delayed_row, note_lateness
from .kalman import ANGLE_ZERO, correct, gain_after, log_innovation, take_gains, take_innovation
from .learning import SURPRISE
from .mixture import MODELS, mix_means, renew_estimate, weigh_models
from .rows import SWAY_SHARE, clear, difference, read, variance_of
from .states import ALL_BURST, ALL_VALVES, ESTIMATE, FED, FED_STAMP, IS_OLD, PREDICTION, all_states, zero_place

INEXACT = 0.03  # error of the model: share of accelerations and rates of turn at a site (rms), of forces beside those at rest
LEARN_NOISE = 0.02  # weight of one reading in the learnt noise of its channel
LEARN_RATIO = 0.005  # weight of one reading in the mean square of its channel's normalised innovations
APART_TIME = 0.1  # s, over which residuals of angles are averaged
DOF = 4.0  # degrees of freedom of Student's t, the distribution of innovations of the estimate
SLOW = 5_000_000_000  # ns for which the position of a point keeps the estimate, beyond other readings
OLDEST = 0.1  # s, most that a reading may be late
CLEAR_RATE = 3.0  # standard deviations by which a reading's rate must differ from zero to tell of a lag


@kernel
def take_sensor(p, f, stream, first, residuals, stamp, newest):
    """Correct the estimate by the residuals of one sample against the prediction; `spread` is left to `renew_estimate`.

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
    age, share = (newest - stamp) * 1e-9, min(max(stamp - f.taken[stream], 0) * 1e-9 / APART_TIME, 1.0)  # s, 1
    last, errors, lag = first, 0, p.channels[first].lag
    while last < p.channels.shape[0] and p.channels[last].stream == stream:
        residual, channel = residuals[last - first], p.channels[last]
        if math.isfinite(residual) and not f.masked[last]:
            errors = max(errors, channel.last + 1, lag + 2)
        if math.isfinite(residual) and channel.kind == READS_ANGLE and not f.settled[channel.index]:
            f.apart[channel.index] += share * (residual - f.apart[channel.index])
        last += 1
    if errors == 0 or age > OLDEST:
        return
    if lag >= 0:
        renew_estimate(p, f)
    patience = SLOW if p.channels[first].kind == READS_COORDINATE else 0
    f.status[FED], f.status[FED_STAMP] = 1, max(f.status[FED_STAMP], newest + patience)
    if age > 0.0:
        note_lateness(p, f, stream, first, last, age)
    admit_errors(p, f, errors)
    f.likely[ALL_VALVES:], count = 0.0, 0
    for c in range(first, last):
        residual = residuals[c - first]
        if f.masked[c] or not math.isfinite(residual):
            continue
        channel, span, share = p.channels[c], 0.0, 0.0
        if age == 0.0:
            measurement_row(p, f, c, f.row)
            f.row[zero_place(p) + channel.zero] = 1.0
            if lag >= 0:
                rate_of_row(p, f, f.row, f.rows[2])
        else:
            span, share = delayed_row(p, f, c, stamp, f.row, f.rows[2])
            if span == 0.0:
                continue
        variance = channel.noise2
        if channel.kind == READS_ACCELERATION:
            variance += INEXACT * INEXACT * f.shaking[channel.site, 0]
        elif channel.kind == READS_FORCE:
            beside = f.pulls[channel.index] - p.pulled[channel.index]
            variance += INEXACT * INEXACT * beside * beside
        elif channel.kind == READS_RATE:
            variance += INEXACT * INEXACT * f.shaking[channel.site, 1]
        elif channel.kind == READS_ANGLE:
            variance += SWAY_SHARE * SWAY_SHARE * f.sway2[channel.index]
        variance += interpolation_variance(f.curves[c, 2], span, share, 1e-9 * (stamp - f.taken[stream]))
        if lag >= 0:
            variance += add_lag(p, f, lag, f.row, f.rows[2])
        count = take_reading(p, f, c, count, residual, variance)
        if channel.kind == READS_ANGLE and f.deaf[channel.index]:
            replace_length(p, f, c, residual)
    for k in range(MODELS):
        take_gains(f.p[ALL_VALVES + k], f.gains[k], count, all_states(p))
    f.taken[stream] = stamp
    weigh_models(f, ESTIMATE)
    mix_means(f, ESTIMATE, all_states(p))
    f.status[IS_OLD] = 1
    if lag >= 0:
        correct_stamps(p, f, lag)


@inner
def interpolation_variance(curvature2, span, share, apart):
    """Return the variance by linear interpolation between two instants `span` (s) apart, for one of readings `apart` (s) apart.

    The error is half the second derivative times the distances to both. All readings between the instants have it in common,
    so each counts as a share of one.
    """
    error = 0.5 * share * (1.0 - share) * span * span
    return curvature2 * error * error * (span / apart if 0.0 < apart < span else 1.0)


@inner
def admit_errors(p, f, count):
    """Append states of sensor errors to the estimate until there are `count`, each with its first variance."""
    zero = zero_place(p)
    if p.behind[0] < count:
        p.delayed[0] = 0  # copies stand behind
    while p.behind[0] < count:
        at, p.behind[0] = zero + p.behind[0], p.behind[0] + 1
        for k in range(PREDICTION, ESTIMATE + 1):
            f.mean[k, at] = 0.0
            for i in range(at + 1):
                f.spread[k, i, at] = f.spread[k, at, i] = 0.0
        for k in range(ALL_VALVES, ALL_BURST + 1):
            f.x[k, at] = 0.0
            for i in range(at + 1):
                f.p[k, i, at] = f.p[k, at, i] = 0.0
            f.p[k, at, at] = p.errors[at - zero - TIP_IMU_STATES - 2 * p.drives.shape[0]].first ** 2


@inner
def rate_of_row(p, f, row, rates):
    """Write the row of the rate of the reading of `row` at the newest instant."""
    size, h = zero_place(p), f.interval[1]
    clear(rates, all_states(p))
    if h > 0.0:
        for j in range(size):
            rates[j] = (read(row, f.transition[j], size) - row[j]) / h


@inner
def add_lag(p, f, lag, row, rates):
    """Add the column of a stream's lag to a row, minus the rate of the reading; return the variance by an uncertain rate.

    A rate that may be zero tells nothing of the lag. The lag is then noise.
    """
    every, at = all_states(p), zero_place(p) + lag
    rate, variance = read(rates, f.mean[ESTIMATE], every), variance_of(rates, f.spread[ESTIMATE], f.gain, every)
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
    for k in range(ALL_VALVES, ALL_BURST + 1):
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
        innovation = residual - difference(f.row, f.x[k], f.mean[PREDICTION], size)
        correct(f.x[k], f.p[k], f.row, f.gains[MODELS], innovation, p.channels[c].noise2 + ANGLE_ZERO * ANGLE_ZERO, size)


@inner
def take_reading(p, f, channel, count, residual, variance):
    """Correct the estimate by a residual of the quantity in `f.row` of a measured channel; return how many gains are left.

    Its noise is learnt: innovations that are larger than expected raise it until they are as expected. The evidence
    scales innovations by their recent mean square: a model gains nothing by stating a smaller variance.
    """
    every = all_states(p)
    variance *= max(f.excess[channel], 1.0)
    shown, likelihood, ratio, left, mean, mean2 = 0.0, 0.0, f.ratio[channel], 0, 0.0, 0.0
    for k in range(ALL_VALVES, ALL_BURST + 1):
        gains = f.gains[k - ALL_VALVES]
        innovation = residual - difference(f.row, f.x[k], f.mean[PREDICTION], every)
        own2 = max(gain_after(f.p[k], f.row, gains, count, every), 0.0)
        expected = variance + own2
        normalised2 = innovation * innovation / expected
        mean += f.chances[k] * innovation
        mean2 += f.chances[k] * expected
        shown += f.chances[k] * normalised2
        tail = 1.0 + normalised2 / (DOF * ratio)
        likelihood += f.chances[k] / math.sqrt(ratio * expected * tail ** (DOF + 1.0))
        weight = min((DOF + 1.0) / (DOF + normalised2), 1.0)
        expected = variance / weight + own2
        left = take_innovation(f.x[k], f.p[k], gains, count, innovation, expected, every)
        f.likely[k] -= 0.5 * (innovation * innovation / expected + math.log(expected))
    f.evidence[0] += math.log(max(likelihood, 1e-300))
    log_innovation(f, p.drives.shape[0] + channel, mean, ratio * mean2)
    f.ratio[channel] += LEARN_RATIO * (min(shown, SURPRISE * ratio) - ratio)
    f.excess[channel] = max(f.excess[channel] * (1.0 + LEARN_NOISE * (min(shown, SURPRISE) - 1.0)), 1.0)
    return left
