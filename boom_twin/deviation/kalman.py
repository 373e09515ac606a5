"""Kalman filter: transition of the states over a step, and correction by one reading."""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from .channels import IMU_DRIFT, IMU_SCALE, IMU_TURN, IMU_ZERO, TIP_IMU_STATES
from .rows import clear, read, spread_of
from .states import PREDICTION, drive_place, force_place, whole, zero_place

FAST, SLOW = 0.1, 60.0  # s, time constants of the two parts of the load
QQ, QV, QF, VQ, VV, VF = range(6)  # shares in coordinate and rate of a mode after a step: of both before, and of a force
DRIVE_TIME = 0.12  # s, correlation time of a drive's acceleration
MOVE_TIME = 3.0  # s, correlation time of the rate of a drive whose transducer is left out: how long a move lasts
LEAK = 1e-14  # m^2/s, random walk of a drive
ANGLE_ZERO, ANGLE_DRIFT = 2e-4, 1e-5  # rad; rad in a root second: sensors' zeros, and the error of the model's statics
GAINS = 4  # that correct a covariance at once, so that it is read and written once for all
FORCE_ZERO, FORCE_REST, FORCE_TURN = 1.0, 0.003, 0.02  # share of the force; in a root second; in a root radian of all joints


@inner
def make_transition(p, f, h):
    """Write the transition of the boom's states over `h` (s), inputs of the modes held, and the variances all states gain.

    `f.inputs` (2 m) are the changes of modal coordinates and rates by the modal forces `f.swing`.
    """
    n, m, zero, drive = p.drives.shape[0], p.modes[0], zero_place(p), drive_place(p)
    f.interval[1], f.variances[:], f.turned[:] = h, 0.0, 0.0
    for j in range(m):
        modal, omega2, half = f.modal[j], p.omega[j] * p.omega[j], 0.5 * p.decay[j]
        swing = math.sqrt(max(omega2 - half * half, 1e-12))
        left, c, s = math.exp(-half * h), math.cos(swing * h), math.sin(swing * h)
        modal[QQ], modal[QV] = left * (c + half / swing * s), left * s / swing
        modal[VQ], modal[VV] = -left * omega2 / swing * s, left * (c - half / swing * s)
        modal[QF], modal[VF] = (1.0 - modal[QQ]) / omega2, -modal[VQ] / omega2
        f.inputs[j], f.inputs[m + j] = modal[QF] * f.swing[j], modal[VF] * f.swing[j]
    for i in range(zero):
        f.turned[i, i] = 1.0
    propagate(p, f, h, f.turned, whole(zero))
    for i in range(zero):
        for j in range(zero):
            f.transition[j, i] = f.turned[i, j]
    for i in range(n):
        f.variances[drive + i], f.variances[drive + 2 * n + i] = LEAK * h, f.jerk[i] * h
    for a in range(2):
        f.variances[zero + a] = f.drift[a] * IMU_DRIFT * IMU_DRIFT * h
    turned = 0.0
    for i in range(n):
        turned += abs(p.slope[i] * f.mean[PREDICTION, drive + n + i]) * h
    share2 = FORCE_REST * FORCE_REST * h + FORCE_TURN * FORCE_TURN * turned
    for i in range(n):
        f.variances[zero + 4 + i] = f.drift[4 + i] * ANGLE_DRIFT * ANGLE_DRIFT * h
        f.variances[zero + 4 + n + i] = f.drift[4 + n + i] * share2 * f.pulls[i] * f.pulls[i]
    further = TIP_IMU_STATES + 2 * n
    for k in range(further, p.behind[0]):
        walk = p.errors[k - further].walk
        f.variances[zero + k] = f.drift[k] * walk * walk * h


