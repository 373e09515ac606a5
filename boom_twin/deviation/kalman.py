"""Kalman filter: transition of the states over a step, and correction by one reading."""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from .channels import IMU_DRIFT, IMU_SCALE, IMU_TURN, TIP_IMU_STATES
from .rows import clear, read, spread_of
from .states import PREDICTION, drive_place, force_place, whole, zero_place

FAST, SLOW = 0.1, 60.0  # s, time constants of the two parts of the load
DRIVE_TIME = 0.12  # s, correlation time of a drive's acceleration
LEAK = 1e-14  # m^2/s, random walk of a drive
ANGLE_ZERO, ANGLE_DRIFT = 2e-4, 1e-5  # rad; rad in a root second: sensors' zeros, and the error of the model's statics
GAINS = 4  # that correct a covariance at once, so that it is read and written once for all
FORCE_ZERO, FORCE_REST, FORCE_TURN = 1.0, 0.003, 0.02  # share of the force; in a root second; in a root radian of all joints


@inner
def put_weight(f, row, place, weight):
    """Add an entry to a row of the transition matrix."""
    f.places[row, f.counts[row]], f.weights[row, f.counts[row]] = place, weight
    f.counts[row] += 1


@inner
def make_transition(p, f, h):
    """Write the transition of the boom's states over `h` (s), inputs of the modes held, and the variances all states gain.

    `f.inputs` (2 m) are the changes of modal coordinates and rates by the modal forces `f.swing`.
    """
    n, m, load, drive = p.drives.shape[0], p.modes[0], force_place(p), drive_place(p)
    f.interval[1] = h
    f.counts[:], f.variances[:] = 0, 0.0
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
        f.inputs[j], f.inputs[m + j] = still * f.swing[j], moving * f.swing[j]
        for a in range(2):
            motion = p.readings[2 + n + j, n + a]
            for b in range(2):
                put_weight(f, j, load + 2 * b + a, still * motion)
                put_weight(f, m + j, load + 2 * b + a, moving * motion)
            put_weight(f, j, load + 4 + a, 0.5 * h * still * motion)
            put_weight(f, m + j, load + 4 + a, 0.5 * h * moving * motion)
        for i in range(n):
            push = -p.forces[2 + n + j, i] / omega2
            put_weight(f, j, drive + 2 * n + i, still * push)
            put_weight(f, m + j, drive + 2 * n + i, moving * push)
    for a in range(2):
        put_weight(f, load + a, load + a, (1.0 + h / FAST) * math.exp(-h / FAST))
        put_weight(f, load + a, load + 4 + a, h * math.exp(-h / FAST))
        put_weight(f, load + 4 + a, load + a, -h / (FAST * FAST) * math.exp(-h / FAST))
        put_weight(f, load + 4 + a, load + 4 + a, (1.0 - h / FAST) * math.exp(-h / FAST))
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
    for i in range(own):
        total = 0.0
        for c in range(f.counts[i]):
            total += f.weights[i, c] * x[f.places[i, c]]
        f.row[i] = total
    for i in range(own):
        x[i] = f.row[i]
    for i in range(2 * p.modes[0]):
        x[i] += f.inputs[i]
    for i in range(own):
        multiply_row(f, i, covariance, whole(size), f.half[i])
    for i in range(own):
        for j in range(own):
            f.turned[i, j] = f.half[j, i]
        for j in range(own, size):
            covariance[i, j] = covariance[j, i] = f.half[i, j]
    for i in range(own):
        multiply_row(f, i, f.turned, whole(i + 1), f.row)
        for j in range(i + 1):
            covariance[i, j] = covariance[j, i] = f.row[j]
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


@inner
def multiply_row(f, i, right, size, found):
    """Write row `i` of the product of the transition matrix and `right`, its first `size` entries, four terms at a time."""
    for j in range(size):
        found[j] = 0.0
    count = f.counts[i]
    for c in range(0, count - 3, 4):
        one, two, three, four = f.weights[i, c], f.weights[i, c + 1], f.weights[i, c + 2], f.weights[i, c + 3]
        first, second = right[f.places[i, c]], right[f.places[i, c + 1]]
        third, fourth = right[f.places[i, c + 2]], right[f.places[i, c + 3]]
        for j in range(size):
            found[j] += one * first[j] + two * second[j] + three * third[j] + four * fourth[j]
    for c in range(count - count % 4, count):
        weight, line = f.weights[i, c], right[f.places[i, c]]
        for j in range(size):
            found[j] += weight * line[j]


@inner
def free_sensors(p, f, covariance):
    """Write the variances of unknown states of sensors: mount and scale of the IMU, zeros of forces, errors of the others."""
    n, zero, largest = p.drives.shape[0], zero_place(p), 0.0
    covariance[zero + 2, zero + 2], covariance[zero + 3, zero + 3] = IMU_TURN * IMU_TURN, IMU_SCALE * IMU_SCALE
    for i in range(n):
        largest = max(largest, abs(f.pulls[i]))
    for i in range(n):
        at = zero + 4 + n + i
        covariance[at, at] = (FORCE_ZERO * (abs(f.pulls[i]) + 0.1 * largest)) ** 2
    further = TIP_IMU_STATES + 2 * n
    for k in range(further, p.behind[0]):
        covariance[zero + k, zero + k] = p.errors[k - further].first ** 2


@inner
def correct(x, covariance, row, gains, innovation, variance, size):
    """Correct a state and its covariance by a reading; return the variance of the innovation."""
    expected = variance + gain_after(covariance, row, gains, 0, size)
    take_innovation(x, covariance, gains, 0, innovation, expected, size)
    take_gains(covariance, gains, 1, size)
    return expected


@inner
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


@inner
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
