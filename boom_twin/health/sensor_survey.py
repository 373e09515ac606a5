"""What single sensors show in a block of readings, compiled: noise, repetition, what is missing or out of range, means."""

from __future__ import annotations

import math

from ..kernels.jit import inner, kernel


@inner
def bend2(values, t, i):
    """Square of the second difference at row t of channel i; its mean is the variance of white noise."""
    bend = values[t, i] - 2.0 * values[t - 1, i] + values[t - 2, i]
    return bend * bend / 6.0


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
    largest, loudest, longest, lack, most : float, float, int, float, float
        The largest change of `left` from one reading to the next, but for those across a gap; the largest of `power`, `run`,
        `missing` and `outside`.
    """
    largest, count = 0.0, times.shape[0]
    loudest, longest, lack, most = 0.0, 0, 0.0, 0.0
    for i in range(power.shape[0]):
        total, known, lacking = 0.0, 0, 0
        for t in range(1, count):
            step = abs(left[t, i] - left[t - 1, i])
            if times[t] - times[t - 1] <= gap and step > largest:
                largest = step
            if t < 3:
                continue
            bent = bend2(left, t, i)
            if not math.isnan(bent):
                total += min(bent, cut)
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
        if known > 0:
            heard = total / known
            if math.isnan(power[i]):
                power[i] = min(heard, variance)
            else:
                power[i] += share * (heard - power[i])
        if power[i] > loudest:
            loudest = power[i]
        longest, lack, most = max(longest, run[i]), max(lack, missing[i]), max(most, outside[i])
    return largest, loudest, longest, lack, most


@kernel
def is_bent(raw, masked, variance, times, white):
    """Whether readings of a channel that is not `masked` bend more than noise does, and smoothly.

    Parameters
    ----------
    raw : ndarray, shape (k, channels)
    masked : ndarray of bool, shape (channels,)
    variance, times : float
        Of the noise, and by how many times of it the second differences have to exceed it.
    white : float
        Share of the power of second differences that third ones must not reach: noise gives the same by both.
    """
    count = raw.shape[0]
    for i in range(raw.shape[1]):
        if masked[i]:
            continue
        power, rougher = 0.0, 0.0
        for t in range(2, count):
            power += bend2(raw, t, i)
        for t in range(3, count):
            step = raw[t - 1, i] - raw[t - 2, i]
            third = (raw[t, i] - raw[t - 1, i] - step) - (step - (raw[t - 2, i] - raw[t - 3, i]))
            rougher += third * third
        if power > times * variance * (count - 2) and rougher / 20.0 < white * power:
            return True
    return False


@kernel
def follow_noise(left, largest, share, variances):
    """Go on with the variances (channels,) of single readings by second differences of `left` (k, channels), if all are known.

    What a block has counts by `share`, and as `largest` at most.
    """
    count = left.shape[0] - 2
    for i in range(left.shape[1]):
        for t in range(left.shape[0]):
            if not math.isfinite(left[t, i]):
                return
    for i in range(left.shape[1] if count > 0 else 0):
        total = 0.0
        for t in range(2, left.shape[0]):
            total += bend2(left, t, i)
        variances[i] += share * (min(total / count, largest) - variances[i])


@kernel
def mean_of_near(left, far, column, mean, count):
    """Mean by channel of those `left` (k, channels) that are at most `far` from the median, and how many these are.

    `column` (k,) is scratch. False, and nothing of use, if a reading is missing.
    """
    size = left.shape[0]
    for i in range(left.shape[1]):
        for t in range(size):
            value = left[t, i]
            if not math.isfinite(value):
                return False
            at = t
            while at > 0 and column[at - 1] > value:
                column[at] = column[at - 1]
                at -= 1
            column[at] = value
        middle, total, near = column[size // 2], 0.0, 0
        for t in range(size):
            if abs(left[t, i] - middle) <= far:
                total += left[t, i]
                near += 1
        mean[i], count[i] = total / near, near
    return True
