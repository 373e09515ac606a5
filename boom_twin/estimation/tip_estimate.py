"""Kalman filter of how the boom deviates from its prediction: the tip as all sensors see it, and the unknown load there.

The prediction is a function of the strokes alone. What it lacks, by load or by parameters that are off, is a small motion
about it, in the natural modes j of the present posture (coordinates q_j, unit modal mass):

    q_j'' + 2 zeta_j omega_j q_j' + omega_j^2 q_j = Phi_j^T f + sum_i N_ij (F_i / k_i) a_i + sum_s B_js b_s + w_j

- f (2), N: force at the tip that the model does not know, a Gauss-Markov process of second order, twice damped at `LOAD_RATE`,
  so that its rate is a state too: what shakes a boom has no corners, and a process of first order states twice the error of
  the acceleration that there is. Phi_j is the mode's motion of the tip, 1/sqrt(kg). Its level follows the sensors: while
  successive innovations of the angles are alike, the filter is too slow and the level rises, while they alternate it is too
  quick and it falls (Mehra 1970). A pump's pulses need no periodic part of their own: the process is as wide as they are.
- f also has a part that stays, Gauss-Markov of `STAY_TIME`, `STAYS` times as large as is usual: a load that is there from the
  first sample on, and the mean of a pump's pulses.
- a_i: by how much cylinder i is softer than the scene says, as a share of 1/k_i. A spring that is softer lengthens by
  F_i a_i / k_i more under the predicted force F_i, as if the stroke were longer; N_ij is the mode's force in it. F_i is
  its slow part, over `SLOW` seconds: the fast part holds the strokes' noise, which the IMU's residual holds as well, and a_i
  would be drawn to what explains noise by noise. While a boom moves that is behind by a share of a_i itself, which a_i may
  drift by within `SLOW`: else load and other shares would have to make up for it.
- b_s: likewise of section s's bending, as a share of 1/EI: B_js = sum of M_j M w / EI over its stations, M the predicted
  moment, slow likewise, M_j the mode's, w Simpson's weights.
- w: white, of the density that strokes' noise drives the mode with (`boom_twin.analysis.modal.StrokeNoise`).
- e (2), m/s^2: error of the predicted acceleration by errors of the strokes that are too short for any mode to follow,
  Gauss-Markov of time `JERK_TIME`: of cylinder i sum_j N_ij Phi_j times the deviation of its stroke.

Measured less predicted:

    angle_i   Theta_i q + what is quasi-static in a and b and in no mode
    force_i   N_i q, likewise
    IMU       Phi q'' + e, turned into the tip's axes, the specific force turned by the tip's own turn, and a bias of each axis

What a and b do at rest is known in closed form: a stroke turns its own joint only, bending turns none, and neither changes a
cylinder's force. The part of that which the few modes lack is added (static correction).

At rest a load that stays and softer cylinders look alike. Gaussian deviations as wide as a soft cylinder needs would always
take it for these, all of them a little softer at once; so what is told is a mixture over the causes: no cylinder is off by
more than a scene's error, or one of them is, or all. The filter itself knows the wide deviations only; what each cause makes
of its state is a reading of a_i = 0 on top, and the cause's chance is what that reading and its prior say (`weigh_causes`).

A section that sags turns the tip and no joint, and to an IMU that turn is a bias. As far as the biases are beyond doubt, the
stated covariance of the tip is wider: by the shares b, alike in all sections, that make such a turn.

The modes are made anew when the posture has changed; their motion of the tip follows the posture at every sample, for the
motions of the parts relative to one another stay, see `follow_posture`.

Sources: E. Lourens et al., Mech. Syst. Signal Process. 27 (2012), unknown forces as states; R. Mehra, IEEE Trans. Automat.
Control 15 (1970), 175-184.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.jit import by_reference, inner
from ..kernels.tables import FRAME_COS, FRAME_SIN, FRAME_X, FRAME_Y
from ..types import NANO, Array

MODES = 6  # at most
LOAD_RATE, JERK_TIME = 6.0, 0.02  # 1/s, s
SLOW = 0.5  # s, over which the forces and moments are taken that a and b are learnt from
BIAS_OFF, BIAS_DRIFT = 0.1, 0.001  # m/s^2, standard deviation of the IMU's bias, and of its change in a second
LEAST_ERROR = 0.02  # m/s^2, of the standard deviation of e
LEAST_LOAD, MOST_LOAD, USUAL_LOAD = range(3)  # of `loads`
STAYS, STAY_TIME = 2.0, 100.0  # standard deviation of the load that stays over the usual one; s
SCENE_ERROR = 0.02  # standard deviation of a of a cylinder that is as the scene says
ONE_SOFT, ALL_SOFT = 0.02, 0.005  # chances that one certain cylinder is not, and that none is
SOFT, SOFTENING = 0.5, 0.02  # standard deviation of a once anything is measured, and what is added to it in a second
AGILITY, RETREAT = 2.0, 0.03  # 1/s, by which the load's level follows the innovations; likeness of them at which it stays
UNLIKELY = 4.0  # innovations beyond so many deviations count less the larger they are: a spike moves little
ALIKE = 4.0  # most that one product of successive innovations counts
REMEMBERED = 2.0  # s, over which the mean square of the deviation is taken
BEYOND_DOUBT = 2.0  # standard deviations of the IMU's bias, beyond which it may be a sag that no angle shows
INEXACT = 0.05  # share of the deviation that modes and static corrections may be wrong by
LONGEST_STEP = 0.05  # s, of the covariance's differential equation
OLDEST = 0.25  # s, age of a sample that still counts

LOAD, LOAD_CHANGE, ERROR, BIAS, STAYING, SHARES = 0, 2, 4, 6, 8, 10
"""First places in the state: the load's x and y, their rates, e's x and y, biases of the IMU's x and z, the part of the load
that stays (x and y), the shares a (n,) and b (n,); then q_j and q_j' of every mode."""

