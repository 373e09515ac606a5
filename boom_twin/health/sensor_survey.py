"""Readings of a stream in blocks, and a survey of its sensors, compiled: noise, repetition, missing readings, range, means."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.jit import by_reference, inner
from ..types import NANO, Array, Integers

NOISY, NOISY_WINDOW = 2.5, 1.0  # times the noise that is usual in its stream; time (s) over which it is taken
USUAL_WINDOW = 10.0  # s over which the noise that is usual is told
MEASURED = 4.0  # times the stated noise, above which there may be more: a reading counts for so much at most
SILENT_FOR = 0.5  # s; readings that lie farther apart are no neighbours: neither jumps nor spikes show across such a gap
SHAKEN = 3.0  # multiple of the stated variance above which second differences show motion
WHITE = 0.75  # ratio of third to second differences below which they show motion, not noise


@by_reference
class SlowMeans(NamedTuple):
    """Means over some time, updated in place; shape (channels,) each.

    read, expected, variance, rate : weighted sums of readings, of what the model expected, of the expected variance of their
    difference, and of the expected reading's rate (1/s). Divided by `weight` they are means.
    weight : from 0 to 1.
    """

    read: Array
    expected: Array
    variance: Array
    rate: Array
    weight: Array


LATELY = np.dtype([("first", float), ("noise", float), ("lasting", float), ("is_live", bool)])
"""Time (s) of the first reading; usual variance of the noise, now and averaged; whether a sensor has shown noise."""
BEFORE = 3  # readings before a block that `survey` and `find` take with it
ROWS, TAKEN = range(2)  # places of `CheckWork.counts`
STUCK, IS_NOISY, SPIKES, SILENT, OUTSIDE = range(5)  # rows of `CheckWork.flags`


@by_reference
class CheckWork(NamedTuple):
    """State of `examine` for one stream: readings that are not judged yet, after the `BEFORE` newest that are, and statistics.

    counts : number of rows of `stamps` to `sigmas`, and of readings in the newest block.
    stamps, raw, left, sigmas : (rows,) in ns, and (rows, channels) readings, residuals and expected standard deviations of
    these; NaN where a reading is missing. column : (rows,) scratch.
    stated : variance of noise and rounding. sigma, resolution : standard deviation of the noise, step of the rounding.
    steps : (channels,) smallest change from one reading to the next so far.
    lately : (1,) see `LATELY`.
    low, high : (channels,) the range of the sensors.
    heard : (channels,) time of the newest reading, s; NaN before the first.
    power, run, since : (channels,) variance of the noise, see `noise2_at`; repetitions of the newest reading; first stamp (s).
    missing, outside : (channels,) share of missing readings; number of readings of the newest block out of range.
    means : (4, channels) of the newest block, see `boom_twin.health.sensor_check.SensorCheck`. slow : SlowMeans.
    flags, jumped : (5, channels), (channels,) findings in the newest block: see `STUCK`; by how much readings changed from one
    to the next, for good, while the model did not; 0 where they did not.
    """

    counts: Integers
    stamps: Integers
    raw: Array
    left: Array
    sigmas: Array
    column: Array
    stated: float
    sigma: float
    resolution: float
    steps: Array
    lately: NDArray[np.void]
    low: Array
    high: Array
    heard: Array
    power: Array
    run: Integers
    since: Array
    missing: Array
    outside: Array
    means: Array
    slow: SlowMeans
    flags: NDArray[np.bool_]
    jumped: Array


@inner
def gap(stamps, t):
    """Return the time from reading t - 1 to reading t, s."""
    return (stamps[t] - stamps[t - 1]) * NANO


@inner
def bend2(values, t, i):
    """Return the squared second difference at row t of channel i, scaled to have the variance of white noise as its mean."""
    bend = values[t, i] - 2.0 * values[t - 1, i] + values[t - 2, i]
    return bend * bend / 6.0


@inner
def rough2(values, t, i):
    """Return the squared third difference, scaled as in `bend2`. An oscillation at w rad/s has 0.3 (w dt)^2 times `bend2`."""
    step = values[t - 1, i] - values[t - 2, i]
    third = (values[t, i] - values[t - 1, i] - step) - (step - (values[t - 2, i] - values[t - 3, i]))
    return third * third / 20.0


@inner
def noise2_at(stamps, values, t, i):
    """Return the variance of white noise in rows t - 3 to t of channel i, on values that follow a parabola.

    It is the smaller one by third differences and by Newton's divided differences. Uneven stamps may be true sampling times, or
    arrival times of evenly sampled readings.
    """
    a, b, c = gap(stamps, t - 2), gap(stamps, t - 1), gap(stamps, t)
    even = rough2(values, t, i)
    if not (a > 0.0 and b > 0.0 and c > 0.0):
        return even
    first, second = -1.0 / (a * (a + b) * (a + b + c)), 1.0 / (a * b * (b + c))
    third, fourth = -1.0 / ((a + b) * b * c), 1.0 / ((a + b + c) * (b + c) * c)
    divided = first * (values[t - 3, i] - values[t, i]) + second * (values[t - 2, i] - values[t, i])
    divided += third * (values[t - 1, i] - values[t, i])
    return min(even, divided * divided / (first * first + second * second + third * third + fourth * fourth))


@inner
def survey(sensors, stamps, raw, left):
    """Update the statistics of every channel by a block, and return the largest change of `left` within gaps.

    `stamps`, `raw`, `left` are those of `sensors` up to the end of the block; the newest `BEFORE` before the block are first.
    """
    lately, begin, last = sensors.lately[0], stamps[BEFORE], stamps.shape[0] - 1
    if not lately.first <= begin * NANO:
        lately.first = begin * NANO
    span = max((stamps[last] - begin) * NANO, 1e-3)
    largest = go_on(sensors, stamps, raw, left, min(1.0, span / NOISY_WINDOW))
    lately.noise = usual_power(sensors.power, sensors.stated)
    lately.lasting += min(1.0, span / USUAL_WINDOW) * (lately.noise - lately.lasting)
    return largest


@inner
def read_out(sensors, i):
    """Return the step in which the sensor of channel i is read out; 0 where neither it nor another has shown one.

    It is the stated resolution, or the smallest change that the sensor has shown, or, if it has shown none, the smallest of all
    sensors of the stream.
    """
    shown = sensors.steps[i]
    for j in range(sensors.steps.shape[0] if math.isinf(shown) else 0):
        shown = min(shown, sensors.steps[j])
    return max(sensors.resolution, shown) if math.isfinite(shown) else 0.0


@inner
def least_noise2(sensors, i):
    """Return the variance of the noise of channel i as stated, rounded as the sensor is read out."""
    step = read_out(sensors, i)
    return max(sensors.stated, sensors.sigma * sensors.sigma + step * step / 12.0)


@inner
def loud(sensors, i):
    """Return the variance of the noise above which channel i is noisy."""
    usual = min(sensors.lately[0].noise, NOISY**2 * sensors.stated)
    return NOISY**2 * max(usual, least_noise2(sensors, i))


@inner
def usual_power(power, stated):
    """Return the usual variance of the noise: the median of the channels, at least `stated`; `stated` for one channel.

    So a sensor is noisy by comparison with the others, not with its data sheet.
    """
    known = 0
    for i in range(power.shape[0]):
        if math.isfinite(power[i]):
            known += 1
    if known < 2:
        return stated
    for i in range(power.shape[0]):
        below = 0
        for j in range(power.shape[0]):
            if power[j] < power[i] or (power[j] == power[i] and j < i):
                below += 1
        if math.isfinite(power[i]) and below == (known - 1) // 2:
            return max(power[i], stated)
    return stated


@inner
def go_on(sensors, stamps, raw, left, share):
    """Take the readings of a block, with weight `share` in the averages; return the largest change of `left` within gaps."""
    variance, cut = sensors.stated, (MEASURED * NOISY) ** 2 * sensors.stated
    power, run, missing, outside = sensors.power, sensors.run, sensors.missing, sensors.outside
    count, largest = stamps.shape[0], 0.0
    for i in range(power.shape[0]):
        total, known, lacking, newest, outside[i] = 0.0, 0, 0, -1, 0.0
        for t in range(1, count):
            step = abs(left[t, i] - left[t - 1, i])
            if gap(stamps, t) <= SILENT_FOR and step > largest:
                largest = step
            if t < BEFORE:
                continue
            noise2 = noise2_at(stamps, left, t, i)
            if not math.isnan(noise2):
                total += min(noise2, cut)
                known += 1
            if math.isnan(raw[t, i]):
                lacking += 1
            elif is_outside(sensors, raw[t, i], i) and not is_outside(sensors, raw[t, i] - left[t, i], i):
                outside[i] += 1.0
            if raw[t, i] == raw[t - 1, i]:
                run[i] += 1
            elif math.isfinite(raw[t, i]):
                run[i], sensors.since[i] = 0, stamps[t] * NANO
                if math.isfinite(raw[t - 1, i]):
                    sensors.steps[i] = min(sensors.steps[i], abs(raw[t, i] - raw[t - 1, i]))
            if math.isfinite(raw[t, i]):
                newest = t
        if newest >= 0:
            if not stamps[newest] * NANO <= sensors.heard[i]:
                sensors.heard[i] = stamps[newest] * NANO
        elif math.isnan(sensors.heard[i]):
            sensors.heard[i] = stamps[BEFORE] * NANO
        missing[i] += share * (lacking / (count - BEFORE) - missing[i])
        if known > 0:
            heard = total / known
            if math.isnan(power[i]):
                power[i] = min(heard, variance)
            else:
                power[i] += share * (heard - power[i])
    return largest


@inner
def is_outside(sensors, reading, i):
    """Return True if a reading of channel i is out of its range. Where one is expected there, the range is wrong."""
    return reading < sensors.low[i] or reading > sensors.high[i]


@inner
def summarise(sensors, stamps, raw, left, sigmas, masked, share):
    """Compute the means of a block of readings, and update the slow means.

    Slow means of channels that are `masked` (channels,) restart at 0. `share` is the weight of the block in the others.
    """
    means, slow, last = sensors.means, sensors.slow, stamps.shape[0] - 1
    span = (stamps[last] - stamps[0]) * NANO
    for i in range(raw.shape[1]):
        known, read, off, variance, heard, every = 0, 0.0, 0.0, 0.0, 0, 0.0
        for t in range(last + 1):
            if math.isfinite(raw[t, i]):
                heard += 1
                every += raw[t, i]
            if math.isfinite(left[t, i]):
                known += 1
                read += raw[t, i]
                off += left[t, i]
                variance += sigmas[t, i] * sigmas[t, i]
        means[:, i] = math.nan
        if known > 0:
            means[0, i], means[1, i], variance = read / known, (read - off) / known, variance / known
            means[2, i] = max(variance - sensors.stated, 0.0) + sensors.stated / known  # the mean has less noise
        means[3, i] = every / heard if heard > 0 else math.nan
        rate = ((raw[last, i] - left[last, i]) - (raw[0, i] - left[0, i])) / span if span > 0.0 else math.nan
        if masked[i]:
            for each in (slow.read, slow.expected, slow.variance, slow.rate, slow.weight):
                each[i] = 0.0
        elif known > 0:
            slow.read[i] += share * (means[0, i] - slow.read[i])
            slow.expected[i] += share * (means[1, i] - slow.expected[i])
            slow.variance[i] += share * (variance - slow.variance[i])
            slow.weight[i] += share * (1.0 - slow.weight[i])
        if math.isfinite(rate) and not masked[i]:
            slow.rate[i] += share * (rate - slow.rate[i])


@inner
def is_bent(stated, raw, masked):
    """Return True if a channel that is not masked shows motion that is fast for the sampling rate.

    Its second differences exceed those of noise, and its third differences are smaller than those of noise.
    """
    count, found = raw.shape[0], False
    for i in range(raw.shape[1]):
        power, rougher = 0.0, 0.0
        for t in range(2, count):
            power += bend2(raw, t, i)
        for t in range(3, count):
            rougher += rough2(raw, t, i)
        is_quick = power > SHAKEN * stated * (count - 2)
        if is_quick and rougher < WHITE * power and not masked[i]:
            found = True
    return found
