"""Time step of the filter behind the estimate of the tip: how load, shares and modes go on to the newest strokes.

What the states are, and the equations: `boom_twin.estimation.tip_estimate`.
"""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from ..kernels.tables import FRAME_COS, FRAME_SIN, FRAME_X, FRAME_Y
from ..types import NANO
from .deviation_filter import (
    ANGLE,
    BIAS,
    COUNT,
    ERROR,
    FED,
    FELT_X,
    FELT_Y,
    FIRST_LOAD,
    FORCE_DRIFT,
    FORCE_OFF,
    FORCED,
    LEAST_FORCE,
    LOAD,
    LOAD_CHANGE,
    SCALE,
    SCENE_ERROR,
    SHAKEN,
    SHARES,
    SOFTENING,
    STAMP,
    STARTED,
    STAY_TIME,
    STAYING,
    STAYS,
    STEP,
    TURNED,
    USUAL_LOAD,
    add_row,
    clear,
    copy_columns,
    input_place,
    is_sag,
    mix_rows,
    mode_place,
    offset_place,
    oscillate,
    states_of,
)

SLOWEST, QUICKEST = 2.0, 15.0  # 1/s, rates of the load
JERK_TIME = 0.02  # s
SLOW = 0.5  # s, over which the forces and moments are taken that a and b are learnt from
BIAS_OFF, BIAS_DRIFT = 0.1, 0.001  # m/s^2, standard deviation of the IMU's bias, and of its change in a second
TURNED_OFF, SCALE_OFF = 0.035, 0.02  # rad and share, standard deviations of the IMU's mounting angle and scale
LEAST_ERROR = 0.02  # m/s^2, of the standard deviation of e
INEXACT_MOTION = 0.01  # share of the predicted acceleration, over `SLOW` seconds, that it is off by in haste

SHORTEST_STEP, LONGEST_STEP = 1e-4, 0.05  # s, between strokes; the longest of the covariance's differential equation too


@kernel
def advance_estimate(f, live, results, estimates, moments, gravity, stamp):
    """Go on to the newest strokes, of this stamp (ns), and follow the prediction there.

    Parameters
    ----------
    f : DeviationFilter
    live : State
        The boom as predicted.
    results, estimates : Results, Estimates
        See `boom_twin.kernels.result_row`.
    moments : ndarray, shape (stations,)
        Predicted, N m.
    gravity : ndarray, shape (2,)
        m/s^2.
    """
    h = (stamp - f.status[STAMP]) * NANO
    f.status[STAMP], f.now[STEP] = stamp, h
    follow_posture(f, live)
    follow_prediction(f, results, estimates, moments, gravity)
    if f.status[STARTED] == 0:
        start_state(f)
    if f.status[FED] == 0 or h <= 0.0:
        return
    steps = max(1, math.ceil(h / LONGEST_STEP - 1e-6))
    for _ in range(steps):
        step_state(f, h / steps)
    if not is_finite(f):
        start_state(f)
        f.status[FED] = 0


@inner
def is_finite(f):
    """Whether state and variances are numbers: readings near the largest that are taken may have driven them beyond."""
    total = 0.0
    for k in range(states_of(f)):
        total += abs(f.x[k]) + f.p[k, k]
    return math.isfinite(total)