WIDTH = 22
TIP, ACCELERATION, FORCE, TIP_COVARIANCE, ACCELERATION_COVARIANCE, FORCE_VARIANCE = 0, 3, 6, 8, 14, 20
"""First places in a row of an estimate: x, y, angle of the tip (3); their second derivatives (3); load (2); covariances of the
first two, upper triangles by rows (6 each); variances of the load (2). SI."""
VARIANCES = [0, 3, 5]
"""Places of the variances in such a triangle."""

COUNT, STARTED, FED, STAMP, ANGLES_STAMP = range(5)  # of `status`
ANGLE, FELT_X, FELT_Y, STEP = range(4)
"""Places in `now`: angle of the tip, rad; its predicted acceleration less gravity, m/s^2; time since the strokes before, s."""


@by_reference
class DeviationFilter(NamedTuple):
    """The filter as kernels take it; n joints, m modes at most, s states, c measured channels, f frames, k stations.

    status : (5,) number of modes; whether it has begun; whether anything was measured; stamps of the newest strokes and of the
    newest angles, ns.
    omega, decay, density : (m,) rad/s; 2 zeta omega, 1/s; of w, m^2 kg/s^3.
    relative : (f, m, 3) motion of every frame relative to the one before, in its axes: m, m, rad per unit of q.
    forces : (m, n) N per unit. bending : (m, k) M_j w / EI. sections : (k,) of the stations, 0-based.
    sections_off : (n,) standard deviation of b. softness, slopes : (n,) 1/k, m/N, 0 of a rigid cylinder; stroke over angle, m.
    roots : (n,) frames of the pivots. sensed, absolute : (n,) frames of the inclinometers, and which angle sensors are such.
    noise : (c,) variances of the sensors. masked : (c,) channels that are not to be used.
    tip : (m, 3), turns : (m, n), lever : (n, 3) at the newest posture: motion of the tip, of the angles, and of the
    tip by strokes.
    coupling : (m, 4 + 2 n) of f, a, b and the load that stays. drawn, ahead : (n,) F_i / k_i, m, slow; by which
    share the newest is more.
    variances : (n,) of the strokes' estimates, m^2. pushes : (2,) of e, (m/s^2)^2.
    x, p : state and covariance. row, gain, rows : (s,), (s,), (8, s) scratch.
    within, cross : (8, 8), (8, n) scratch, covariances of what the rows read with one another and with a.
    shifts : (8, n + 1) scratch, by how much the causes change what the rows read; that all are off changes nothing.
    inverse, healed, drag : (n, n), (8, n), (n,) scratch, B of `weigh_causes`, and B times `cross` and times the mean of a.
    chances : (n + 2,) of the causes: no cylinder is off, one of them is, all are.
    last : (c,) innovations. level : (1,) N.
    loads : (3,) least and largest level, and the usual one that it begins with, N.
    spread : (2, 2) mean square of the tip's x and y less the predicted ones lately, and the newest, with what is not known of
    it, m^2.
    now : (4,) see `ANGLE`.
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
    last: Array
    now: Array


@inner
def states_of(f):
    """Number of states: the first places, and those of the modes that there are."""
    return mode_place(f, f.status[COUNT])


@inner
def mode_place(f, j):
    """Place in the state of the coordinate of mode j; its rate is behind it."""
    return SHARES + 2 * f.softness.shape[0] + 2 * j


@inner
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
    f.level[0] = f.loads[USUAL_LOAD]
    for b in range(2):
        add_unknown(f, b, f.loads[USUAL_LOAD])
        add_unknown(f, 2 + 2 * n + b, STAYS * f.loads[USUAL_LOAD])
        f.p[LOAD_CHANGE + b, LOAD_CHANGE + b] = (LOAD_RATE * f.loads[USUAL_LOAD]) ** 2
        f.p[ERROR + b, ERROR + b] = f.pushes[b]
        f.p[BIAS + b, BIAS + b] = BIAS_OFF * BIAS_OFF
    for i in range(n):
        if f.softness[i] > 0.0:
            add_unknown(f, 2 + i, SCENE_ERROR)
        add_unknown(f, 2 + n + i, f.sections_off[i])
    for j in range(f.status[COUNT]):
        at = mode_place(f, j)
        swing = math.hypot(f.tip[j, 0], f.tip[j, 1]) * f.loads[USUAL_LOAD] / (f.omega[j] * f.omega[j])
        f.p[at, at] += swing * swing
        f.p[at + 1, at + 1] += (swing * f.omega[j]) ** 2
    f.status[STARTED] = 1


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
        f.variances[i] = estimates.variances[i]
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
    """Variances of the acceleration that errors of the strokes push the tip with."""
    f.pushes[0], f.pushes[1] = LEAST_ERROR * LEAST_ERROR, LEAST_ERROR * LEAST_ERROR
    for i in range(f.softness.shape[0]):
        x, y = 0.0, 0.0
        for j in range(f.status[COUNT]):
            x += f.forces[j, i] * f.tip[j, 0]
            y += f.forces[j, i] * f.tip[j, 1]
        f.pushes[0] += x * x * f.variances[i]
        f.pushes[1] += y * y * f.variances[i]


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
def step_state(f, h):
    """Mean and covariance h (s) later: half a step of the inputs, one of the modes under these, the other half (Strang).

    The covariance is symmetric, to the bit: of what changes, rows are computed and columns are copied. Along a row a processor
    takes four numbers at once.
    """
    size, inputs = states_of(f), f.coupling.shape[1]
    x, p, row = f.x, f.p, f.row
    step_inputs(f, 0.5 * h, size)
    for j in range(f.status[COUNT]):
        c, at = f.coupling[j], mode_place(f, j)
        a11, a12, a21, a22 = oscillate(f.omega[j], f.decay[j], h)
        g1, g2 = (1.0 - a11) / (f.omega[j] * f.omega[j]), -a21 / (f.omega[j] * f.omega[j])
        force = 0.0
        clear(row, size)
        for b in range(inputs):
            place = input_place(f, b)
            force += c[b] * x[place]
            add_row(row, c[b], p[place], size)
        x[at], x[at + 1] = a11 * x[at] + a12 * x[at + 1] + g1 * force, a21 * x[at] + a22 * x[at + 1] + g2 * force
        mix_rows(p[at], p[at + 1], a11, a12, a21, a22, f.gain, size)
        add_row(p[at], g1, row, size)
        add_row(p[at + 1], g2, row, size)
        by_q, by_rate = 0.0, 0.0
        for b in range(inputs):
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


@inner
def step_inputs(f, h, size):
    """Load and shares h (s) later."""
    for b in range(2):
        step_load(f, LOAD + b, LOAD_CHANGE + b, h, size)
        fade(f, STAYING + b, math.exp(-h / STAY_TIME), (STAYS * f.loads[USUAL_LOAD]) ** 2, size)
    for i in range(f.softness.shape[0]):
        if f.drawn[i] != 0.0:
            lag = f.x[SHARES + i] * f.ahead[i]
            f.p[SHARES + i, SHARES + i] += (SOFTENING * SOFTENING + lag * lag / SLOW) * h


@inner
def step_load(f, place, change, h, size):
    """A component of the load and its rate h (s) later, at these places: exact."""
    x, p, e, level2 = f.x, f.p, math.exp(-LOAD_RATE * h), f.level[0] * f.level[0]
    a11, a12, a21, a22 = e * (1.0 + LOAD_RATE * h), e * h, -e * LOAD_RATE * LOAD_RATE * h, e * (1.0 - LOAD_RATE * h)
    x[place], x[change] = a11 * x[place] + a12 * x[change], a21 * x[place] + a22 * x[change]
    mix_rows(p[place], p[change], a11, a12, a21, a22, f.gain, size)
    rate2 = LOAD_RATE * LOAD_RATE * level2  # at rest in itself, load and rate have these variances and no covariance
    load = a11 * p[place, place] + a12 * p[place, change] + level2 - a11 * a11 * level2 - a12 * a12 * rate2
    both = a21 * p[place, place] + a22 * p[place, change] - a11 * a21 * level2 - a12 * a22 * rate2
    rate = a21 * p[change, place] + a22 * p[change, change] + rate2 - a21 * a21 * level2 - a22 * a22 * rate2
    copy_columns(p, place, size)
    copy_columns(p, change, size)
    p[place, place], p[place, change], p[change, place], p[change, change] = load, both, both, rate


@inner
def input_place(f, b):
    """Place in the state of an input of the modes: of the load the first two, then the shares, then the load that stays."""
    shares = 2 * f.softness.shape[0]
    if b < 2:
        return LOAD + b
    return SHARES + b - 2 if b < 2 + shares else STAYING + b - 2 - shares


@inner
def fade(f, place, kept, variance, size):
    """A step of the Gauss-Markov process at `place`, of this variance."""
    f.x[place] *= kept
    row = f.p[place]
    for k in range(size):
        row[k] *= kept
    row[place] = kept * row[place] + variance * (1.0 - kept * kept)
    copy_columns(f.p, place, size)


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


# -- rows of what is read ------------------------------------------------------------------------------------------------


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
            if not f.absolute[i]:
                row[SHARES + n + k] -= still * f.coupling[j, 2 + n + k]
    return variance


@inner
def read_force(f, i, row):
    """Row of a cylinder's force, which no share changes at rest."""
    n, size = f.softness.shape[0], states_of(f)
    clear(row, size)
    for j in range(f.status[COUNT]):
        at, still = mode_place(f, j), f.forces[j, i] / (f.omega[j] * f.omega[j])
        row[at] = f.forces[j, i]
        for k in range(2 * n):
            row[SHARES + k] -= still * f.coupling[j, 2 + k]


