"""Normal equations of a constant lag of readings, compiled; see `boom_twin.health.delay_monitor`."""

from __future__ import annotations

import math

from ..kernels.jit import kernel

BLOCK = 0.1  # s between readings
TINY = 1e-300


@kernel
def lag_equations(rows, slopes, lag, scratch, noise, by, weight):
    """Write the normal equations of a change of a lag, of every span and channel by itself.

    Beside the lag, readings are off by what is left once that is added which they should have gone since. This is as many times
    the change as minus the rates that they were read at. Both count less their mean in a span, and by the noise of the channel,
    for which all is taken that is left.

    Parameters
    ----------
    rows, slopes : ndarray, shape (spans, k, channels)
        By how much readings `BLOCK` apart are off, and the slope of what they should be.
    lag : float
        s; of a span those readings count whose time lies in it.
    scratch, noise : ndarray, shape (3, k, channels), (channels,)
        Written.
    by, weight : ndarray, shape (spans, channels)
        Right and left side, written.

    Returns
    -------
    float
        Mean square of what is left.
    """
    spans, span, channels = rows.shape
    gone, left, rates = scratch[0], scratch[1], scratch[2]
    noise[:] = 0.0
    for s in range(spans):
        gone[0] = 0.0
        for t in range(1, span):
            for i in range(channels):
                gone[t, i] = gone[t - 1, i] + 0.5 * BLOCK * (slopes[s, t, i] + slopes[s, t - 1, i])
        count = 0
        for t in range(span):
            place = t - lag / BLOCK
            if not 0.0 <= place <= span - 1.0:
                continue
            before = min(math.floor(place), span - 2)
            share = place - before
            for i in range(channels):
                rate = (1.0 - share) * slopes[s, before, i] + share * slopes[s, before + 1, i]
                then = gone[before, i] + share * BLOCK * 0.5 * (slopes[s, before, i] + rate)
                left[count, i], rates[count, i] = rows[s, t, i] + gone[t, i] - then, rate
            count += 1
        for i in range(channels):
            mean, mean_rate = 0.0, 0.0
            for t in range(count):
                mean += left[t, i]
                mean_rate += rates[t, i]
            mean, mean_rate = mean / count, mean_rate / count
            by[s, i] = weight[s, i] = 0.0
            for t in range(count):
                off, rate = left[t, i] - mean, rates[t, i] - mean_rate
                noise[i] += off * off
                by[s, i] += off * rate
                weight[s, i] += rate * rate
    squares = 0.0
    for i in range(channels):
        squares += noise[i]
        for s in range(spans):
            by[s, i], weight[s, i] = -by[s, i] / (noise[i] + TINY), weight[s, i] / (noise[i] + TINY)
    return squares / (spans * count * channels)
