"""Step of the filters on what drives the model, and its results: prediction and expected readings."""

from __future__ import annotations

import math

from ..kernels.elements.linkage import angle_of_length
from ..kernels.integrators import X
from ..kernels.jit import inner, kernel
from ..kernels.result_row import estimates_in, results_in
from ..kernels.tables import FRAME_ANGLE, FRAME_X, FRAME_Y, NOT_FINITE, OK
from ..kernels.transfer.forward_kinematics import place
from .channels import READS_ACCELERATION
from .models import step_models
from .posture import WIDEST, linearise, locate
from .rows import (
    SHAKEN_TIME,
    about_rest,
    acceleration_row,
    drive_row,
    force_row,
    length_of,
    length_row,
    rate_row,
    read,
    site_column,
    variance_of,
)
from .sensor_model import specific_force
from .states import ESTIMATE, FED, FED_STAMP, PREDICTION, STARTED, drive_place, force_place, zero_place

PATIENCE = 1_000_000_000  # ns without readings after which the estimate is the prediction again
STARTING = 1_000_000_000  # ns after the start; a valve that is found open by then was open at the start
ANGLE_STEP = 0.01  # rad that a joint turns by before the boom is linearised anew


@kernel
def step_lengths(t, boom, live, work, p, f, h, stamp, y, gravity, out):
    """Take lengths or angles and write the prediction.

    Parameters
    ----------
    t, boom, live, work : Tables, State, State, Work
        `boom` is at rest at the posture; `live` becomes the boom as predicted.
    p, f : Posture, Filters
    h : float
        Time since those before, s; 0 for the first.
    stamp : int
        ns.
    y : ndarray, shape (n,)
        Lengths of the cylinders less their closed lengths, m; or readings of angle sensors, rad. NaN where missing.
    gravity : ndarray, shape (2,)
        m/s^2.
    out : ndarray, shape (prediction_width,)
        Results and estimates, see `kernels.result_row`.

    Returns
    -------
    int
        Status, see `kernels.tables`.
    """
    n, drive = p.drives.shape[0], drive_place(p)
    turned = 0.0
    for i in range(n):
        turned = max(turned, abs((f.mean[PREDICTION, drive + i] - p.drives[i]) * p.slope[i]))
    if turned > ANGLE_STEP:
        status = linearise(t, boom, work, p, f.mean[PREDICTION, drive : drive + n], True)
        if status != OK:
            return status
    if h == 0.0:
        f.status[STARTED] = stamp
    # zeros of sensors that were learnt from a boom at rest are wrong if it moved
    started_in_move = stamp - f.status[STARTED] < STARTING and f.is_open[PREDICTION].any()
    if f.status[FED] == 1 and (stamp - f.status[FED_STAMP] > PATIENCE or started_in_move):
        f.status[FED], f.apart[:] = 0, 0.0
    step_models(p, f, h, y)
    if not is_finite(p, f):
        return NOT_FINITE
    place_live(t, boom, live, work, p, f)
    write_ways(boom, live, work, p, f)
    write_prediction(t, boom, live, p, f, h, gravity, out)
    return OK


@inner
def is_finite(p, f):
    """Return True if mean and variances of prediction and estimate are numbers."""
    total = 0.0
    for k in range(zero_place(p)):
        total += abs(f.mean[PREDICTION, k]) + f.spread[PREDICTION, k, k]
        total += abs(f.mean[ESTIMATE, k]) + f.spread[ESTIMATE, k, k]
    return math.isfinite(total)


@inner
def place_live(t, boom, live, work, p, f):
    """Set `live` to the mean of the prediction."""
    n, m, load, drive = p.drives.shape[0], p.modes[0], force_place(p), drive_place(p)
    for i in range(live.z.shape[0]):
        live.z[i] = p.rest[i]
    for a in range(2):
        add_column(p, live.z, a, f.mean[PREDICTION, load + a] + f.mean[PREDICTION, load + 2 + a])
    for i in range(n):
        add_column(p, live.z, 2 + i, f.mean[PREDICTION, drive + i] - p.drives[i])
    for j in range(m):
        add_column(p, live.z, 2 + n + j, f.mean[PREDICTION, j])
    for i in range(live.history.shape[1]):
        live.history[X, i] = boom.history[X, i]
    for i in range(n):
        live.drives[0, i], live.drives[1, i] = p.closed[i] + f.mean[PREDICTION, drive + i], f.mean[PREDICTION, drive + n + i]
    place(t, live, work)


@inner
def add_column(p, z, k, size):
    """Add `size` times column `k` of the posture to the unknowns."""
    for i in range(z.shape[0]):
        z[i] += size * p.columns[k, i]


