"""Measurements of the filter behind the estimate of the tip: rows by which sensors read its state, and corrections by them.

What the states are, and the equations: `boom_twin.estimation.tip_estimate`.
"""

from __future__ import annotations

import math

from ..kernels.jit import inner
from ..types import NANO
from .deviation_filter import (
    ANGLE,
    ANGLES_STAMP,
    BIAS,
    COUNT,
    ERROR,
    FED,
    FELT_X,
    FELT_Y,
    FORCED,
    IMU_STAMP,
    LOAD,
    SCALE,
    SHARES,
    SOFT,
    STAMP,
    TURNED,
    add_row,
    clear,
    covary,
    input_place,
    is_sag,
    mode_place,
    offset_place,
    oscillate,
    states_of,
)
from .deviation_step import LONGEST_STEP, add_offsets, add_unknown, load_after
from .load_level import BY_ANGLES, BY_IMU, add_innovation, begin_sample, follow_levels

UNLIKELY = 4.0  # innovations beyond so many deviations count less the larger they are: a spike moves little

OLDEST = 0.25  # s, age of a sample that still counts


@inner
def read_tip(f, axis, row):
    """Row of the tip's x, y or angle."""
    n, size = f.softness.shape[0], states_of(f)
    clear(row, size)
    for i in range(n):
        row[SHARES + i] = f.lever[i, axis] * f.drawn[i]
    for j in range(f.status[COUNT]):
        at, still = mode_place(f, j), f.tip[j, axis] / (f.omega[j] * f.omega[j])
        row[at] = f.tip[j, axis]
        for i in range(n):
            row[SHARES + i] -= still * f.coupling[j, 2 + i]
            row[SHARES + n + i] += still * f.coupling[j, 2 + n + i]


@inner
def read_angle(f, i, row):
    """Row of an angle sensor; gives the variance that strokes' noise adds to it."""
    n, size, variance = f.softness.shape[0], states_of(f), 0.0
    clear(row, size)
    for k in range(n):
        if k == i or (f.absolute[i] and k < i):
            row[SHARES + k] = f.drawn[k] / f.slopes[k]
            variance += f.variances[k] / (f.slopes[k] * f.slopes[k])
    for j in range(f.status[COUNT]):
        at, still = mode_place(f, j), f.turns[j, i] / (f.omega[j] * f.omega[j])
        row[at] = f.turns[j, i]
        for k in range(n):
            row[SHARES + k] -= still * f.coupling[j, 2 + k]
            if f.absolute[i]:
                row[SHARES + n + k] += still * f.coupling[j, 2 + n + k]
    return variance


@inner
def read_force(f, i, row):
    """Row of a cylinder's force, which no share a or b changes at rest; gives the variance that strokes' noise adds to it.

    What is wrong with a stroke is in the predicted force at once, by the modes' stiffness; their motion takes it away later.
    """
    n, size, variance = f.softness.shape[0], states_of(f), 0.0
    clear(row, size)
    for j in range(f.status[COUNT]):
        at, still = mode_place(f, j), f.forces[j, i] / (f.omega[j] * f.omega[j])
        row[at] = f.forces[j, i]
        for k in range(n):
            row[SHARES + k] -= still * f.coupling[j, 2 + k]
    row[offset_place(f, i)] = 1.0
    for k in range(n):
        stiffness = 0.0
        for j in range(f.status[COUNT]):
            stiffness += f.forces[j, i] * f.forces[j, k] / (f.omega[j] * f.omega[j])
        variance += stiffness * stiffness * f.variances[k]
    return variance


@inner
def read_acceleration(f, x, y, turn, turned, row):
    """Row of the tip's acceleration along (x, y), `turn` times its angular one and `turned` times its turn beside."""
    size, n = states_of(f), f.softness.shape[0]
    clear(row, size)
    row[ERROR], row[ERROR + 1] = x, y
    for j in range(f.status[COUNT]):
        at = mode_place(f, j)
        along = x * f.tip[j, 0] + y * f.tip[j, 1] + turn * f.tip[j, 2]
        row[at] = -f.omega[j] * f.omega[j] * along + turned * f.tip[j, 2]
        row[at + 1] = -f.decay[j] * along
        for b in range(f.coupling.shape[1]):
            by = turned * f.tip[j, 2] / (f.omega[j] * f.omega[j]) if is_sag(b, n) else along
            row[input_place(f, b)] += by * f.coupling[j, b]


@inner
def age_of(f, stamp):
    """Age (s) of what was measured at `stamp` (ns). The filter runs from the first reading on that is not too old.

    What cylinders may be off by will then show.
    """
    age = (f.status[STAMP] - stamp) * NANO
    if f.status[FED] == 0 and age <= OLDEST:
        f.status[FED] = 1
        for i in range(f.softness.shape[0]):
            if f.softness[i] > 0.0:
                add_unknown(f, 2 + i, SOFT)
    return age