@inner
def read_acceleration(f, x, y, turn, turned, row):
    """Row of the tip's acceleration along (x, y), `turn` times its angular one and `turned` times its turn beside."""
    size = states_of(f)
    clear(row, size)
    row[ERROR], row[ERROR + 1] = x, y
    for j in range(f.status[COUNT]):
        at = mode_place(f, j)
        along = x * f.tip[j, 0] + y * f.tip[j, 1] + turn * f.tip[j, 2]
        row[at] = -f.omega[j] * f.omega[j] * along + turned * f.tip[j, 2]
        row[at + 1] = -f.decay[j] * along
        for b in range(f.coupling.shape[1]):
            row[input_place(f, b)] += along * f.coupling[j, b]


@inner
def clear(row, size):
    """No reading of anything."""
    for k in range(size):
        row[k] = 0.0


# -- measurements --------------------------------------------------------------------------------------------------------


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
    alike, count = 0.0, 0
    for i in range(f.softness.shape[0]):
        if usable(f, first + i, residuals[i]):
            variance = f.noise[first + i] + read_angle(f, i, f.row)
            alike += correct(f, first + i, residuals[i], variance, age)
            count += 1
    if count > 0 and stamp > f.status[ANGLES_STAMP]:
        h = min((stamp - f.status[ANGLES_STAMP]) * NANO, LONGEST_STEP)
        level = f.level[0] * math.exp(AGILITY * h * (alike / math.sqrt(count) - RETREAT))
        f.level[0] = min(max(level, f.loads[LEAST_LOAD]), f.loads[MOST_LOAD])
        f.status[ANGLES_STAMP] = stamp


