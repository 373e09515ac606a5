"""Findings in a block of readings of single sensors, compiled: stuck, noisy, spikes, silence, out of range, jumps."""

from __future__ import annotations

import math
from statistics import NormalDist

from ..kernels.jit import inner, kernel
from .sensor_survey import BEFORE, SILENT_FOR, least_noise2, loud, noise2_at, read_out

STUCK, NOISY, SPIKES, SILENT, OUTSIDE = range(5)  # rows of the flags that `find` writes
FALSE_ALARM = 1e-12  # probability, for each reading, of a finding in white noise
OUTLIER = -math.sqrt(2.0) * NormalDist().inv_cdf(0.5 * FALSE_ALARM)  # difference of two readings, over their noise
QUIET = 0.3  # of the noise that is stated: a channel with less gives clean readings, whose repetition means nothing
MISSING = 0.1  # share of the readings
REPEATS_FOR, LEAST_REPEATS = 0.4, 3.0  # s; times, at least, that a reading has to repeat
ENOUGH, MEDIAN2 = 6, 0.4549  # third differences whose median tells noise; that of the square of a standard normal value


@kernel
def find(sensors, times, raw, left, largest, now, is_known, fastest, column, flags, jumped):
    """Write the findings in the block that `boom_twin.health.sensor_survey.survey` took; return True if there is any.

    Parameters
    ----------
    sensors, times, raw, left
        See `survey`.
    largest : float
        Change of `left` from one reading to the next, see `survey`.
    now : float
        End of the block, s.
    is_known : bool
        Whether it is known how noisy the sensors are.
    fastest : float
        What the quantity may change by, per s: more is a jump of the sensor. 0 where a jump is judged by the noise alone.
    column : ndarray
        Scratch, as long as the block.
    flags : ndarray of bool, shape (5, channels)
        Written, see `STUCK`.
    jumped : ndarray, shape (channels,)
        Written: how far readings changed from one to the next, for good, while the model did not; 0 where they did not.
    """
    power, count = sensors.power, times.shape[0]
    live, newest, found = is_any_live(sensors), times[count - 1], False
    for i in range(power.shape[0]):
        is_spiky, jumped[i] = False, 0.0
        if largest > OUTLIER * math.sqrt(sensors.stated):
            least = OUTLIER * noise_of(sensors, times, left, i, column)
            is_spiky, jumped[i] = has_spikes(times, left, i, least), jump(times, raw, left, i, least, fastest)
        flags[STUCK, i] = live and newest - sensors.since[i] >= REPEATS_FOR and sensors.run[i] >= most_repeats(sensors, i)
        flags[NOISY, i] = is_known and power[i] > loud(sensors, i)
        flags[SPIKES, i] = is_known and is_spiky
        flags[SILENT, i] = now - sensors.heard[i] > SILENT_FOR or sensors.missing[i] > MISSING
        flags[OUTSIDE, i] = sensors.outside[i] > 0.5 * (count - BEFORE)
        found = found or jumped[i] != 0.0
        for kind in range(5):
            found = found or flags[kind, i]
    return found


@inner
def most_repeats(sensors, i):
    """Return how often the sensor of channel i repeats a reading before it is stuck: a coarse one at rest for long."""
    step = read_out(sensors, i)
    needed = readings_of_frozen(sensors.sigma, step, FALSE_ALARM) - 1.0
    return max(needed, LEAST_REPEATS) if step > 0.0 else math.inf


@inner
def readings_of_frozen(sigma, resolution, false_alarm):
    """Return the number of equal readings in a row that white noise gives with a probability below `false_alarm` each.

    Noise of standard deviation s, `QUIET` of the stated `sigma`, repeats a reading in steps of q with a probability of at most

        p = erf(q / (2 sqrt(2) s)),

    reached by a sensor that stands still in the middle of a step. N equal readings have p^(N - 1). The number is at least 2. It
    is infinite where a sensor at rest cannot be told from a frozen one: one without noise, or coarse against it.
    """
    if sigma == 0.0:
        return math.inf
    missed = math.erfc(resolution / (2.0 * math.sqrt(2.0) * QUIET * sigma))
    if missed == 0.0:
        return math.inf
    return 2.0 if missed == 1.0 else max(2.0, 1.0 + math.ceil(math.log(false_alarm) / math.log1p(-missed)))


@inner
def is_any_live(sensors):
    """Return True if a channel of several is alive with noise."""
    power, least = sensors.power, QUIET * math.sqrt(sensors.stated)
    live = False
    for i in range(power.shape[0] if power.shape[0] > 1 else 0):
        live = live or power[i] > least * least
    return live


@inner
def noise_of(sensors, times, left, i, column):
    """Return the noise of channel i: as measured over time, by the median of third differences, or as stated.

    That median does not wait for the noise to be measured, as a mean over time does, and one spike leaves it as it is. A sensor
    that has twice the stated noise gives no spikes by that.
    """
    variance, size = least_noise2(sensors, i), 0
    if sensors.power[i] > variance:
        variance = sensors.power[i]
    for t in range(BEFORE, times.shape[0]):
        size = sorted_in(column, size, noise2_at(times, left, t, i))
    if size >= ENOUGH:
        variance = max(variance, column[(size - 1) // 2] / MEDIAN2)
    return math.sqrt(variance)


@inner
def sorted_in(column, size, value):
    """Sort a value, if finite, into the first `size` entries of a column, which are in order; return their new number."""
    if not math.isfinite(value):
        return size
    at = size
    while at > 0 and column[at - 1] > value:
        column[at] = column[at - 1]
        at -= 1
    column[at] = value
    return size + 1


@inner
def step(times, left, t, i):
    """Return the change of the residual to reading t of channel i from the one before; NaN across a gap."""
    if times[t] - times[t - 1] > SILENT_FOR:
        return math.nan
    return left[t, i] - left[t - 1, i]


@inner
def has_spikes(times, left, i, least):
    """Return True if a reading of channel i leaves both neighbours the same way by more than `least`, while these agree."""
    for t in range(1, times.shape[0] - 1):
        out, back = step(times, left, t, i), -step(times, left, t + 1, i)
        if out * back > 0.0 and abs(out) > least and abs(back) > least and abs(out - back) < 0.5 * min(abs(out), abs(back)):
            return True
    return False


@inner
def jump(times, raw, left, i, least, fastest):
    """Return how far readings of channel i changed at once by more than `least` and more than `fastest` allows, for good.

    The readings make most of that step themselves: where they lag all at once, the expected ones do.
    """
    total = 0.0
    for t in range(2, times.shape[0] - 1):
        change = step(times, left, t, i)
        most = max(least, fastest * (times[t] - times[t - 1]))
        read = math.copysign(1.0, change) * (raw[t, i] - raw[t - 1, i])
        if not (abs(change) > most and read > max(most, 0.5 * abs(change))):
            continue
        lasting = 0.5 * (left[t, i] + left[t + 1, i]) - 0.5 * (left[t - 2, i] + left[t - 1, i])
        before, after = abs(left[t - 1, i] - left[t - 2, i]), abs(left[t + 1, i] - left[t, i])
        if abs(lasting) > 0.7 * abs(change) and before < 0.3 * abs(change) and after < 0.3 * abs(change):
            total += change
    return total
