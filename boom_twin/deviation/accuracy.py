"""Accuracy of the tip that a set of sensors gives at rest: the covariance of the estimate, once it has settled.

The filter of `boom_twin.deviation.models` runs over sensors that read what is predicted, while the size of the unknown load is
held. A covariance does not depend on what is measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..analysis.equilibrium import statics
from ..config.settings import Settings
from ..kernels.jit import kernel
from ..kernels.result_row import results_in
from ..scene.schema import Scene
from ..types import NO_PLACES, SECOND, SENSORS, Array, Place, Stream, StrokeReading
from .estimate_row import ACCELERATION_COVARIANCE, FORCE_VARIANCE, TIP_COVARIANCE, VARIANCES, WIDTH
from .predictor import BoomPredictor
from .sensors import take_sensor
from .step import step_lengths
from .tip_estimate import write_tip_estimate

SETTLED = 20.0  # s
RATE, POINT_RATE = 200.0, 1.0  # Hz, of all sensors but a total station


class TipAccuracy(NamedTuple):
    """Standard deviations of the estimate: tip's x, y (m) and angle (rad), acceleration (m/s^2), load (N); (3,), (2,), (2,)."""

    tip: Array
    acceleration: Array
    load: Array


def accuracy_at(
    scene: Scene,
    drives: Array,
    sensors: Sequence[Stream],
    settings: Settings | None = None,
    reads: StrokeReading = StrokeReading.LENGTH,
    places: Mapping[str, Place] = NO_PLACES,
) -> TipAccuracy:
    """Return the accuracy of the estimate at rest, `SETTLED` s after nothing was known.

    Parameters
    ----------
    scene : Scene
        With its load.
    drives : ndarray, shape (n,)
        Strokes of the drives, m.
    sensors : sequence of Stream
        Beside what drives the model; one that is named twice is there twice. All read at `RATE`, points at `POINT_RATE`.
    reads : StrokeReading
        What drives the model.
    places : mapping of str to Place
        See `boom_twin.deviation.predictor.BoomPredictor`.

    Raises
    ------
    UsageError, SolverError
        Strokes out of reach; no equilibrium there.
    """
    boom = BoomPredictor(scene, settings or Settings(), (), reads, places)
    driving = boom.finder.readings_at(statics(scene, drives).lengths)
    boom.start(driving)
    widths = [len(names) for stream, names in boom.channels.items() if stream is not Stream.STROKES]
    counts = np.array([sum(each is stream for each in sensors) for stream in Stream])
    counts[list(Stream).index(Stream.MOMENTS)] = min(1, sum(each is Stream.MOMENTS for each in sensors))  # all at once
    every = np.array([round(RATE / POINT_RATE) if SENSORS[stream].field == "point" else 1 for stream in Stream])
    first, zeros, out = np.cumsum([0, 0, *widths]), np.zeros(max(widths)), np.zeros(WIDTH)
    tables, anchor, live, work, posture, filters, _, row = boom.compiled
    filters.load2[:] = filters.noise.usual_load**2
    span, steps, gravity = round(SECOND / RATE), round(SETTLED * RATE), np.array(boom.plan.tables.gravity)
    settle_covariance(
        tables, anchor, live, work, posture, filters, row, driving, gravity, counts, every, first, zeros, span, steps, out
    )
    tip, acceleration = (out[first + np.array(VARIANCES)] for first in (TIP_COVARIANCE, ACCELERATION_COVARIANCE))
    return TipAccuracy(np.sqrt(tip), np.sqrt(acceleration[:2]), np.sqrt(out[FORCE_VARIANCE:]))


@kernel
def settle_covariance(t, boom, live, work, p, f, row, lengths, gravity, counts, every, first, zeros, span, steps, out):
    """Run the filter at rest for `steps` of `span` ns and write the estimate at the last one.

    `counts`, `every` and `first` (streams,): how many sensors each stream has, steps from one reading to the next, and its
    first channel. Their residuals are `zeros`.
    """
    usual2 = f.load2[0, 0]
    results = results_in(row, lengths.shape[0], t.clearances.shape[0])
    for k in range(steps):
        stamp = k * span
        step_lengths(t, boom, live, work, p, f, 1e-9 * span if k > 0 else 0.0, stamp, lengths, gravity, row)
        for stream in range(1, counts.shape[0]):
            for _ in range(counts[stream] if k % every[stream] == 0 else 0):
                take_sensor(p, f, stream, first[stream], zeros, stamp, stamp)
        write_tip_estimate(p, f, live, results, out)
        f.load2[:] = usual2  # readings without noise would let it fall
