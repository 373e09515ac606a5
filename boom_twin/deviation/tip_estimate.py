"""Estimate of the tip by all sensors, and its covariance: that of the filter, doubtful transducers, errors of the scene."""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from ..kernels.tables import FRAME_ANGLE, FRAME_X, FRAME_Y
from .channels import POINT_ZERO, READS_COORDINATE
from .estimate_row import (
    ACCELERATION,
    ACCELERATION_COVARIANCE,
    COORDINATES,
    FORCE,
    FORCE_VARIANCE,
    MODES,
    RATES,
    TIP,
    TIP_COVARIANCE,
    VELOCITY,
    VELOCITY_COVARIANCE,
)
from .kalman import ANGLE_ZERO
from .mixture import renew_estimate
from .rows import (
    acceleration_row,
    clear,
    column_row,
    difference,
    rate_row,
    read,
    spread_of,
    standing_share,
    standing_variance,
    variance_of,
)
from .states import ESTIMATE, PREDICTION, copy_place, force_place, zero_place

MASS_PART = 0.77  # variance of the tip by errors of the masses over that of EI: a cantilever of four equal sections
FAULT_CHANCE, FAULT = 0.01, 0.03  # that a sensor is off, and by how much as an angle of its joint, rad


@inner
def write_tip_estimate(p, f, live, results, out):
    """Write the estimate beside the newest prediction; see `boom_twin.deviation.estimate_row.WIDTH`."""
    n, m, size, load = p.drives.shape[0], p.modes[0], zero_place(p), force_place(p)
    every = copy_place(p) if p.stroke_zero > 0 else size  # states that the tip depends on
    mean, expected = f.mean[ESTIMATE], f.mean[PREDICTION]
    renew_estimate(p, f)
    for a in range(3):
        column_row(p, p.readings, n + a, 1.0, f.rows[a])
        rate_row(p, n + a, f.rows[3 + a])
        acceleration_row(p, n + a, f.rows[6 + a])
        out[TIP + a] = results.tip[0, a] + difference(f.rows[a], mean, expected, every)
        out[VELOCITY + a] = results.tip[1, a] + difference(f.rows[3 + a], mean, expected, size)
        out[ACCELERATION + a] = results.tip[2, a] + difference(f.rows[6 + a], mean, expected, size)
    write_covariance(f, ESTIMATE, 0, every, out[TIP_COVARIANCE:VELOCITY_COVARIANCE])
    add_standing_errors(p, f, f.noise.rounding2, out[TIP_COVARIANCE:VELOCITY_COVARIANCE])
    add_doubt(p, f, out[TIP_COVARIANCE:VELOCITY_COVARIANCE])
    add_scene_doubt(p, f, live, out[TIP_COVARIANCE:VELOCITY_COVARIANCE])
    write_covariance(f, ESTIMATE, 3, size, out[VELOCITY_COVARIANCE:ACCELERATION_COVARIANCE])
    add_square(out[VELOCITY_COVARIANCE:ACCELERATION_COVARIANCE], f.lateness[0] * f.lateness[0], f.motion[0, 6:9])
    write_covariance(f, ESTIMATE, 6, size, out[ACCELERATION_COVARIANCE:FORCE_VARIANCE])
    for j in range(MODES):
        out[COORDINATES + j] = f.mean[ESTIMATE, j] if j < m else math.nan
        out[RATES + j] = f.mean[ESTIMATE, m + j] if j < m else math.nan
    covariance = f.spread[ESTIMATE]
    for a in range(2):
        fast, slow = load + a, load + 2 + a
        out[FORCE + a] = f.mean[ESTIMATE, fast] + f.mean[ESTIMATE, slow]
        out[FORCE_VARIANCE + a] = covariance[fast, fast] + 2.0 * covariance[fast, slow] + covariance[slow, slow]


@inner
def add_doubt(p, f, out):
    """Add the variance by stroke transducers that are off to the upper triangle of the tip's covariance.

    An angle sensor and the lengths differ because the angle's zero is off by ANGLE_ZERO and the prediction by its deviation, or
    because either sensor is off by FAULT (rad, normal, equal odds). The posterior probability that it is the transducer weighs
    the square of the tip's way by it.
    """
    n = p.drives.shape[0]
    for i in range(n):
        apart = f.apart[i] - (f.apart[i - 1] if i > 0 and p.absolute[i] else 0.0)
        if apart == 0.0:
            continue
        column_row(p, p.readings, i, 1.0, f.row)
        usual2 = ANGLE_ZERO * ANGLE_ZERO + variance_of(f.row, f.spread[PREDICTION], f.gain, zero_place(p))
        usual2 += standing_variance(p, f, f.row)
        log_odds = (
            0.5 * (apart / FAULT) ** 2 - 0.5 * apart * apart / usual2 + math.log(FAULT / (FAULT_CHANCE * math.sqrt(usual2)))
        )
        share = (apart / p.slope[i]) ** 2 / (math.exp(min(log_odds, 500.0)) + 2.0)
        add_square(out, share, p.readings[2 + i, n : n + 3])


@inner
def add_standing_errors(p, f, variance, out):
    """Add the covariance of the tip by lasting errors of what drives the model; `f.rows` are those of the tip."""
    for i in range(p.drives.shape[0] if variance > 0.0 else 0):
        for a in range(3):
            f.gain[a] = standing_share(p, i, f.rows[a])
        add_square(out, variance, f.gain)


@inner
def add_square(out, share, moved):
    """Add `share` times the product of `moved` (x, y, angle) with itself to an upper triangle."""
    at = 0
    for a in range(3):
        for b in range(a, 3):
            out[at] += share * moved[a] * moved[b]
            at += 1


