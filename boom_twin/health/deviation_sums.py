"""Sums of innovations that `boom_twin.health.detection` tests, compiled."""

from __future__ import annotations

import math

from ..kernels.jit import kernel

ALLOWANCE = 1.0  # deviations by which the mean may be off
CUT = 4.0  # a single innovation counts no more than this
WINDOW = 20  # blocks of the window: 2 s


@kernel
def follow_deviations(sums, began, squares, normal, count):
    """Go on with the sums of all channels by one block, the `count`-th.

    Parameters
    ----------
    sums, began : ndarray, shape (2, channels)
        Of the CUSUM upwards and downwards, and in which block each last was 0.
    squares : ndarray, shape (WINDOW, channels)
        Of the newest innovations, the newest last.
    normal : ndarray, shape (channels,)
        Innovations, NaN where nothing was measured.

    Returns
    -------
    lasting, window : float, float
        The largest of `sums`, and of the channels' sums of `squares`.
    """
    lasting, window = 0.0, 0.0
    for i in range(normal.shape[0]):
        is_measured = math.isfinite(normal[i])
        z = min(max(normal[i], -CUT), CUT) if is_measured else 0.0
        allowed = ALLOWANCE if is_measured else 0.0
        for side in range(2):
            if sums[side, i] == 0.0:
                began[side, i] = count
            sums[side, i] = max(0.0, sums[side, i] + ((z if side == 0 else -z) - allowed))
            lasting = max(lasting, sums[side, i])
        total = 0.0
        for t in range(WINDOW - 1):
            squares[t, i] = squares[t + 1, i]
            total += squares[t, i]
        squares[WINDOW - 1, i] = z * z
        window = max(window, total + z * z)
    return lasting, window