@inner
def start_state(f):
    """What is not known at the start: load and shares, with the deflection that they have caused, and vibration beside."""
    n = f.softness.shape[0]
    for k in range(f.x.shape[0]):
        f.x[k] = 0.0
        for b in range(f.x.shape[0]):
            f.p[k, b] = 0.0
    for b in range(2):
        f.level[b] = f.loads[FIRST_LOAD]
        add_unknown(f, b, f.level[b])
        add_unknown(f, 2 + 2 * n + b, STAYS * f.loads[USUAL_LOAD])
        f.p[LOAD_CHANGE + b, LOAD_CHANGE + b] = SLOWEST * QUICKEST * f.level[b] * f.level[b]
        f.p[ERROR + b, ERROR + b] = f.pushes[b]
        f.p[BIAS + b, BIAS + b] = BIAS_OFF * BIAS_OFF
    for i in range(n):
        if f.softness[i] > 0.0:
            add_unknown(f, 2 + i, SCENE_ERROR)
        f.p[SHARES + n + i, SHARES + n + i] = f.sections_off[i] * f.sections_off[i]
    for j in range(f.status[COUNT]):
        at = mode_place(f, j)
        swing = math.hypot(f.tip[j, 0], f.tip[j, 1]) * f.loads[USUAL_LOAD] / (f.omega[j] * f.omega[j])
        f.p[at, at] += swing * swing
        f.p[at + 1, at + 1] += (swing * f.omega[j]) ** 2
    f.p[TURNED, TURNED], f.p[SCALE, SCALE] = TURNED_OFF**2, SCALE_OFF**2
    if f.status[FORCED]:
        add_offsets(f)
    f.status[STARTED] = 1


@inner
def add_offsets(f):
    """What is not known of the forces' offsets at the start."""
    widen_offsets(f, FORCE_OFF * FORCE_OFF)


@inner
def widen_offsets(f, share2):
    """Add to the variances of the forces' offsets this share of the squares of the forces, and of a part of the largest."""
    largest = 0.0
    for i in range(f.pulls.shape[0]):
        largest = max(largest, abs(f.pulls[i]))
    for i in range(f.pulls.shape[0]):
        at = offset_place(f, i)
        f.p[at, at] += share2 * (abs(f.pulls[i]) + LEAST_FORCE * largest) ** 2


@inner
def add_unknown(f, b, deviation):
    """Add to what is not known an input of the modes, of this standard deviation, and what it has done at rest."""
    size = states_of(f)
    clear(f.row, size)
    f.row[input_place(f, b)] = deviation
    for j in range(f.status[COUNT]):
        at = mode_place(f, j)
        f.row[at] = deviation * f.coupling[j, b] / (f.omega[j] * f.omega[j])
    for k in range(size):
        for i in range(size):
            f.p[k, i] += f.row[k] * f.row[i]


@inner
def follow_posture(f, live):
    """Motion of the tip and turns of the angle sensors by the modes, and of the tip by strokes, as the boom now stands."""
    n, last = f.softness.shape[0], live.frames.shape[0] - 1
    tip_x, tip_y = live.frames[last, FRAME_X], live.frames[last, FRAME_Y]
    for j in range(f.status[COUNT]):
        x, y, turn = 0.0, 0.0, 0.0
        for k in range(1, last + 1):
            before = live.frames[k - 1]
            c, s = before[FRAME_COS], before[FRAME_SIN]
            own = f.relative[k, j]
            x += c * own[0] - s * own[1] - own[2] * (tip_y - live.frames[k, FRAME_Y])
            y += s * own[0] + c * own[1] + own[2] * (tip_x - live.frames[k, FRAME_X])
            turn += own[2]
            for i in range(n):
                if f.absolute[i] and f.sensed[i] == k:
                    f.turns[j, i] = turn
        f.tip[j, 0], f.tip[j, 1], f.tip[j, 2] = x, y, turn
    for i in range(n):
        pivot = live.frames[f.roots[i]]
        f.lever[i, 0] = -(tip_y - pivot[FRAME_Y]) / f.slopes[i]
        f.lever[i, 1] = (tip_x - pivot[FRAME_X]) / f.slopes[i]
        f.lever[i, 2] = 1.0 / f.slopes[i]


