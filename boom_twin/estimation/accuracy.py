"""Which accuracy of the tip which sensors give at a posture at rest: the estimate's covariance, once it has settled.

The filter of `boom_twin.estimation.tip_estimate` is run over sensors that read what is predicted, from nothing known until its
covariance changes no more; a load of the usual level acts that the model does not know. A Kalman filter's covariance does
not depend on what is measured, but the chances of its causes do: so angles have noise, and what is stated is averaged.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..analysis.equilibrium import settle
from ..analysis.modal import StrokeSpectrum, stroke_noise
from ..compiler.plan import first_row
from ..config.settings import Settings
from ..kernels.jit import kernel
from ..kernels.result_row import estimates_in, results_in
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.schema import Scene
from ..types import SECOND, SENSORS, Array, Mount, Stream
from .boom_predictor import BoomPredictor
from .deviation_filter import USUAL_LOAD
from .deviation_modes import DeviationModes
from .deviation_readings import take_angles, take_forces, take_imu
from .deviation_step import advance_estimate
from .stroke_filter import corners
from .tip_estimate import ACCELERATION_COVARIANCE, FORCE_VARIANCE, TIP_COVARIANCE, VARIANCES, WIDTH, write_estimate

SETTLED, AVERAGED = 20.0, 20.0  # s, and s behind it over which the variances that are stated are averaged
OFTEN = 20  # samples from one that is averaged to the next
SHARE = 2.0  # of the variance of an integrated white jerk filtered at omega_c: P = 2 omega_c T r while omega_c T is small


class TipAccuracy(NamedTuple):
    """Standard deviations of the estimate: tip's x, y (m) and angle (rad), acceleration (m/s^2), load (N); (3,), (2,), (2,)."""

    tip: Array
    acceleration: Array
    load: Array


def accuracy_at(
    scene: Scene,
    strokes: Array,
    sensors: Sequence[Stream],
    settings: Settings | None = None,
    mounts: Sequence[Mount | None] = (),
    rate: float = 200.0,
) -> TipAccuracy:
    """What the estimate is accurate to at rest.

    Parameters
    ----------
    scene : Scene
        With its load.
    strokes : ndarray, shape (n,)
        m.
    sensors : sequence of Stream
        Beside the strokes; one that is named twice is there twice.
    rate : float
        Of all of them, Hz.

    Returns
    -------
    TipAccuracy
        What is stated after `SETTLED` s, on the mean over `AVERAGED`.

    Raises
    ------
    UsageError, SolverError
        Strokes out of reach; no equilibrium there.
    """
    settings, boom = settings or Settings(), BoomPredictor(scene)
    plan, work, live = boom.plan, boom.compiled.work, boom.live
    modes = DeviationModes(scene, plan, settings, mounts)
    angles = joint_angles_of_strokes(scene, strokes)
    settle(plan, live, work, strokes, angles)
    quietest = corners(settings.stroke_variance, 1.0 / rate, settings.stroke_agility)
    at_rest = np.tile(np.eye(len(quietest))[0], (plan.joints, 1))  # the quietest smoother of every stroke
    spectrum = StrokeSpectrum(settings.stroke_variance, 1.0 / rate, quietest, at_rest, np.zeros(plan.joints))
    noise = stroke_noise(plan, live, work, spectrum)
    modes.begin()
    modes.refresh(strokes, angles, live, noise)
    row, results = boom.compiled.row, first_row(plan, live)
    row[:] = 0.0
    row[: len(results)] = results
    boom.variances[:] = SHARE * settings.stroke_variance * quietest[0] / rate
    moments, out = boom.compiled.bending @ live.z, np.zeros(WIDTH)
    counts = np.array([sum(each is stream for each in sensors) for stream in SENSORS])
    size = np.array([plan.joints, len(plan.pins)])
    gravity, zeros = np.array(plan.tables.gravity), np.zeros(max(plan.joints, 2))
    settled, all_steps = round(SETTLED * rate), round((SETTLED + AVERAGED) * rate)
    errors = math.sqrt(settings.angle_variance) * np.random.default_rng(1).normal(size=(all_steps, counts[1], plan.joints))
    told, done, span = [], 0, round(SECOND / rate)
    for until in range(settled, all_steps + 1, OFTEN):
        run_covariance(
            modes.filter, live, row, size, moments, gravity, counts, done * span, span, errors[done:until], zeros, out
        )
        told.append(out.copy())
        done = until
    out = np.mean(told, axis=0)
    tip, acceleration = (out[first + np.array(VARIANCES)] for first in (TIP_COVARIANCE, ACCELERATION_COVARIANCE))
    return TipAccuracy(np.sqrt(tip), np.sqrt(acceleration[:2]), np.sqrt(out[FORCE_VARIANCE:]))


@kernel
def run_covariance(f, live, row, size, moments, gravity, counts, stamp, span, errors, zeros, out):
    """Run the filter at rest, `counts` (streams,) sensors of each stream reading what is predicted every `span` ns.

    It stood at `stamp`. Angles read it with `errors` (steps, sensors, n), rad. The estimate is that at the last strokes, before
    the readings of their stamp, as a twin's.
    """
    results, estimates = results_in(row, size[0], size[1]), estimates_in(row, size[0], size[1])
    for k in range(errors.shape[0]):
        stamp += span
        advance_estimate(f, live, results, estimates, moments, gravity, stamp)
        if k == errors.shape[0] - 1:
            write_estimate(f, results, out)
        for i in range(counts[1]):
            take_angles(f, errors[k, i], 0, stamp)
        for _ in range(counts[2]):
            take_imu(f, zeros, size[0], stamp)
        for _ in range(counts[3]):
            take_forces(f, zeros, size[0] + 2, stamp)
        f.level[:] = f.loads[USUAL_LOAD]  # readings without noise would let it fall
