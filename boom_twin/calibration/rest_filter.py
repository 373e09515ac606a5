"""Kalman filter of a rest period: how far readings of all sensors are from what the readings before them let expect.

While no valve is open, no drive moves: the boom vibrates about one equilibrium, under a load at the tip that the model does not
know (`boom_twin.deviation.kalman`). The filter is linear but for the IMU, whose reading turns with the tip.
"""

from __future__ import annotations

import math

from ..deviation.channels import specific_force_row
from ..deviation.kalman import FAST, correct, first_variances, make_transition, transit
from ..deviation.rows import (
    about_rest,
    acceleration_row,
    add_sway,
    column_row,
    force_row,
    length_of,
    length_row,
    read,
    site_column,
)
from ..deviation.sensor_model import TURN, specific_force
from ..deviation.states import PREDICTION, VALVES, all_states, drive_place, force_place, zero_place
from ..deviation.step import step_lengths
from ..kernels.jit import inner, kernel
from ..kernels.tables import OK

DRIVE = 5e-3  # m, standard deviation of a drive from the one of the mean lengths
AMPLITUDE = 0.2  # m, standard deviation of each mode's displacement of the tip when a rest period begins
OUTLIER = 6.0  # standard deviations of an innovation, beyond which its reading loses weight (Huber)


@kernel
def note_drives(t, boom, live, work, p, f, stamps, lengths, gravity, row, drives, opened):
    """Run the filter of `step_lengths` over `lengths` (m, n; m) at `stamps` (m; ns); return the status, see `kernels.tables`.

    It writes the `drives` (m, n; m) and whether any valve is believed open, `opened` (m,).
    """
    for k in range(stamps.shape[0]):
        h = (stamps[k] - stamps[k - 1]) * 1e-9 if k > 0 else 0.0
        status = step_lengths(t, boom, live, work, p, f, h, stamps[k], lengths[k], gravity, row)
        if status != OK:
            return status
        opened[k] = False
        for i in range(lengths.shape[1]):
            opened[k] |= f.is_open[PREDICTION, i] == 1
            drives[k, i] = f.mean[PREDICTION, drive_place(p) + i]
    return OK


@kernel
def filter_rest(p, f, loads, zero2, gravity, inclination, times, channels, values, variances, found, zeros):
    """Write the innovations of a rest period with their variances `found` (r, 2), and the zeros (2 + n,) estimated at its end.

    `p`, `f` are `Posture` and `Filters` of the boom at rest, of which the model `VALVES` is used. Variances: `loads` (2,) of
    the fast load along x and y, N^2; `zero2` (2 + n,) of the zeros of the IMU's axes, m^2/s^4, and of the angle sensors,
    rad^2; `variances` (channels,) of the sensors' noise. `gravity` (2,) is in m/s^2, `inclination` of the base in rad.
    Readings: `times` (r,), s, ascending; `channels` (r,): lengths (n), angles (n), axes of the IMU (2), forces (n); `values`
    (r,), SI.
    """
    n, size, zero = p.drives.shape[0], all_states(p), zero_place(p)
    x, covariance = f.x[VALVES], f.p[VALVES]
    start_rest(p, f, x, covariance, loads, zero2)
    last, step = times[0], -1.0
    for r in range(times.shape[0]):
        h = times[r] - last
        if h > 0.0:
            if abs(h - step) > 1e-6 * h:
                make_transition(p, f, h)
                step = h
            transit(p, f, VALVES, size, h, loads, 0.0)
            last = times[r]
        c = channels[r]
        if c < n:
            length_row(p, c, f.row)
            innovation = values[r] - length_of(p, c, f.row, x, size)
        elif c < 2 * n:
            column_row(p, p.readings, c - n, 1.0, f.row)
            at = zero + 4 + c - n
            innovation = values[r] - p.read[c - n] - about_rest(p, f.row, x, size) - x[at]
            innovation -= add_sway(p, f, c - n, x, f.row)
            f.row[at] = 1.0
            if p.absolute[c - n]:
                innovation -= inclination
                innovation -= TURN * math.floor(innovation / TURN + 0.5)
        elif c < 2 * n + 2:
            innovation = values[r] - expect_imu(p, f, c - n, x, size, gravity)
        else:
            i = c - 2 * n - 2
            force_row(p, i, f.row)
            at = zero + 4 + n + i
            innovation = values[r] - p.pulled[i] - about_rest(p, f.row, x, size) - x[at]
            f.row[at] = 1.0
        found[r, 0] = innovation
        found[r, 1] = weigh_and_correct(f, x, covariance, innovation, variances[c], size)
    for k in range(2):
        zeros[k] = x[zero + k]
    for i in range(n):
        zeros[2 + i] = x[zero + 4 + i]