@inner
def follow_prediction(f, results, estimates, moments, gravity):
    """How load and shares drive the modes at the predicted forces and moments."""
    n = f.softness.shape[0]
    kept = math.exp(-min(max(f.now[STEP], 0.0) / SLOW, 50.0)) if f.status[STARTED] else 0.0
    for i in range(n):
        newest = results.cylinder_forces[i] * f.softness[i]
        f.drawn[i] = kept * f.drawn[i] + (1.0 - kept) * newest
        f.ahead[i] = min(max(newest / f.drawn[i] - 1.0, -1.0), 1.0) if f.drawn[i] != 0.0 else 0.0
        f.pulls[i] = kept * f.pulls[i] + (1.0 - kept) * results.cylinder_forces[i]
        f.variances[i] = f.noisier[0] * estimates.variances[i]
    for a in range(2):
        newest = results.tip[2, a] * results.tip[2, a]
        f.now[SHAKEN + a] = kept * f.now[SHAKEN + a] + (1.0 - kept) * newest
    follow_errors(f)
    for j in range(f.status[COUNT]):
        c = f.coupling[j]
        c[0], c[1] = f.tip[j, 0], f.tip[j, 1]
        c[2 + 2 * n], c[3 + 2 * n] = c[0], c[1]
        for i in range(n):
            c[2 + i], c[2 + n + i] = f.forces[j, i] * f.drawn[i], kept * c[2 + n + i]
        for k in range(moments.shape[0]):
            c[2 + n + f.sections[k]] += (1.0 - kept) * f.bending[j, k] * moments[k]
    f.now[ANGLE] = results.tip[0, 2]
    f.now[FELT_X], f.now[FELT_Y] = results.tip[2, 0] - gravity[0], results.tip[2, 1] - gravity[1]


@inner
def follow_errors(f):
    """Variances of the acceleration that errors of the strokes push the tip with, and by which fast motions are not exact.

    A mode has followed most of an error that is slow to it: of one that changes at the rate r the share r^2 / (r^2 + omega_j^2)
    is left, which is the mode's transfer function from stroke to acceleration at the growth r. The newest estimate of a
    stroke is that of a Kalman filter of white jerk, the error of which has the variance 2 r_s T c, with r_s the variance of a
    reading, T the time between readings and c the filter's corner; half the power of it is above 1.5 c, and on the mean
    over it a mode is left what it is at r = 2 c: 1.8 c if omega_j is 1.4 c, 2.5 c if it is 2.9 c.
    """
    for a in range(2):
        f.pushes[a] = LEAST_ERROR * LEAST_ERROR + INEXACT_MOTION * INEXACT_MOTION * f.now[SHAKEN + a]
    power = f.noisier[0] * f.reading[0] * min(max(f.now[STEP], SHORTEST_STEP), LONGEST_STEP)
    for i in range(f.softness.shape[0]):
        rate, x, y = f.variances[i] / power, 0.0, 0.0
        for j in range(f.status[COUNT]):
            left = f.forces[j, i] * rate * rate / (rate * rate + f.omega[j] * f.omega[j])
            x += left * f.tip[j, 0]
            y += left * f.tip[j, 1]
        f.pushes[0] += x * x * f.variances[i]
        f.pushes[1] += y * y * f.variances[i]