@inner
def take_imu(f, residuals, first, stamp):
    """Likewise of the tip IMU's x and z, m/s^2."""
    age = age_of(f, stamp)
    if age > OLDEST:
        return
    c, s = math.cos(f.now[ANGLE]), math.sin(f.now[ANGLE])
    if usable(f, first, residuals[0]):
        read_acceleration(f, c, s, 0.0, c * f.now[FELT_Y] - s * f.now[FELT_X], f.row)
        f.row[BIAS] = 1.0
        correct(f, first, residuals[0], f.noise[first], age)
    if usable(f, first + 1, residuals[1]):
        read_acceleration(f, -s, c, 0.0, -c * f.now[FELT_X] - s * f.now[FELT_Y], f.row)
        f.row[BIAS + 1] = 1.0
        correct(f, first + 1, residuals[1], f.noise[first + 1], age)


@inner
def take_forces(f, residuals, first, stamp):
    """Likewise of the cylinder forces, N."""
    age = age_of(f, stamp)
    if age > OLDEST:
        return
    for i in range(f.softness.shape[0]):
        if usable(f, first + i, residuals[i]):
            read_force(f, i, f.row)
            correct(f, first + i, residuals[i], f.noise[first + i], age)


@inner
def usable(f, channel, residual):
    """Whether a reading may be used."""
    return math.isfinite(residual) and not f.masked[channel]


