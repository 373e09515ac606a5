"""Rows of the measurement matrix: sensors, lengths and the tip as functions of the states of `boom_twin.deviation.states`."""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from .states import all_states, drive_place, force_place, whole, zero_place

SWAY_SHARE = 0.3  # share of the error of an inclinometer by its acceleration that is not known
SHAKEN_TIME = 0.5  # s, over which the mean square of a place's acceleration is taken


@inner
def clear(row, size):
    """Set the first `size` entries to zero."""
    for k in range(size):
        row[k] = 0.0


@kernel
def read(row, x, size):
    """Return the reading of a row; four sums, because each waits for its last addition."""
    one = two = three = four = 0.0
    for k in range(0, size - 3, 4):
        one += row[k] * x[k]
        two += row[k + 1] * x[k + 1]
        three += row[k + 2] * x[k + 2]
        four += row[k + 3] * x[k + 3]
    for k in range(size - size % 4, size):
        one += row[k] * x[k]
    return (one + two) + (three + four)


@inner
def difference(row, x, other, size):
    """Return the reading of a row at state `x` less that at another one."""
    total = 0.0
    for k in range(size):
        total += row[k] * (x[k] - other[k])
    return total


@inner
def about_rest(p, row, x, size):
    """Return the reading of a row less that at rest."""
    total, drive = read(row, x, size), drive_place(p)
    for i in range(p.drives.shape[0]):
        total -= row[drive + i] * p.drives[i]
    return total


@inner
def reach2(p, k):
    """Return the square of the tip's motion by column `k` of the posture's readings: 2 + i of drive i, modes behind."""
    n = p.drives.shape[0]
    return p.readings[k, n] ** 2 + p.readings[k, n + 1] ** 2


@inner
def variance_of(row, covariance, gain, size):
    """Return the variance of the reading of a row; `gain` is scratch."""
    spread_of(row, covariance, gain, size)
    return max(read(row, gain, size), 0.0)


@kernel
def spread_of(row, covariance, gain, size):
    """Write the covariance of all states with the reading of a row."""
    width = whole(size)
    clear(gain, width)
    for k in range(0, size - 3, 4):
        one, two, three, four = row[k], row[k + 1], row[k + 2], row[k + 3]
        if one != 0.0 or two != 0.0 or three != 0.0 or four != 0.0:
            first, second, third, fourth = covariance[k], covariance[k + 1], covariance[k + 2], covariance[k + 3]
            for i in range(width):
                gain[i] += one * first[i] + two * second[i] + three * third[i] + four * fourth[i]
    for k in range(size - size % 4, size):
        if row[k] != 0.0:
            one, first = row[k], covariance[k]
            for i in range(width):
                gain[i] += one * first[i]


@kernel
def column_row(p, columns, at, scale, row):
    """Write the row of a quantity that changes by `scale` times a column of `columns` (c, ..) a state, see `Posture`.

    A drive is known up to the zero of its stroke, which moves the boom by as much the other way.
    """
    n, m = p.drives.shape[0], p.modes[0]
    clear(row, all_states(p))
    load, drive = force_place(p), drive_place(p)
    for j in range(m):
        row[j] = scale * columns[2 + n + j, at]
    for a in range(2):
        row[load + a] = row[load + 2 + a] = scale * columns[a, at]
    for i in range(n):
        row[drive + i] = scale * columns[2 + i, at]
        if p.stroke_zero > 0:
            row[zero_place(p) + p.stroke_zero + i] = -row[drive + i]


@inner
def standing_share(p, i, row):
    """Return how far the reading of `row` is off by a unit of a lasting error of sensor `i` of those that drive the model.

    An inclinometer that is off turns its section alone: the next inclinometer makes up for it.
    """
    at = drive_place(p) + i
    if not p.reads_angle:
        return row[at]
    share = row[at] / p.slope[i]
    if i + 1 < p.drives.shape[0] and p.absolute[i + 1]:
        share -= row[at + 1] / p.slope[i + 1]
    return share


@inner
def standing_variance(p, f, row):
    """Return the variance of a predicted reading by the zeros and the lasting rounding of what drives the model."""
    variance, total = f.noise.zero2 + f.noise.rounding2, 0.0
    for i in range(p.drives.shape[0] if variance > 0.0 else 0):
        share = standing_share(p, i, row)
        total += share * share
    return total * variance


