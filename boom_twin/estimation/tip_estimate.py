"""Kalman filter of how the boom deviates from its prediction: the tip as all sensors see it, and the unknown load there.

The prediction is a function of the strokes alone. What it lacks, by load or by parameters that are off, is a small motion
about it, in the natural modes j of the present posture (coordinates q_j, unit modal mass):

    q_j'' + 2 zeta_j omega_j q_j' + omega_j^2 q_j = Phi_j^T f + sum_i N_ij (F_i / k_i) a_i + w_j

- f (2), N: force at the tip that the model does not know, a Gauss-Markov process of second order with the rates `SLOWEST`, as
  pulses of 0.2 to 0.6 Hz lose their likeness, and `QUICKEST`, as their flanks of 0.1 s rise; its rate is a state too: what
  shakes a boom has no corners, and a process of first order states twice the error of the acceleration that there is. Phi_j is
  the mode's motion of the tip, 1/sqrt(kg). The level of each component follows the innovations of angles and IMU, see
  `boom_twin.estimation.load_level` (Mehra 1970).
- f also has a part that stays, Gauss-Markov of `STAY_TIME`, `STAYS` times as large as is usual: a load that is there from the
  first sample on, and the mean of a pump's pulses.
- a_i: by how much cylinder i is softer than the scene says, as a share of 1/k_i. A spring that is softer lengthens by
  F_i a_i / k_i more under the predicted force F_i, as if the stroke were longer; N_ij is the mode's force in it. F_i is
  its slow part, over `SLOW` seconds: the fast part holds the strokes' noise, which the IMU's residual holds as well, and a_i
  would be drawn to what explains noise by noise. While a boom moves that is behind by a share of a_i itself, which a_i may
  drift by within `SLOW`: else load and other shares would have to make up for it.
- b_s: likewise of section s's bending, as a share of 1/EI: B_js = sum of M_j M w / EI over its stations, M the predicted
  moment, slow likewise, M_j the mode's, w Simpson's weights. What it sags, sum_j Phi_j B_js / omega_j^2 of its share, follows
  the moments at once and is no part of q: as an input of the modes it would have to wait for them where the posture changes,
  and angles, which show no sag, would be taken to contradict it.
- w: white, of the density that strokes' noise drives the mode with (`boom_twin.analysis.modal.StrokeNoise`).
- e (2), m/s^2: error of the predicted acceleration by errors of the strokes that are too short for any mode to follow,
  Gauss-Markov of time `JERK_TIME`: of cylinder i sum_j N_ij Phi_j, of each mode the share that it does not follow, times the
  deviation of its stroke (`boom_twin.estimation.deviation_step.follow_errors`); and by `INEXACT_MOTION`
  of the predicted acceleration itself, which smoothers, steps and the modes left out are off by in haste.

Measured less predicted:

    angle_i   Theta_i q + what is quasi-static in a and in no mode; of an inclinometer, the sag inboard of it
    force_i   N_i q, likewise, and an offset o_i
    IMU       Phi q'' + e, turned into the tip's axes, the specific force turned by the tip's own turn and by the angle that
              the IMU is mounted askew by, a share of it by the IMU's scale, and a bias of each axis

- o_i, N, a random walk once forces are measured: by what a model whose masses are not exact, friction and the sensor's own zero
  and scale put a force off, and by what this changes as the boom moves: `FORCE_DRIFT` of the force in a second. So forces
  tell what is quick, a load's pulses, and not where the boom hangs: as exact readings, one that was 10 % too large was
  explained by a load and softer cylinders and put the tip off by 114 mm. It is no share of the predicted force, whose
  quick part holds the strokes' noise as the residual does: a share would be drawn to what explains noise by noise.

What a does at rest is known in closed form: a stroke turns its own joint only and changes no cylinder's force. The part of
that which the few modes lack is added (static correction). Bending turns no joint and changes no force.

At rest a load that stays and softer cylinders look alike. Gaussian deviations as wide as a soft cylinder needs would always
take it for these, all of them a little softer at once; so what is told is a mixture over the causes: no cylinder is off by
more than a scene's error, or one of them is, or all. How large a scene's error is nobody tells: it fits its boom exactly, or
roughly (`SCENE_ERRORS`), the one as likely as the other before anything is measured. Four angles tell more than a load of two
components can make of them; while that agrees with the scene, the exact cause gains, and a load is told from softness. The
filter itself knows the wide deviations only; what each cause makes of its state is a reading of a_i = 0 on top, and the
cause's chance is what that reading and its prior say (`weigh_causes`). Sections have no such causes: no sensor tells whether
they bend as the scene says, and cylinders that do so tell nothing of them.

A section that sags turns the tip and no joint, and to an IMU that turn is one of its mount. As far as that is beyond doubt, the
stated covariance of the tip is wider: by the shares b, alike in all sections, that make such a turn.

The modes are made anew when the posture has changed; their motion of the tip follows the posture at every sample, for the
motions of the parts relative to one another stay, see `follow_posture`.

Its state is in `deviation_filter`, its step in `deviation_step`, measurements in `deviation_readings`, the mixture in
`cause_mixture`; here is what is told of it.

Sources: E. Lourens et al., Mech. Syst. Signal Process. 27 (2012), unknown forces as states; R. Mehra, IEEE Trans. Automat.
Control 15 (1970), 175-184.
"""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel
from .cause_mixture import chance_of_soft, covariance_of, mean_of, read_covariances, weigh_causes, write_covariance
from .deviation_filter import ANGLE, BIAS, COUNT, FELT_X, FELT_Y, LOAD, SHARES, STAYING, STEP, clear, states_of
from .deviation_readings import read_acceleration, read_tip

