"""State of the filter behind the estimate of the tip, and the algebra on its covariance.

What the states are, and the equations: `boom_twin.estimation.tip_estimate`. The covariance is symmetric, to the bit: what
changes is computed by rows, along which a processor takes four numbers at once, and columns are copied.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.jit import by_reference, inner
from ..types import Array

MODES = 6  # at most
LEAST_LOAD, MOST_LOAD, USUAL_LOAD, FIRST_LOAD = range(4)  # of `loads`
STAYS, STAY_TIME = 2.0, 100.0  # standard deviation of the load that stays over the usual one; s
SCENE_ERROR = 0.02  # standard deviation of a before anything is measured
SCENE_ERRORS = 0.05, 0.003  # likewise of cylinders that are as the scene says: roughly, exactly
FORCE_OFF, FORCE_DRIFT = 1.0, 0.03  # standard deviation of o once forces are measured, and what is added to it in a second
LEAST_FORCE = 0.1  # both of a cylinder's force and this share of the largest one
SOFT, SOFTENING = 0.5, 0.02  # standard deviation of a once anything is measured, and what is added to it in a second

LOAD, LOAD_CHANGE, ERROR, BIAS, TURNED, SCALE, STAYING, SHARES = 0, 2, 4, 6, 8, 9, 10, 12
"""First places in the state: the load's x and y, their rates, e's x and y, biases of the IMU's x and z, its mounting angle
and scale, the part of the load that stays (x and y), the shares a (n,) and b (n,); then q_j and q_j' of every mode, and
o (n,) if forces are measured."""

COUNT, STARTED, FED, STAMP, ANGLES_STAMP, FORCED, IMU_STAMP = range(7)  # of `status`
ANGLE, FELT_X, FELT_Y, STEP, SHAKEN = range(5)
"""Places in `now`: angle of the tip, rad; its predicted acceleration less gravity, m/s^2; time since the strokes before, s;
mean squares of its predicted acceleration along x and y lately, (m/s^2)^2."""


@by_reference
class DeviationFilter(NamedTuple):
    """The filter as kernels take it; n joints, m modes at most, s states, c measured channels, f frames, k stations.

    status : (7,) number of modes; whether it has begun; whether anything was measured; stamps of the newest strokes and of the
    newest angles, ns; whether cylinder forces were measured; stamp of the newest of the IMU, ns.
    omega, decay, density : (m,) rad/s; 2 zeta omega, 1/s; of w, m^2 kg/s^3.
    relative : (f, m, 3) motion of every frame relative to the one before, in its axes: m, m, rad per unit of q.
    forces : (m, n) N per unit. bending : (m, k) M_j w / EI. sections : (k,) of the stations, 0-based.
    sections_off : (n,) standard deviation of b. softness, slopes : (n,) 1/k, m/N, 0 of a rigid cylinder; stroke over angle, m.
    roots : (n,) frames of the pivots. sensed, absolute : (n,) frames of the inclinometers, and which angle sensors are such.
    noise : (c,) variances of the sensors. masked : (c,) channels that are not to be used.
    noisier : (1,) times the variance that is stated, of the strokes. reading : (1,) the stated variance of one, m^2.
    pulls : (n,) predicted forces of the cylinders, slow, N.
    tip : (m, 3), turns : (m, n), lever : (n, 3) at the newest posture: motion of the tip, of the angles, and of the
    tip by strokes.
    coupling : (m, 4 + 2 n) of f, a, b and the load that stays. drawn, ahead : (n,) F_i / k_i, m, slow; by which
    share the newest is more.
    variances : (n,) of the strokes' estimates, m^2. pushes : (2,) of e, (m/s^2)^2.
    x, p : state and covariance. row, gain, rows : (s,), (s,), (8, s) scratch.
    within, cross : (8, 8), (8, n) scratch, covariances of what the rows read with one another and with a.
    shifts : (8, l (n + 1)) scratch, by how much the causes change what the rows read, l levels of the scene's error;
    that all are off changes nothing.
    inverse, healed, drag : (l, n, n), (l, 8, n), (l, n) scratch, B of `weigh_level`, B times `cross` and times the mean of a.
    chances : (l (n + 1) + 1,) of the causes: of each level no cylinder is off, one of them is; all are.
    likely : (5,) scratch, see `boom_twin.estimation.load_level`. before : (2, 2) what angles and IMU said last of the two
    components of the load. level : (2,) of these, N.
    loads : (4,) least and largest level, the usual one, and that which it begins with, N.
    spread : (2, 2) mean square of the tip's x and y less the predicted ones lately, and the newest, with what is not known of
    it, m^2.
    now : (6,) see `ANGLE`.
    """

    status: NDArray[np.int64]
    omega: Array
    decay: Array
    density: Array
    relative: Array
    forces: Array
    bending: Array
    sections: NDArray[np.int64]
    sections_off: Array
    softness: Array
    slopes: Array
    roots: NDArray[np.int64]
    sensed: NDArray[np.int64]
    absolute: NDArray[np.bool_]
    noise: Array
    masked: NDArray[np.bool_]
    noisier: Array
    reading: Array
    pulls: Array
    tip: Array
    turns: Array
    lever: Array
    coupling: Array
    drawn: Array
    ahead: Array
    variances: Array
    pushes: Array
    x: Array
    p: Array
    row: Array
    gain: Array
    rows: Array
    within: Array
    cross: Array
    healed: Array
    inverse: Array
    drag: Array
    shifts: Array
    chances: Array
    spread: Array
    level: Array
    loads: Array
    likely: Array
    before: Array
    now: Array


@inner
def states_of(f):
    """Number of states: the first places, those of the modes that there are, and of the forces' offsets."""
    return offset_place(f, f.softness.shape[0] if f.status[FORCED] else 0)