@inner
def correct(f, channel, residual, variance, age):
    """Correct the state by one reading that is read by `f.row`; gives the product of its innovation with the one before."""
    size = states_of(f)
    x, p, row, gain = f.x, f.p, f.row, f.gain
    if age > 0.0:
        for j in range(f.status[COUNT]):
            at = mode_place(f, j)
            a11, a12, a21, a22 = oscillate(f.omega[j], f.decay[j], -age)
            row[at], row[at + 1] = row[at] * a11 + row[at + 1] * a21, row[at] * a12 + row[at + 1] * a22
    covary(p, row, gain, size)
    spread, off = variance, residual
    for k in range(size):
        spread += row[k] * gain[k]
        off -= row[k] * x[k]
    innovation = off / math.sqrt(spread)
    alike = min(max(innovation * f.last[channel], -ALIKE), ALIKE)
    f.last[channel] = innovation
    if abs(innovation) > UNLIKELY:
        spread *= (innovation / UNLIKELY) ** 2
    deviation = math.sqrt(spread)
    for k in range(size):
        gain[k] /= deviation
    add_row(x, off / deviation, gain, size)
    for k in range(size):
        add_row(p[k], -gain[k], gain, size)
    return alike


# -- results -------------------------------------------------------------------------------------------------------------


@inner
def write_estimate(f, results, out):
    """Write the estimate at the newest prediction: see `WIDTH`.

    Errors of the strokes are in the covariance of the modes, by w: what a stroke does to the tip is the sum over the modes.
    """
    size = states_of(f)
    for a in range(3):
        read_tip(f, a, f.rows[a])
        out[TIP + a], out[ACCELERATION + a] = results.tip[0, a], results.tip[2, a]
    read_acceleration(f, 1.0, 0.0, 0.0, 0.0, f.rows[3])
    read_acceleration(f, 0.0, 1.0, 0.0, 0.0, f.rows[4])
    read_acceleration(f, 0.0, 0.0, 1.0, 0.0, f.rows[5])
    for a in range(2):
        clear(f.rows[6 + a], size)
        f.rows[6 + a, LOAD + a], f.rows[6 + a, STAYING + a], out[FORCE + a] = 1.0, 1.0, 0.0
    weigh_causes(f)
    read_covariances(f, size)
    write_covariance(f, 0, out[TIP_COVARIANCE:ACCELERATION_COVARIANCE])
    write_covariance(f, 3, out[ACCELERATION_COVARIANCE:FORCE_VARIANCE])
    for a in range(2):
        out[FORCE_VARIANCE + a] = covariance_of(f, 6 + a, 6 + a)
    for a in range(8):
        place = (TIP if a < 3 else ACCELERATION - 3 if a < 6 else FORCE - 6) + a
        out[place] += mean_of(f, a, size)
    at = TIP_COVARIANCE
    for a in range(3):
        out[at] += (INEXACT * (out[TIP + a] - results.tip[0, a])) ** 2
        at += 3 - a
    add_sag(f, out)
    write_spread(f, results, out)


