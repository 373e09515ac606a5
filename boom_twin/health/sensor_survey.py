"""What single sensors show in a block of readings, compiled: noise, repetition, what is missing or out of range."""

from __future__ import annotations

import math

from ..kernels.jit import kernel


@kernel
def survey(times, raw, left, low, high, gap, share, cut, variance, power, run, since, missing, outside):
    """Go on with what is known of every channel, and count readings out of range.

    Parameters
    ----------
    times, raw, left : ndarray, shape (3 + k,), (3 + k, channels), (3 + k, channels)
        Of the readings, the newest three before them first: s, as measured, less what the model has.
    low, high : ndarray, shape (channels,)
        Their range.
    gap : float
        Readings that lie farther apart are no neighbours, s.
    share, cut, variance : float
        Weight of these readings; what a single outlier counts at most, and what noise is stated to have, as variances.
    power, run, since, missing, outside : ndarray, shape (channels,)
        Variance of the noise, by second differences; times that the newest reading was repeated, and since when (s); share of
        readings that are missing; readings out of range.

    Returns
    -------
    largest : float
        The largest change of `left` from one reading to the next, but for those across a gap.
    """
    largest, count = 0.0, times.shape[0]
    for i in range(power.shape[0]):
        total, known, lacking = 0.0, 0, 0
        for t in range(1, count):
            step = abs(left[t, i] - left[t - 1, i])
            if times[t] - times[t - 1] <= gap and step > largest:
                largest = step
            if t < 3:
                continue
            bend = left[t, i] - 2.0 * left[t - 1, i] + left[t - 2, i]
            if not math.isnan(bend):
                total += min(bend * bend / 6.0, cut)
                known += 1
            if math.isnan(raw[t, i]):
                lacking += 1
            elif raw[t, i] < low[i] or raw[t, i] > high[i]:
                outside[i] += 1.0
            if raw[t, i] == raw[t - 1, i]:
                run[i] += 1
            elif math.isfinite(raw[t, i]):
                run[i], since[i] = 0, times[t]
        missing[i] += share * (lacking / (count - 3) - missing[i])
        if known == 0:
            continue
        heard = total / known
        if math.isnan(power[i]):
            power[i] = min(heard, variance)
        else:
            power[i] += share * (heard - power[i])
    return largest