@inner
def offset_place(f, i):
    """Place in the state of the offset of cylinder i's force."""
    return mode_place(f, f.status[COUNT]) + i


@inner
def mode_place(f, j):
    """Place in the state of the coordinate of mode j; its rate is behind it."""
    return SHARES + 2 * f.softness.shape[0] + 2 * j


@inner
def oscillate(omega, decay, h):
    """What position and rate of q'' + decay q' + omega^2 q = 0 become within h (s): a 2 by 2 matrix by rows, exact."""
    half = 0.5 * decay
    wave2 = omega * omega - half * half
    if wave2 > 0.0:
        wave = math.sqrt(wave2)
        c, s = math.cos(wave * h), math.sin(wave * h) / wave
    else:
        wave = math.sqrt(-wave2)
        c, s = math.cosh(wave * h), h
        if wave > 0.0:
            s = math.sinh(wave * h) / wave
    e = math.exp(-half * h)
    return e * (c + half * s), e * s, e * (-omega * omega * s), e * (c - half * s)


@inner
def input_place(f, b):
    """Place in the state of an input of the modes: of the load the first two, then the shares, then the load that stays."""
    shares = 2 * f.softness.shape[0]
    if b < 2:
        return LOAD + b
    return SHARES + b - 2 if b < 2 + shares else STAYING + b - 2 - shares


@inner
def is_sag(b, n):
    """Whether input b is a share by which a section bends more: that acts at once and shakes nothing."""
    return 2 + n <= b < 2 + 2 * n


@inner
def copy_columns(p, place, size):
    """The column of a symmetric matrix at `place`, from its row."""
    for k in range(size):
        p[k, place] = p[place, k]


@inner
def add_row(row, share, of, size):
    """Add to a row a share of another; nothing if the share is 0."""
    if share != 0.0:
        for k in range(size):
            row[k] += share * of[k]


@inner
def mix_rows(one, other, a11, a12, a21, a22, before, size):
    """Two rows become a 2 by 2 matrix times them; `before` (s,) is scratch. A loop that writes one row only is vectorised."""
    for k in range(size):
        before[k] = one[k]
    for k in range(size):
        one[k] = a11 * one[k] + a12 * other[k]
    for k in range(size):
        other[k] = a21 * before[k] + a22 * other[k]


@inner
def covary(p, row, gain, size):
    """Covariance `gain` of all states with what `row` reads: P times it, by rows of P, which is symmetric."""
    clear(gain, size)
    for k in range(size):
        add_row(gain, row[k], p[k], size)


@inner
def clear(row, size):
    """No reading of anything."""
    for k in range(size):
        row[k] = 0.0
