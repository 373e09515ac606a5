"""What the compiled update found, as the health monitor takes it, compiled: predictions, residuals of each stream."""

from __future__ import annotations

from ..kernels.jit import kernel
from ..kernels.result_row import estimates_in, results_in


@kernel
def copy_predictions(found, first, pins, stamps, measured, strokes, variances, joints, accelerations):
    """Copy predictions from row `first` on, of a boom with so many `pins` with clearance, as many as there is room for.

    Parameters
    ----------
    found : UpdateOutput
    stamps, measured, strokes, variances, joints, accelerations : ndarray
        Written; see `boom_twin.health.inference.block_problem.PredictionRows`.
    """
    n = measured.shape[1]
    for k in range(stamps.shape[0]):
        at = first + k
        results, estimates = results_in(found.rows[at], n, pins), estimates_in(found.rows[at], n, pins)
        stamps[k] = found.stamps[at]
        for i in range(n):
            measured[k, i], joints[k, i] = found.measured[at, i], results.joints[i]
            strokes[k, i], variances[k, i] = estimates.strokes[i], estimates.variances[i]
        accelerations[k, 0], accelerations[k, 1] = results.tip[2, 0], results.tip[2, 1]


@kernel
def count_residuals(found, first, last, counts):
    """Write how many residuals of each stream are from row `first` to `last` - 1, see `boom_twin.twin.blocks.CODES`."""
    counts[:] = 0
    for k in range(first, last):
        counts[found.residual_streams[k]] += 1


@kernel
def copy_residuals(found, first, last, stream, stamps, raw, left):
    """Copy the residuals of one stream from row `first` to `last` - 1.

    Parameters
    ----------
    found : UpdateOutput
    stream : int
        By `boom_twin.twin.blocks.CODES`.
    stamps, raw, left : ndarray
        Written, with room for all of them; see `boom_twin.health.inference.block_problem.MeasuredRows`.
    """
    count = 0
    for k in range(first, last):
        if found.residual_streams[k] == stream:
            stamps[count] = found.residual_stamps[k]
            for i in range(raw.shape[1]):
                raw[count, i], left[count, i] = found.raw[k, i], found.values[k, i]
            count += 1