@inner
def weigh_causes(f):
    """Chances of the causes, and what a reading of a = 0 of all cylinders would change: `inverse`, `drag`.

    With P the covariance of the shares a, m their mean, R the square of `SCENE_ERROR` and W the wide variance that the filter
    began with, a cause under which the cylinders K are as the scene says has the chance N(0; m_K, P_KK + R) / N(0; 0, W + R)
    times its prior. Of K without one cylinder all follows from the inverse B of P + R: B_ii of that one is all it takes.
    """
    n, wide = f.softness.shape[0], SOFT * SOFT + 2.0 * SCENE_ERROR * SCENE_ERROR
    size2 = SCENE_ERROR * SCENE_ERROR
    f.chances[:] = 0.0
    f.chances[n + 1] = 1.0
    if f.status[FED] == 0:
        return
    b = f.inverse
    for i in range(n):
        for k in range(n):
            b[i, k] = f.p[SHARES + i, SHARES + k]
        b[i, i] += size2
    doubt = invert(b)
    if not math.isfinite(doubt):
        return
    free, cost = 0, 0.0
    for i in range(n):
        f.drag[i] = 0.0
        for k in range(n):
            f.drag[i] += b[i, k] * f.x[SHARES + k]
    for i in range(n):
        cost += f.drag[i] * f.x[SHARES + i]
        free += 1 if f.softness[i] > 0.0 else 0
    wide_log = math.log(wide)
    rigid = (n - free) * math.log(size2)
    healthy = 0.5 * (free * wide_log + rigid - doubt - cost) + math.log(1.0 - free * min(ONE_SOFT, 0.5 / n) - ALL_SOFT)
    f.chances[0] = healthy
    f.chances[n + 1] = math.log(ALL_SOFT)
    most = max(healthy, f.chances[n + 1])
    for i in range(n):
        f.chances[1 + i] = -math.inf
        if f.softness[i] > 0.0:
            own = 0.5 * (f.drag[i] * f.drag[i] / b[i, i] - math.log(b[i, i]) - wide_log)
            f.chances[1 + i] = 0.5 * (free * wide_log + rigid - doubt - cost) + own + math.log(min(ONE_SOFT, 0.5 / n))
            most = max(most, f.chances[1 + i])
    total = 0.0
    for i in range(n + 2):
        f.chances[i] = math.exp(f.chances[i] - most)
        total += f.chances[i]
    for i in range(n + 2):
        f.chances[i] /= total


@inner
def invert(b):
    """A symmetric positive definite matrix becomes its inverse, by Gauss-Jordan; gives the logarithm of its determinant."""
    n, log = b.shape[0], 0.0
    for k in range(n):
        pivot = b[k, k]
        if not pivot > 0.0:
            return math.nan
        log += math.log(pivot)
        b[k, k] = 1.0
        for j in range(n):
            b[k, j] /= pivot
        for i in range(n):
            if i != k:
                factor = b[i, k]
                b[i, k] = 0.0
                for j in range(n):
                    b[i, j] -= factor * b[k, j]
    return log


@inner
def shift_by(f, a, cause):
    """By how much a cause (0 none, i cylinder i) changes what row a reads."""
    n, shift = f.softness.shape[0], 0.0
    for i in range(n):
        shift -= f.cross[a, i] * f.drag[i]
    if cause > 0:
        shift += f.healed[a, cause - 1] * f.drag[cause - 1] / f.inverse[cause - 1, cause - 1]
    return shift


@inner
def mean_of(f, a, size):
    """What row a reads, by the chances of the causes."""
    total = 0.0
    for k in range(size):
        total += f.rows[a, k] * f.x[k]
    for cause in range(f.softness.shape[0] + 1):
        if f.chances[cause] > 0.0:
            total += f.chances[cause] * f.shifts[a, cause]
    return total