@inner
def write_prediction(t, boom, live, p, f, h, gravity, out):
    """Write results and estimates; see `kernels.result_row`."""
    n, size, pins = p.drives.shape[0], zero_place(p), t.clearances.shape[0]
    found, estimates = results_in(out, n, pins), estimates_in(out, n, pins)
    for i in range(n):
        root = p.roots[i]
        found.joints[i] = live.frames[root, FRAME_ANGLE] - live.frames[root - 1, FRAME_ANGLE]
        elastic = live.z[t.cylinders[i].z]
        force_row(p, i, f.row)
        f.pulls[i] = found.cylinder_forces[i] = p.pulled[i] + about_rest(p, f.row, f.mean[PREDICTION], size)
        length_row(p, i, f.row)
        estimates.strokes[i] = length_of(p, i, f.row, f.mean[PREDICTION], size)
        found.lengths[i] = estimates.strokes[i] + (p.compliance[i] - p.oil_read[i]) * elastic
        if not p.reads_angle:
            estimates.variances[i] = variance_of(f.row, f.spread[PREDICTION], f.gain, size)
            f.strokes[i, 0], f.strokes[i, 1] = estimates.strokes[i], rate_of(p, f.row, f.mean[PREDICTION])
            f.strokes[i, 2] = f.mean[PREDICTION, drive_place(p) + 2 * n + i]
    for k in range(pins):
        row = t.clearances[k]
        found.pins[k, 0], found.pins[k, 1] = live.z[row.z], live.z[row.z + 1]
        found.pins[k, 2], found.pins[k, 3] = 0.0, 1.0
    move_sites(t, boom, live, p, f, h, gravity)
    for k in range(3):
        for a in range(3):
            found.tip[k, a] = f.motion[0, 3 * k + a]
    if p.reads_angle:
        write_driving_angles(p, f, estimates)
    estimates.rigid_tip[0], estimates.rigid_tip[1] = rigid_tip(t, p, estimates.strokes)


@inner
def write_driving_angles(p, f, estimates):
    """Write the predicted readings of the angle sensors that drive the model, with variances, rates and accelerations."""
    size = zero_place(p)
    for i in range(p.drives.shape[0]):
        f.strokes[i, 0] = drive_row(p, f, i, f.mean[PREDICTION], f.row, size)
        estimates.variances[i] = variance_of(f.row, f.spread[PREDICTION], f.gain, size)
        rate_row(p, i, f.row)
        f.strokes[i, 1] = read(f.row, f.mean[PREDICTION], size)
        acceleration_row(p, i, f.row)
        f.strokes[i, 2] = read(f.row, f.mean[PREDICTION], size)


@inner
def move_sites(t, boom, live, p, f, h, gravity):
    """Write the predicted motion of all sites, how much they shake, and what accelerometers read there."""
    size = zero_place(p)
    for k in range(p.sites.shape[0]):
        motion, at = f.motion[k], site_column(p, k)
        motion[0], motion[1], motion[2] = locate(t, live, p, k)
        write_bend(boom, live, p, f, k, motion)
        f.bends[k, 0], f.bends[k, 1] = motion[6], motion[7]
        for a in range(3):
            rate_row(p, at + a, f.row)
            motion[3 + a] = read(f.row, f.mean[PREDICTION], size)
            acceleration_row(p, at + a, f.row)
            motion[6 + a] += read(f.row, f.mean[PREDICTION], size)
        share = min(h / SHAKEN_TIME, 1.0)
        f.shaking[k, 0] += share * (motion[6] * motion[6] + motion[7] * motion[7] - f.shaking[k, 0])
        f.shaking[k, 1] += share * (motion[5] * motion[5] - f.shaking[k, 1])
    for c in range(p.channels.shape[0]):
        channel = p.channels[c]
        if channel.kind == READS_ACCELERATION:
            motion = f.motion[channel.site]
            angle = motion[2] + channel.turned
            x, z = specific_force(motion[6] - gravity[0], motion[7] - gravity[1], math.cos(angle), math.sin(angle))
            f.felt[c] = x if channel.index == 0 else z


@inner
def rate_of(p, row, x):
    """Return the rate at state `x` of what a row of coordinates and drives reads; the load is held."""
    n, m, drive, rate = p.drives.shape[0], p.modes[0], drive_place(p), 0.0
    for j in range(m):
        rate += row[j] * x[m + j]
    for k in range(n):
        rate += row[drive + k] * x[drive + n + k]
    return rate