@inner
def transit(p, f, k, size, h, loads, least2):
    """Propagate the first `size` states of model `k` over the transition.

    Sensors' errors and copies of readings stay as they are, but for lags, which drift. So the covariance is propagated as

        [ F A F^T   F B ]
        [ B^T F^T   C   ],

    with A of the boom's states, C of the others, and B between these.

    The variances of the fast load are `loads` (2,) along x and y, or `least2` where they are less; N^2.
    """
    x, covariance, load, own = f.x[k], f.p[k], force_place(p), zero_place(p)
    spread_of(x, f.transition, f.row, own)
    for i in range(own):
        x[i] = f.row[i]
    for i in range(2 * p.modes[0]):
        x[i] += f.inputs[i]
    propagate(p, f, h, covariance, whole(size))
    for i in range(own):
        for j in range(own):
            f.turned[i, j] = covariance[j, i]
        for j in range(own, size):
            covariance[j, i] = covariance[i, j]
    propagate(p, f, h, f.turned, whole(own))
    for i in range(own):
        for j in range(i + 1):
            covariance[i, j] = covariance[j, i] = f.turned[i, j]
    if size > own:
        drift_lags(p, x, covariance, size, h)
    for i in range(size):
        covariance[i, i] += f.variances[i]
    u, left = h / FAST, math.exp(-2.0 * h / FAST)
    force, both = 1.0 - left * ((1.0 + u) * (1.0 + u) + u * u), 2.0 / FAST * left * u * u
    rate = (1.0 - left * ((1.0 - u) * (1.0 - u) + u * u)) / (FAST * FAST)
    for a in range(2):
        fast2, at = max(loads[a], least2), load + a
        slow2 = f.noise.least_load * f.noise.least_load + fast2
        covariance[at, at] += force * fast2
        covariance[at + 4, at + 4] += rate * fast2
        covariance[at, at + 4] += both * fast2
        covariance[at + 4, at] += both * fast2
        covariance[at + 2, at + 2] += slow2 * (1.0 - math.exp(-2.0 * h / SLOW))


@inner
def drift_lags(p, x, covariance, size, h):
    """Add to the lags of streams what they drift by in `h` (s)."""
    further = TIP_IMU_STATES + 2 * p.drives.shape[0]
    for k in range(further, p.behind[0]):
        if p.errors[k - further].drifts:
            lag = zero_place(p) + k
            x[lag] += h * x[lag + 1]
            for j in range(size):
                covariance[lag, j] += h * covariance[lag + 1, j]
            for j in range(size):
                covariance[j, lag] += h * covariance[j, lag + 1]


@kernel
def propagate(p, f, h, lines, width):
    """Replace the boom's rows of a matrix by their product with the transition matrix over `h` (s), `width` columns of it."""
    n, m, load, drive = p.drives.shape[0], p.modes[0], force_place(p), drive_place(p)
    along, up, force = f.rows[0], f.rows[1], f.rows[2]
    for a in range(2):
        mean, fast, slow, rate = f.rows[a], lines[load + a], lines[load + 2 + a], lines[load + 4 + a]
        for k in range(width):
            mean[k] = fast[k] + slow[k] + 0.5 * h * rate[k]
    for j in range(m):
        modal, omega2 = f.modal[j], p.omega[j] * p.omega[j]
        x, y = p.readings[2 + n + j, n], p.readings[2 + n + j, n + 1]
        for k in range(width):
            force[k] = x * along[k] + y * up[k]
        for i in range(n):
            share, acceleration = p.forces[2 + n + j, i] / omega2, lines[drive + 2 * n + i]
            for k in range(width):
                force[k] -= share * acceleration[k]
        qq, qv, vq, vv, qf, vf = modal[QQ], modal[QV], modal[VQ], modal[VV], modal[QF], modal[VF]
        q, v = lines[j], lines[m + j]
        for k in range(width):
            before = q[k]
            q[k] = qq * before + qv * v[k] + qf * force[k]
            v[k] = vq * before + vv * v[k] + vf * force[k]
    u, left, kept = h / FAST, math.exp(-h / FAST), math.exp(-h / SLOW)
    ff, fr, rf, rr = (1.0 + u) * left, h * left, -u / FAST * left, (1.0 - u) * left
    for a in range(2):
        fast, slow, rate = lines[load + a], lines[load + 2 + a], lines[load + 4 + a]
        for k in range(width):
            before = fast[k]
            fast[k] = ff * before + fr * rate[k]
            rate[k] = rf * before + rr * rate[k]
            slow[k] *= kept
    kept = math.exp(-h / DRIVE_TIME)
    for i in range(n):
        drives, rate, acceleration = lines[drive + i], lines[drive + n + i], lines[drive + 2 * n + i]
        lasting = math.exp(-h / MOVE_TIME) if f.deaf[i] else 1.0
        for k in range(width):
            drives[k] += h * rate[k] + 0.5 * h * h * acceleration[k]
            rate[k] = lasting * rate[k] + h * acceleration[k]
            acceleration[k] *= kept