@inner
def unexplained_turn2(f):
    """Square of the turn of the tip (rad) that the IMU's biases would be, as far as it is beyond doubt.

    A bias of the two axes and a turn of gravity in them are the same to the filter, and no angle shows a section that sags.
    """
    c, s = math.cos(f.now[ANGLE]), math.sin(f.now[ANGLE])
    x, z = c * f.now[FELT_Y] - s * f.now[FELT_X], -c * f.now[FELT_X] - s * f.now[FELT_Y]
    felt2 = x * x + z * z
    if felt2 == 0.0:
        return 0.0
    turn = (x * f.x[BIAS] + z * f.x[BIAS + 1]) / felt2
    variance = x * x * f.p[BIAS, BIAS] + 2.0 * x * z * f.p[BIAS, BIAS + 1] + z * z * f.p[BIAS + 1, BIAS + 1]
    return max(turn * turn - BEYOND_DOUBT * BEYOND_DOUBT * variance / (felt2 * felt2), 0.0)


@inner
def add_sag(f, out):
    """Add to the tip's covariance what it is off by if the sections, each as likely as another, sag to the turn unexplained."""
    turn2, n, all2 = unexplained_turn2(f), f.softness.shape[0], 0.0
    if turn2 == 0.0:
        return
    sag = f.rows[0]  # no longer needed
    clear(sag, 6)
    for i in range(n):
        x, y, turn = 0.0, 0.0, 0.0
        for j in range(f.status[COUNT]):
            still = f.coupling[j, 2 + n + i] / (f.omega[j] * f.omega[j])
            x, y, turn = x + still * f.tip[j, 0], y + still * f.tip[j, 1], turn + still * f.tip[j, 2]
        all2 += turn * turn
        sag[0], sag[1], sag[2] = sag[0] + x * x, sag[1] + x * y, sag[2] + x * turn
        sag[3], sag[4], sag[5] = sag[3] + y * y, sag[4] + y * turn, sag[5] + turn * turn
    if all2 > 0.0:
        for k in range(6):
            out[TIP_COVARIANCE + k] += sag[k] * turn2 / all2


@inner
def write_spread(f, results, out):
    """Note how far off the predicted tip is."""
    kept = math.exp(-min(max(f.now[STEP], 0.0) / REMEMBERED, 50.0))
    for a in range(2):
        off = out[TIP + a] - results.tip[0, a]
        f.spread[1, a] = off * off + out[TIP_COVARIANCE + 3 * a]
        f.spread[0, a] = f.spread[1, a] + kept * (f.spread[0, a] - f.spread[1, a])


@inner
def read_covariances(f, size):
    """Of every row its covariance with the rows of its own three or two and with the shares, before causes are weighed."""
    n = f.softness.shape[0]
    for a in range(8):
        covary(f.p, f.rows[a], f.gain, size)
        for b in range(a, min(a - a % 3 + 3, 8)):
            total = 0.0
            for k in range(size):
                total += f.rows[b, k] * f.gain[k]
            f.within[a, b] = total
        for i in range(n):
            f.cross[a, i] = f.gain[SHARES + i]
        for i in range(n):
            total = 0.0
            for k in range(n):
                total += f.inverse[i, k] * f.cross[a, k]
            f.healed[a, i] = total
        for cause in range(n + 1):
            f.shifts[a, cause] = shift_by(f, a, cause)


@inner
def covariance_of(f, a, b):
    """Of what two rows read: that within each cause, and that of the causes' means."""
    n, total, shift_a, shift_b = f.softness.shape[0], f.within[a, b], 0.0, 0.0
    for i in range(n):
        total -= (1.0 - f.chances[n + 1]) * f.cross[a, i] * f.healed[b, i]
    for cause in range(n + 1):
        chance = f.chances[cause]
        if chance > 0.0:
            one, other = f.shifts[a, cause], f.shifts[b, cause]
            total += chance * one * other
            shift_a, shift_b = shift_a + chance * one, shift_b + chance * other
            if cause > 0:
                total += chance * f.healed[a, cause - 1] * f.healed[b, cause - 1] / f.inverse[cause - 1, cause - 1]
    return total - shift_a * shift_b


@inner
def write_covariance(f, first, out):
    """Upper triangle of the covariance of three rows."""
    at = 0
    for a in range(first, first + 3):
        for b in range(a, first + 3):
            out[at] = covariance_of(f, a, b)
            at += 1