REMEMBERED = 2.0  # s, over which the mean square of the deviation is taken
BEYOND_DOUBT = 2.0  # standard deviations of the IMU's turn, beyond which it may be a sag that no angle shows
INEXACT = 0.02  # share of the deviation that modes and static corrections may be wrong by: 1.8 % of a load's, of statics
SOFT_INEXACT = 0.05  # the same where a cylinder is softer: modes are then others

WIDTH = 22
TIP, ACCELERATION, FORCE, TIP_COVARIANCE, ACCELERATION_COVARIANCE, FORCE_VARIANCE = 0, 3, 6, 8, 14, 20
"""First places in a row of an estimate: x, y, angle of the tip (3); their second derivatives (3); load (2); covariances of the
first two, upper triangles by rows (6 each); variances of the load (2). SI."""
VARIANCES = [0, 3, 5]  # places of the variances in such a triangle


@kernel
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
    at, soft = TIP_COVARIANCE, chance_of_soft(f)
    inexact2 = soft * SOFT_INEXACT * SOFT_INEXACT + (1.0 - soft) * INEXACT * INEXACT
    for a in range(3):
        out[at] += inexact2 * (out[TIP + a] - results.tip[0, a]) ** 2
        at += 3 - a
    for i in range(f.softness.shape[0]):  # a joint that turns far moves the tip towards it, by second order
        bent = 0.5 * (f.x[SHARES + i] * f.drawn[i]) ** 2 / f.slopes[i]
        out[TIP_COVARIANCE] += (bent * f.lever[i, 1]) ** 2
        out[TIP_COVARIANCE + 3] += (bent * f.lever[i, 0]) ** 2
    add_sag(f, out)
    write_spread(f, results, out)


@inner
def unexplained_turn2(f):
    """Return the square of the turn of the tip (rad) that the IMU's mount and biases would be, as far as it is beyond doubt.

    They and a turn of gravity in the axes are the same to the filter, and no angle shows a section that sags.
    """
    c, s = math.cos(f.now[ANGLE]), math.sin(f.now[ANGLE])
    x, z = c * f.now[FELT_Y] - s * f.now[FELT_X], -c * f.now[FELT_X] - s * f.now[FELT_Y]
    felt2 = x * x + z * z
    if felt2 == 0.0:
        return 0.0
    row = x / felt2, z / felt2, 1.0  # of the biases and the mounting angle
    turn, variance = 0.0, 0.0
    for k in range(3):
        turn += row[k] * f.x[BIAS + k]
        for i in range(3):
            variance += row[k] * row[i] * f.p[BIAS + k, BIAS + i]
    return max(turn * turn - BEYOND_DOUBT * BEYOND_DOUBT * variance, 0.0)


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