@inner
def first_variances(p, f, variances):
    """Write the variances of sensors' errors of which nothing is known yet, at the places of these states."""
    n, zero, largest = p.drives.shape[0], zero_place(p), 0.0
    variances[zero] = variances[zero + 1] = IMU_ZERO * IMU_ZERO
    variances[zero + 2], variances[zero + 3] = IMU_TURN * IMU_TURN, IMU_SCALE * IMU_SCALE
    for i in range(n):
        largest = max(largest, abs(f.pulls[i]))
    for i in range(n):
        variances[zero + 4 + i] = ANGLE_ZERO * ANGLE_ZERO
        variances[zero + 4 + n + i] = (FORCE_ZERO * (abs(f.pulls[i]) + 0.1 * largest)) ** 2
    further = TIP_IMU_STATES + 2 * n
    for k in range(further, p.behind[0]):
        variances[zero + k] = p.errors[k - further].first ** 2


@inner
def correct(x, covariance, row, gains, innovation, variance, size):
    """Correct a state and its covariance by a reading; return the variance of the innovation."""
    expected = variance + gain_after(covariance, row, gains, 0, size)
    take_innovation(x, covariance, gains, 0, innovation, expected, size)
    take_gains(covariance, gains, 1, size)
    return expected


@kernel
def gain_after(covariance, row, gains, count, size):
    """Write gain `count`, the covariance of all states with the reading of `row`; return the variance of that reading.

    The gains before are of readings that have corrected the state, but not yet the covariance.
    """
    gain = gains[count]
    spread_of(row, covariance, gain, size)
    for c in range(count):
        subtract(gain, read(row, gains[c], size), gains[c], size)
    return read(row, gain, size)


@inner
def subtract(gain, share, other, size):
    """Subtract a share of another gain."""
    for i in range(whole(size)):
        gain[i] -= share * other[i]


@kernel
def take_innovation(x, covariance, gains, count, innovation, expected, size):
    """Correct a state by an innovation of variance `expected`, and divide its gain by the root; return how many gains are left.

    Four gains correct the covariance.
    """
    gain, scale = gains[count], 1.0 / math.sqrt(expected)
    for i in range(whole(size)):
        gain[i] *= scale
    for i in range(size):
        x[i] += gain[i] * (innovation * scale)
    if count + 1 < GAINS:
        return count + 1
    take_gains(covariance, gains, GAINS, size)
    return 0


@inner
def log_innovation(f, channel, innovation, variance):
    """Log an innovation of a channel and its variance, unless `LOGGED` wait."""
    count = f.logged[channel]
    if count < f.log.shape[1]:
        f.log[channel, count, 0], f.log[channel, count, 1], f.logged[channel] = innovation, variance, count + 1


@kernel
def take_gains(covariance, gains, count, size):
    """Subtract g g^T of `count` gains g (4, s) from a covariance (s, s), two rows at a time."""
    width = whole(size)
    if count == 0:
        return
    for c in range(count, GAINS):
        clear(gains[c], width)
    first, second, third, fourth = gains[0], gains[1], gains[2], gains[3]
    for i in range(0, size, 2):
        line, below = covariance[i], covariance[i + 1]
        a, b, c, d = first[i], second[i], third[i], fourth[i]
        e, g, h, j = first[i + 1], second[i + 1], third[i + 1], fourth[i + 1]
        for k in range(width):
            line[k] -= a * first[k] + b * second[k] + c * third[k] + d * fourth[k]
            below[k] -= e * first[k] + g * second[k] + h * third[k] + j * fourth[k]
