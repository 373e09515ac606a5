"""Corrections of the estimate by angles, IMU and cylinder forces."""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from .kalman import ANGLE_ZERO, correct
from .learning import SURPRISE
from .mixture import mix, weigh_models
from .models import SWAY_SHARE
from .rows import angle_row, force_row, specific_force_row, variance_of
from .states import (
    ALL_OPEN,
    ALL_VALVES,
    ANGLES,
    ESTIMATE,
    FED,
    FED_STAMP,
    FORCES,
    IMU,
    PREDICTION,
    all_states,
    drive_place,
    zero_place,
)

INEXACT = 0.03  # share of the tip's acceleration that modes left out and those there are wrong by
LEARN_NOISE = 0.02  # of a reading, by which the noise of its channel is learnt
LEARN_RATIO = 0.005  # of a reading, by which the size of its channel's normalised innovations is learnt
DOF = 4.0  # degrees of freedom of Student's t, by which innovations of the estimate are weighed
OLDEST = 0.1  # s, most that a reading may be late


@kernel
def take_sensor(p, f, stream, first, residuals, stamp, newest):
    """Correct the estimate by the residuals of one sample against the prediction.

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
            angle_row(p, f, i, f.row)
            inexact2 = SWAY_SHARE * SWAY_SHARE * f.sway2[i]
            take_reading(p, f, first + i, residuals[i], zero + 4 + i, f.noise.angle2 + inexact2, age)
            if f.deaf[i] and math.isfinite(residuals[i]):
                replace_length(p, f, i, residuals[i])
        elif stream == IMU:
            specific_force_row(p, f, i, c, s, f.row)
            inexact2 = INEXACT * INEXACT * f.shaking[0]
            take_reading(p, f, first + i, residuals[i], zero + i, f.noise.acceleration2 + inexact2, age)
        else:
            force_row(p, i, f.row)
            take_reading(p, f, first + i, residuals[i], zero + 4 + n + i, f.noise.force2, age)
    weigh_models(f, ESTIMATE)
    mix(f, ESTIMATE, all_states(p))


@inner
def replace_length(p, f, i, residual):
    """Correct the prediction by the residual of angle sensor `i`, because the stroke transducer of its cylinder fails.

    The mean stays that of the prediction which the residual was taken against, until the next step.
    """
    size = zero_place(p)
    angle_row(p, f, i, f.row)
    for k in range(ALL_VALVES):
        innovation = residual
        for j in range(size):
            innovation -= f.row[j] * (f.x[k, j] - f.mean[PREDICTION, j])
        correct(f.x[k], f.p[k], f.row, f.gain, innovation, f.noise.angle2 + ANGLE_ZERO * ANGLE_ZERO, size)


@inner
def take_reading(p, f, channel, residual, zero, variance, age):
    """Correct the estimate by a residual of the quantity in `f.row`, `age` s old, of a channel with its zero at place `zero`.

    Its noise is learnt: innovations that are larger than expected raise it until they are as expected. The evidence takes
    innovations by the size that they have lately had, for a model is not better for expecting less of the same innovations.
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