@inner
def length_row(p, i, row):
    """Write the row of the stroke transducer of cylinder `i`: its drive, and the oil's compression by the elastic force."""
    column_row(p, p.forces, i, p.oil_read[i], row)
    row[drive_place(p) + i] += p.drive_read[i]


@inner
def force_row(p, i, row):
    """Write the row of the force of cylinder `i`: the elastic force, and that of the oil's damping, d x' = (d/k) (k x)'."""
    n, m = p.drives.shape[0], p.modes[0]
    column_row(p, p.forces, i, 1.0, row)
    drive = drive_place(p)
    for k in range(n):
        row[drive + n + k] = p.lag[i] * p.forces[2 + k, i]
    for j in range(m):
        row[m + j] = p.lag[i] * p.forces[2 + n + j, i]


@inner
def length_of(p, i, row, x, size):
    """Return what the stroke transducer of cylinder `i` reads by a state, m; `row` is that of `length_row`."""
    return p.drives[i] + p.oil_read[i] * p.pulled[i] + about_rest(p, row, x, size)


@inner
def site_column(p, site):
    """Return the place of x of a site in a row of `Posture.readings`; y and angle follow."""
    return p.drives.shape[0] + 3 * site


@inner
def drive_row(p, f, i, x, row, size):
    """Write the row at state `x` of sensor `i` of those that drive the model; return what it reads."""
    if p.reads_angle:
        column_row(p, p.readings, i, 1.0, row)
        found = p.read[i] + p.tilt[i] + about_rest(p, row, x, size)
        return found + add_sway(p, f, i, x, row)
    length_row(p, i, row)
    return length_of(p, i, row, x, size)


@inner
def add_sway(p, f, i, x, row):
    """Add the error of inclinometer `i` by its acceleration at state `x` to its row; return that error, rad."""
    if not p.sways[i]:
        return 0.0
    site, size = p.channels[i].site, zero_place(p)  # angle sensors are the first channels
    at, g = site_column(p, site), math.hypot(p.gravity[0], p.gravity[1])
    up_x, up_y = -p.gravity[0] / g, -p.gravity[1] / g
    acceleration_row(p, at, f.rows[0])
    acceleration_row(p, at + 1, f.rows[1])
    ax, ay = f.bends[site, 0] + read(f.rows[0], x, size), f.bends[site, 1] + read(f.rows[1], x, size)
    level, lift = up_y * ax - up_x * ay, g + up_x * ax + up_y * ay
    square = level * level + lift * lift
    by_x, by_y = (lift * up_y - level * up_x) / square, -(lift * up_x + level * up_y) / square
    for k in range(size):
        row[k] += by_x * f.rows[0, k] + by_y * f.rows[1, k]
    return math.atan2(level, lift)


@inner
def rate_row(p, at, row):
    """Write the row of the rate of column `at` of `Posture.readings`."""
    n, m = p.drives.shape[0], p.modes[0]
    clear(row, all_states(p))
    drive = drive_place(p)
    for j in range(m):
        row[m + j] = p.readings[2 + n + j, at]
    for i in range(n):
        row[drive + n + i] = p.readings[2 + i, at]


@kernel
def acceleration_row(p, at, row):
    """Write the row of the acceleration of column `at` of `Posture.readings`, less what its curved way needs at its speed."""
    n, m = p.drives.shape[0], p.modes[0]
    clear(row, all_states(p))
    load, drive = force_place(p), drive_place(p)
    for i in range(n):
        row[drive + 2 * n + i] = p.readings[2 + i, at]
    for j in range(m):
        mode, omega2 = 2 + n + j, p.omega[j] * p.omega[j]
        motion = p.readings[mode, at]
        row[j], row[m + j] = -omega2 * motion, -p.decay[j] * motion
        for b in range(2):
            share = motion * p.readings[mode, n + b]
            row[load + b] += share
            row[load + 2 + b] += share
        for i in range(n):
            row[drive + 2 * n + i] -= motion * p.forces[mode, i] / omega2