@inner
def take_angles(f, residuals, first, stamp):
    """Use what angle sensors read at `stamp` (ns) less what they should have read (rad, NaN = not measured)."""
    age = age_of(f, stamp)
    if age > OLDEST:
        return
    begin_sample(f)
    count = 0
    for i in range(f.softness.shape[0]):
        if usable(f, first + i, residuals[i]):
            variance = f.noise[first + i] + read_angle(f, i, f.row)
            innovation, by_x, by_y = correct(f, residuals[i], variance, age), 0.0, 0.0
            for j in range(f.status[COUNT]):
                still = f.turns[j, i] / (f.omega[j] * f.omega[j] * math.sqrt(variance))
                by_x, by_y = by_x + still * f.tip[j, 0], by_y + still * f.tip[j, 1]
            add_innovation(f, by_x, by_y, innovation)
            count += 1
    if count > 0 and stamp > f.status[ANGLES_STAMP]:
        follow_levels(f, BY_ANGLES, min((stamp - f.status[ANGLES_STAMP]) * NANO, LONGEST_STEP))
        f.status[ANGLES_STAMP] = stamp


@inner
def take_imu(f, residuals, first, stamp):
    """Likewise of the tip IMU's x and z, m/s^2."""
    age = age_of(f, stamp)
    if age > OLDEST:
        return
    begin_sample(f)
    c, s, count = math.cos(f.now[ANGLE]), math.sin(f.now[ANGLE]), 0
    for axis in range(2):
        if usable(f, first + axis, residuals[axis]):
            x, y = (c, s) if axis == 0 else (-s, c)
            across, along = x * f.now[FELT_Y] - y * f.now[FELT_X], x * f.now[FELT_X] + y * f.now[FELT_Y]
            read_acceleration(f, x, y, 0.0, across, f.row)
            f.row[BIAS + axis], f.row[TURNED], f.row[SCALE] = 1.0, across, along
            deviation = math.sqrt(f.noise[first + axis])
            by_x, by_y = f.row[LOAD] / deviation, f.row[LOAD + 1] / deviation
            add_innovation(f, by_x, by_y, correct(f, residuals[axis], f.noise[first + axis], age))
            count += 1
    if count > 0 and stamp > f.status[IMU_STAMP]:
        follow_levels(f, BY_IMU, min((stamp - f.status[IMU_STAMP]) * NANO, LONGEST_STEP))
        f.status[IMU_STAMP] = stamp


@inner
def take_forces(f, residuals, first, stamp):
    """Likewise of the cylinder forces, N."""
    age = age_of(f, stamp)
    if age > OLDEST:
        return
    if f.status[FORCED] == 0:
        f.status[FORCED] = 1
        add_offsets(f)
    for i in range(f.softness.shape[0]):
        if usable(f, first + i, residuals[i]):
            variance = f.noise[first + i] + read_force(f, i, f.row)
            correct(f, residuals[i], variance, age)


@inner
def usable(f, channel, residual):
    """Whether a reading may be used."""
    return math.isfinite(residual) and not f.masked[channel]


@inner
def turn_back(f, age):
    """Make `f.row` read what it read `age` s ago, of the state now; gives the variance of what the load did since.

    Modes are turned back about where their inputs, taken to be what they are now, hold them at rest. The load's Gauss-Markov
    process changes within t by the variance 2 level^2 (1 - a), a its correlation over t.
    """
    n, row, by_x, by_y = f.softness.shape[0], f.row, 0.0, 0.0
    for j in range(f.status[COUNT]):
        at, c = mode_place(f, j), f.coupling[j]
        a11, a12, a21, a22 = oscillate(f.omega[j], f.decay[j], -age)
        still = row[at]
        row[at], row[at + 1] = row[at] * a11 + row[at + 1] * a21, row[at] * a12 + row[at + 1] * a22
        still = (still - row[at]) / (f.omega[j] * f.omega[j])
        for b in range(c.shape[0]):
            if not is_sag(b, n):
                row[input_place(f, b)] += still * c[b]
        by_x, by_y = by_x + still * c[0] * f.level[0], by_y + still * c[1] * f.level[1]
    kept, _, _, _ = load_after(age)
    return 2.0 * (1.0 - kept) * (by_x * by_x + by_y * by_y)


@inner
def correct(f, residual, variance, age):
    """Correct the state by one reading that is read by `f.row`; gives its innovation, in deviations."""
    size = states_of(f)
    x, p, row, gain = f.x, f.p, f.row, f.gain
    if age > 0.0:
        variance += turn_back(f, age)
    covary(p, row, gain, size)
    spread, off = variance, residual
    for k in range(size):
        spread += row[k] * gain[k]
        off -= row[k] * x[k]
    innovation = off / math.sqrt(spread)
    if abs(innovation) > UNLIKELY:
        spread *= (innovation / UNLIKELY) ** 2
    deviation = math.sqrt(spread)
    for k in range(size):
        gain[k] /= deviation
    add_row(x, off / deviation, gain, size)
    for k in range(size):
        add_row(p[k], -gain[k], gain, size)
    return innovation