@inner
def weigh_and_correct(f, x, covariance, innovation, variance, size):
    """Correct the state by the reading in `f.row`; return the variance of its innovation, larger for an outlier."""
    expected = variance
    for i in range(size):
        if f.row[i] != 0.0:
            expected += f.row[i] * read(f.row, covariance[i], size)
    excess = max(innovation * innovation / (OUTLIER * OUTLIER) - expected, 0.0)
    return correct(x, covariance, f.row, f.gains[0], innovation, variance + excess, size)


@inner
def expect_imu(p, f, c, x, size, gravity):
    """Write the row of the measured channel `c`, an axis of the IMU, at the state `x`; return the expected reading."""
    channel, zero = p.channels[c], zero_place(p)
    at = site_column(p, channel.site)
    acceleration_row(p, at, f.rows[2])
    acceleration_row(p, at + 1, f.rows[3])
    column_row(p, p.readings, at + 2, 1.0, f.rows[4])
    angle = p.read[at + 2] + about_rest(p, f.rows[4], x, size)
    f.motion[channel.site, 2] = angle
    cosine, sine = math.cos(angle + channel.turned), math.sin(angle + channel.turned)
    along, up = read(f.rows[2], x, size) - gravity[0], read(f.rows[3], x, size) - gravity[1]
    first = c - channel.index
    f.felt[first], f.felt[first + 1] = specific_force(along, up, cosine, sine)
    specific_force_row(p, f, c, f.row)
    f.row[zero + channel.index] = 1.0
    return f.felt[c] * (1.0 + x[zero + 3]) + f.row[zero + 2] * x[zero + 2] + x[zero + channel.index]


@inner
def start_rest(p, f, x, covariance, loads, zero2):
    """Set the state to rest at the posture; the covariance allows for vibration, and for drives beside it."""
    n, m, size, zero = p.drives.shape[0], p.modes[0], all_states(p), zero_place(p)
    load, drive = force_place(p), drive_place(p)
    first_variances(p, f, f.gain)
    for i in range(size):
        x[i] = 0.0
        for k in range(size):
            covariance[i, k] = 0.0
        if i >= zero:
            covariance[i, i] = f.gain[i]
    for j in range(m):
        motion2 = p.readings[2 + n + j, n] ** 2 + p.readings[2 + n + j, n + 1] ** 2
        covariance[j, j] = AMPLITUDE * AMPLITUDE / max(motion2, 1e-300)
        covariance[m + j, m + j] = p.omega[j] * p.omega[j] * covariance[j, j]
    for a in range(2):
        covariance[load + a, load + a] = loads[a]
        covariance[load + 2 + a, load + 2 + a] = f.noise.least_load * f.noise.least_load + loads[a]
        covariance[load + 4 + a, load + 4 + a] = loads[a] / (FAST * FAST)
        covariance[zero + a, zero + a] = zero2[a]
    for i in range(n):
        x[drive + i], covariance[drive + i, drive + i] = p.drives[i], DRIVE * DRIVE
        covariance[zero + 4 + i, zero + 4 + i] = zero2[2 + i]
        f.jerk[i] = 0.0
    for k in range(f.drift.shape[0]):
        f.drift[k] = 0.0
