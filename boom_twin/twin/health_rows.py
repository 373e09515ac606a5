"""Compiled copies of predictions and of each stream's residuals from the compiled update for the health monitor."""

from __future__ import annotations

from ..kernels.jit import kernel
from ..kernels.result_row import estimates_in


@kernel
def copy_predictions(found, first, pins, stamps, measured, variances):
    """Copy predictions from row `first` on, of a boom with so many `pins` with clearance, as many as there is room for.

    Parameters
    ----------
    found : UpdateOutput
    stamps, measured, variances : ndarray
        Written; see `boom_twin.health.blocks.PredictionRows`.
    """
    n = measured.shape[1]
    for k in range(stamps.shape[0]):
        at = first + k
        estimates = estimates_in(found.rows[at], n, pins)
        stamps[k] = found.stamps[at]
        for i in range(n):
            measured[k, i], variances[k, i] = found.measured[at, i], estimates.variances[i]


@kernel
def count_residuals(found, first, last, counts):
    """Write how many residuals of each stream are from row `first` to `last` - 1, see `boom_twin.twin.blocks.CODES`."""
    counts[:] = 0
    for k in range(first, last):
        counts[found.residual_streams[k]] += 1


@kernel
def copy_residuals(found, first, last, stream, stamps, raw, left, sigmas):
    """Copy the residuals of one stream from row `first` to `last` - 1.

    Parameters
    ----------
    found : UpdateOutput
    stream : int
        By `boom_twin.twin.blocks.CODES`.
    stamps, raw, left, sigmas : ndarray
        Written, with room for all of them; see `boom_twin.health.blocks.MeasuredRows`.
    """
    count = 0
    for k in range(first, last):
        if found.residual_streams[k] == stream:
            stamps[count] = found.residual_stamps[k]
            for i in range(raw.shape[1]):
                raw[count, i], left[count, i], sigmas[count, i] = found.raw[k, i], found.values[k, i], found.sigmas[k, i]
            count += 1