@inner
def add_scene_doubt(p, f, live, out):
    """Add the variance by errors of the scene to the upper triangle of the tip's covariance, or what a measured point leaves.

    A point on the last section shows the errors of the sections before. What it is off by is its zero or the tip's error.
    """
    n, measured, zero = p.drives.shape[0], f.rows[0], zero_place(p)
    clear(measured, 6)
    add_scene_error(p, f, live, measured)
    for c in range(p.channels.shape[0] - 1):
        channel, at = p.channels[c], zero + p.channels[c].zero
        is_first = channel.kind == READS_COORDINATE and channel.index == 0 and p.behind[0] > channel.zero + 1
        if is_first and p.sites[channel.site].section == n - 1 and not (f.masked[c] or f.masked[c + 1]):
            left, x, y = f.rows[1], f.mean[ESTIMATE, at], f.mean[ESTIMATE, at + 1]
            clear(left, 6)
            add_section_errors(p, f, live, n if channel.site == 0 else n - 1, left)
            xx, xy = x * x + f.spread[ESTIMATE, at, at], x * y + f.spread[ESTIMATE, at, at + 1]
            add_shown(measured, left, xx, xy, y * y + f.spread[ESTIMATE, at + 1, at + 1])
            if left[0] + left[3] < measured[0] + measured[3]:
                for i in range(6):
                    measured[i] = left[i]
    for i in range(6):
        out[i] += measured[i]


@inner
def add_shown(every, left, xx, xy, yy):
    """Add to the triangle `left` of sections behind a point what it shows of those before; it is off by Z = (xx, xy; xy, yy).

    The sections before have the covariance S = `every` - `left` of x, y and angle. The point shows x and y up to its zero, and
    so the angle B (x, y) with

        B = S_a (S_xy + POINT_ZERO^2 I)^-1,

    of which the variance S_aa - B S_a^T is unknown. The tip's angle has B Z B^T + S_aa - B S_a^T, and B Z with x and y.
    """
    zero2 = POINT_ZERO * POINT_ZERO
    s_xx, s_xy, s_yy = every[0] - left[0] + zero2, every[1] - left[1], every[3] - left[3] + zero2
    s_ax, s_ay, determinant = every[2] - left[2], every[4] - left[4], s_xx * s_yy - s_xy * s_xy
    b_x, b_y = (s_ax * s_yy - s_ay * s_xy) / determinant, (s_ay * s_xx - s_ax * s_xy) / determinant
    to_x, to_y = b_x * xx + b_y * xy, b_x * xy + b_y * yy
    unknown = every[5] - left[5] - b_x * s_ax - b_y * s_ay
    left[0] += xx
    left[1] += xy
    left[2] += to_x
    left[3] += yy
    left[4] += to_y
    left[5] += b_x * to_x + b_y * to_y + unknown


@kernel
def write_predicted_covariance(p, f, live, out):
    """Write the upper triangle of the covariance of the predicted tip, with errors of the scene."""
    for a in range(3):
        column_row(p, p.readings, p.drives.shape[0] + a, 1.0, f.rows[a])
    write_covariance(f, PREDICTION, 0, zero_place(p), out)
    add_standing_errors(p, f, f.noise.zero2 + f.noise.rounding2, out)
    add_scene_error(p, f, live, out)


@inner
def add_scene_error(p, f, live, out):
    """Add the covariance of the tip by errors of the scene, and by named faults that it does not have.

    If stamps of what drives the model lag by T, the tip is where it was T ago: v T and a T^2 / 2 away.
    """
    add_section_errors(p, f, live, 0, out)
    late2 = f.lateness[0] * f.lateness[0]
    add_square(out, late2, f.motion[0, 3:6])
    add_square(out, 0.25 * late2 * late2, f.motion[0, 6:9])
    for i in range(6):
        out[i] += f.fault[i]


@inner
def add_section_errors(p, f, live, first, out):
    """Add the variance by wrong stiffnesses and masses of the sections from `first` on to an upper triangle.

    The bending of section i moves the tip by c_i = (d_i + a_i e_z x r_i, a_i), with the deflection d_i and the turn a_i of its
    end against its root, and r_i from its end to the tip. Independent relative errors of the EI add the sum of c_i c_i^T times
    their variance. Those of the masses add `MASS_PART` times as much.
    """
    n, share2 = p.drives.shape[0], (1.0 + MASS_PART) * f.noise.scene_error * f.noise.scene_error
    tip, moved = live.frames[p.roots[n]], f.row
    for i in range(first, n):
        root, end = live.frames[p.roots[i]], live.frames[p.roots[i + 1] - (1 if i < n - 1 else 0)]
        heading, turn = root[FRAME_ANGLE], end[FRAME_ANGLE] - root[FRAME_ANGLE]
        moved[0] = end[FRAME_X] - root[FRAME_X] - p.lengths[i] * math.cos(heading) - turn * (tip[FRAME_Y] - end[FRAME_Y])
        moved[1] = end[FRAME_Y] - root[FRAME_Y] - p.lengths[i] * math.sin(heading) + turn * (tip[FRAME_X] - end[FRAME_X])
        moved[2] = turn
        add_square(out, share2, moved)


@inner
def write_covariance(f, mixture, first, size, out):
    """Write the upper triangle of the covariance of what three of `f.rows` read by a mixture."""
    at = 0
    for a in range(first, first + 3):
        spread_of(f.rows[a], f.spread[mixture], f.gain, size)
        for b in range(a, first + 3):
            out[at] = read(f.rows[b], f.gain, size)
            at += 1