@inner
def write_ways(boom, live, work, p, f):
    """Write the accelerations that the curved ways of the pivots need at constant rates, and the modal forces of all such ways.

    With the turning rate w_i of the chord r_i of section i, and what w_i changes by the geometry of the linkages, a_i, a
    place has the acceleration c = sum_i (a_i e_z x r_i - w_i^2 r_i). The chord of its own section ends there. So masses m whose
    motion in mode j is s_j give the equation of that mode the force - sum m s_j . c.

    The rows have angular accelerations b_i act on the chords at rest, q_i. A place has sum_i b_i e_z x (r_i - q_i) in addition.
    """
    n, m, drive, change = p.drives.shape[0], p.modes[0], drive_place(p), 0.0
    chords = site_column(p, p.sites.shape[0])
    f.swing[:], f.ways[0] = 0.0, 0.0
    for i in range(n):
        rate, v = 0.0, f.mean[PREDICTION, drive + n + i]
        for k in range(n):
            rate += p.readings[2 + k, chords + i] * f.mean[PREDICTION, drive + n + k]
        for j in range(m):
            rate += p.readings[2 + n + j, chords + i] * f.mean[PREDICTION, m + j]
        change += p.curvature[i] * v * v
        f.ways[i, 2], f.ways[i, 3] = rate, change
        end = live.frames[p.roots[i + 1]]
        f.ways[i + 1, 0], f.ways[i + 1, 1] = bend_at(live, p, f, i, end[FRAME_X], end[FRAME_Y])
        acceleration_row(p, chords + i, f.row)
        f.ways[i, 4], rest = read(f.row, f.mean[PREDICTION], zero_place(p)), boom.frames[p.roots[i + 1]]
        f.ways[i + 1, 5], f.ways[i + 1, 6] = turned_at(
            boom, live, p, f, i, end[FRAME_X] - rest[FRAME_X], end[FRAME_Y] - rest[FRAME_Y]
        )
    for k in range(p.points.shape[0]):
        at, section = p.points[k]
        x, y = bend_at(live, p, f, section, work.position[at], work.position[at + 1])
        for j in range(m):
            f.swing[j] -= p.masses[at] * p.motions[j, at] * x + p.masses[at + 1] * p.motions[j, at + 1] * y


@inner
def bend_at(live, p, f, section, x, y):
    """Return the acceleration, m/s^2, that the curved way of a place of a section needs."""
    root, rate, change = live.frames[p.roots[section]], f.ways[section, 2], f.ways[section, 3]
    x, y = x - root[FRAME_X], y - root[FRAME_Y]
    return f.ways[section, 0] - rate * rate * x - change * y, f.ways[section, 1] + change * x - rate * rate * y


@inner
def turned_at(boom, live, p, f, section, off_x, off_y):
    """Return the acceleration, m/s^2, of a place of a section off its place at rest, by angular accelerations about rest."""
    root, rest, turn = live.frames[p.roots[section]], boom.frames[p.roots[section]], f.ways[section, 4]
    off_x, off_y = off_x - (root[FRAME_X] - rest[FRAME_X]), off_y - (root[FRAME_Y] - rest[FRAME_Y])
    return f.ways[section, 5] - turn * off_y, f.ways[section, 6] + turn * off_x


@inner
def write_bend(boom, live, p, f, k, motion):
    """Write what the acceleration (x, y, angle) of site `k` has beyond that about rest, and by the modal forces of ways."""
    at, section = site_column(p, k), p.sites[k].section
    x, y = bend_at(live, p, f, section, motion[0], motion[1])
    turned_x, turned_y = turned_at(boom, live, p, f, section, motion[0] - p.read[at], motion[1] - p.read[at + 1])
    motion[6], motion[7] = x + turned_x, y + turned_y
    motion[8] = f.ways[p.sites[k].section, 3]
    for j in range(p.modes[0]):
        for a in range(3):
            motion[6 + a] += p.readings[2 + p.drives.shape[0] + j, at + a] * f.swing[j]


@inner
def rigid_tip(t, p, lengths):
    """Return the tip (m) of rigid sections on rigid cylinders of these lengths; one out of reach leaves its joint."""
    x, y, heading = t.joints[0].x, t.joints[0].y, 0.0
    for i in range(p.angles.shape[0]):
        angle = angle_of_length(t.linkages[i], p.closed[i] + lengths[i], p.angles[i], -WIDEST, WIDEST)
        heading += angle if math.isfinite(angle) else p.angles[i]
        x += p.lengths[i] * math.cos(heading)
        y += p.lengths[i] * math.sin(heading)
    return x, y