@inner
def step_state(f, h):
    """Mean and covariance h (s) later: half a step of the inputs, one of the modes under these, the other half (Strang)."""
    size, n, inputs = states_of(f), f.softness.shape[0], f.coupling.shape[1]
    x, p, row = f.x, f.p, f.row
    step_inputs(f, 0.5 * h, size)
    for j in range(f.status[COUNT]):
        c, at = f.coupling[j], mode_place(f, j)
        a11, a12, a21, a22 = oscillate(f.omega[j], f.decay[j], h)
        g1, g2 = (1.0 - a11) / (f.omega[j] * f.omega[j]), -a21 / (f.omega[j] * f.omega[j])
        force = 0.0
        clear(row, size)
        for b in range(inputs):
            if not is_sag(b, n):
                place = input_place(f, b)
                force += c[b] * x[place]
                add_row(row, c[b], p[place], size)
        x[at], x[at + 1] = a11 * x[at] + a12 * x[at + 1] + g1 * force, a21 * x[at] + a22 * x[at + 1] + g2 * force
        mix_rows(p[at], p[at + 1], a11, a12, a21, a22, f.gain, size)
        add_row(p[at], g1, row, size)
        add_row(p[at + 1], g2, row, size)
        by_q, by_rate = 0.0, 0.0
        for b in range(inputs):
            if not is_sag(b, n):
                place = input_place(f, b)
                by_q += c[b] * p[at, place]
                by_rate += c[b] * p[at + 1, place]
        _, b12, _, b22 = oscillate(f.omega[j], f.decay[j], 0.5 * h)
        share = f.density[j] * h / 6.0  # of the noise's integral, by Simpson's rule
        q2 = a11 * p[at, at] + a12 * p[at, at + 1] + g1 * by_q + share * (4.0 * b12 * b12 + a12 * a12)
        both = a21 * p[at, at] + a22 * p[at, at + 1] + g2 * by_q + share * (4.0 * b12 * b22 + a12 * a22)
        rate2 = a21 * p[at + 1, at] + a22 * p[at + 1, at + 1] + g2 * by_rate + share * (1.0 + 4.0 * b22 * b22 + a22 * a22)
        copy_columns(p, at, size)
        copy_columns(p, at + 1, size)
        p[at, at], p[at, at + 1], p[at + 1, at], p[at + 1, at + 1] = q2, both, both, rate2
    step_inputs(f, 0.5 * h, size)
    kept = math.exp(-h / JERK_TIME)
    for b in range(2):
        fade(f, ERROR + b, kept, f.pushes[b], size)
        f.p[BIAS + b, BIAS + b] += BIAS_DRIFT * BIAS_DRIFT * h
    if f.status[FORCED]:
        widen_offsets(f, FORCE_DRIFT * FORCE_DRIFT * h)


@inner
def step_inputs(f, h, size):
    """Load and shares h (s) later."""
    kept = math.exp(-h / STAY_TIME)
    for b in range(2):
        step_load(f, b, h, size)
        fade(f, STAYING + b, kept, (STAYS * f.loads[USUAL_LOAD]) ** 2, size)
    for i in range(f.softness.shape[0]):
        if f.drawn[i] != 0.0:
            lag = f.x[SHARES + i] * f.ahead[i]
            f.p[SHARES + i, SHARES + i] += (SOFTENING * SOFTENING + lag * lag / SLOW) * h


@inner
def load_after(h):
    """What a component of the load and its rate become within h (s): a 2 by 2 matrix by rows, exact."""
    slow, quick = math.exp(-SLOWEST * h), math.exp(-QUICKEST * h)
    by_rate = (slow - quick) / (QUICKEST - SLOWEST)
    return slow + SLOWEST * by_rate, by_rate, -SLOWEST * QUICKEST * by_rate, quick - SLOWEST * by_rate


@inner
def step_load(f, b, h, size):
    """Component b of the load and its rate h (s) later: exact."""
    x, p, place, change, level2 = f.x, f.p, LOAD + b, LOAD_CHANGE + b, f.level[b] * f.level[b]
    a11, a12, a21, a22 = load_after(h)
    x[place], x[change] = a11 * x[place] + a12 * x[change], a21 * x[place] + a22 * x[change]
    mix_rows(p[place], p[change], a11, a12, a21, a22, f.gain, size)
    rate2 = SLOWEST * QUICKEST * level2  # at rest in itself, load and rate have these variances and no covariance
    load = a11 * p[place, place] + a12 * p[place, change] + level2 - a11 * a11 * level2 - a12 * a12 * rate2
    both = a21 * p[place, place] + a22 * p[place, change] - a11 * a21 * level2 - a12 * a22 * rate2
    rate = a21 * p[change, place] + a22 * p[change, change] + rate2 - a21 * a21 * level2 - a22 * a22 * rate2
    copy_columns(p, place, size)
    copy_columns(p, change, size)
    p[place, place], p[place, change], p[change, place], p[change, change] = load, both, both, rate


@inner
def fade(f, place, kept, variance, size):
    """A step of the Gauss-Markov process at `place`, of this variance."""
    f.x[place] *= kept
    row = f.p[place]
    for k in range(size):
        row[k] *= kept
    row[place] = kept * row[place] + variance * (1.0 - kept * kept)
    copy_columns(f.p, place, size)
