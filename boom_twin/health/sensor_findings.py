"""Check of a block of readings of single sensors, compiled: stuck, noisy, spikes, silence, out of range, jumps."""

from __future__ import annotations

import math
from statistics import NormalDist

from ..kernels.jit import inner, kernel
from ..types import NANO
from .sensor_survey import (
    BEFORE,
    IS_NOISY,
    NOISY,
    NOISY_WINDOW,
    OUTSIDE,
    ROWS,
    SILENT,
    SILENT_FOR,
    SPIKES,
    STUCK,
    TAKEN,
    gap,
    is_bent,
    least_noise2,
    loud,
    noise2_at,
    read_out,
    summarise,
    survey,
)

HAS_FINDING, IS_BENT = 1, 2  # parts of the result of `examine`
JERK = 3.0  # m/s^3 of a cylinder in haste, which is no noise of its sensor: 0.2 m in 1.6 s
FALSE_ALARM = 1e-12  # probability, for each reading, of a finding in white noise
OUTLIER = -math.sqrt(2.0) * NormalDist().inv_cdf(0.5 * FALSE_ALARM)  # difference of two readings, over their noise
QUIET = 0.3  # of the noise that is stated: a channel with less gives clean readings, whose repetition means nothing
MISSING = 0.1  # share of the readings
REPEATS_FOR, LEAST_REPEATS = 0.4, 3.0  # s; times, at least, that a reading has to repeat
ENOUGH, MEDIAN2 = 6, 0.4549  # third differences whose median tells noise; that of the square of a standard normal value


@kernel
def collect(sensors, rows, stamps, raw, left, sigmas, since):
    """Append the chosen `rows` of a table that are not before `since` (ns). The table may have further columns behind."""
    count = sensors.counts[ROWS]
    for k in range(rows.shape[0]):
        row = rows[k]
        if stamps[row] >= since:
            sensors.stamps[count] = stamps[row]
            for i in range(sensors.raw.shape[1]):
                sensors.raw[count, i], sensors.left[count, i] = raw[row, i], left[row, i]
                sensors.sigmas[count, i] = sigmas[row, i]
            count += 1
    sensors.counts[ROWS] = count


@kernel
def examine(sensors, start, end, masked, share, is_predicted, fastest):
    """Take the block from `start` to `end` (ns): update what is known of every sensor, and write the findings.

    Parameters
    ----------
    sensors : CheckWork
        Readings before `start` are dropped, as those of a block without predictions.
    start, end : int
    masked : ndarray of bool, shape (channels,)
        Channels that are not trusted.
    share : float
        Weight of the block in the slow means.
    is_predicted : bool
        False if the residuals are of no use.
    fastest : float
        Largest rate of the quantity, per s. A faster change is a jump of the sensor. 0: the noise alone decides about jumps.

    Returns
    -------
    int
        Sum of `HAS_FINDING` and `IS_BENT`; the latter if trusted sensors show a motion that is fast against their rate.
    """
    first = last = BEFORE
    while first < sensors.counts[ROWS] and sensors.stamps[first] < start:
        first += 1
    remove(sensors, BEFORE, first - BEFORE)
    while last < sensors.counts[ROWS] and sensors.stamps[last] < end:
        last += 1
    sensors.counts[TAKEN], sensors.means[:], sensors.jumped[:] = last - BEFORE, math.nan, 0.0
    if last == BEFORE:
        sensors.flags[:] = False
        for i in range(sensors.jumped.shape[0]):
            sensors.flags[SILENT, i] = end * NANO - sensors.heard[i] > SILENT_FOR
        return HAS_FINDING if is_any(sensors) else 0
    stamps, raw, left = sensors.stamps[:last], sensors.raw[:last], sensors.left[:last]
    summarise(sensors, stamps[BEFORE:], raw[BEFORE:], left[BEFORE:], sensors.sigmas[BEFORE:last], masked, share)
    found = IS_BENT if is_bent(sensors.stated, raw[BEFORE:], masked) else 0
    if not is_predicted:
        left[BEFORE:] = math.nan
    largest = survey(sensors, stamps, raw, left)
    interval = (stamps[last - 1] - stamps[BEFORE - 1]) * NANO / (last - BEFORE)
    is_motion = fastest > 0.0 and JERK * interval**3 > NOISY * math.sqrt(sensors.stated)  # which bends readings so much
    if not is_motion and is_noisy(sensors):
        sensors.lately[0].is_live = True
    is_known = end * NANO - sensors.lately[0].first > NOISY_WINDOW and not is_motion  # how noisy the sensors are
    find(sensors, stamps, raw, left, largest, end * NANO, is_known, fastest)
    remove(sensors, 0, last - BEFORE)
    return found + (HAS_FINDING if is_any(sensors) else 0)


@inner
def is_any(sensors):
    """Return True if there is a finding."""
    found = False
    for i in range(sensors.jumped.shape[0]):
        for kind in range(sensors.flags.shape[0]):
            found = found or sensors.flags[kind, i] or sensors.jumped[i] != 0.0
    return found


@inner
def remove(sensors, at, count):
    """Remove `count` rows from row `at` on."""
    if count == 0:
        return
    for k in range(at, sensors.counts[ROWS] - count):
        sensors.stamps[k] = sensors.stamps[k + count]
        for i in range(sensors.raw.shape[1]):
            sensors.raw[k, i], sensors.left[k, i] = sensors.raw[k + count, i], sensors.left[k + count, i]
            sensors.sigmas[k, i] = sensors.sigmas[k + count, i]
    sensors.counts[ROWS] -= count


@inner
def find(sensors, stamps, raw, left, largest, now, is_known, fastest):
    """Write the findings in the block that `survey` took, which ends at `now` (s).

    `largest` is the change of `left` from one reading to the next, see `survey`. `is_known` tells whether it is known how noisy
    the sensors are. For `fastest` see `examine`.
    """
    power, count, flags, jumped = sensors.power, stamps.shape[0], sensors.flags, sensors.jumped
    newest = stamps[count - 1] * NANO
    for i in range(power.shape[0]):
        is_spiky = False
        if largest > OUTLIER * math.sqrt(sensors.stated):
            least = OUTLIER * noise_of(sensors, stamps, left, i)
            is_spiky, jumped[i] = has_spikes(stamps, left, i, least), jump(stamps, raw, left, i, least, fastest)
        is_old = sensors.lately[0].is_live and newest - sensors.since[i] >= REPEATS_FOR
        flags[STUCK, i] = is_old and sensors.run[i] >= most_repeats(sensors, i)
        flags[IS_NOISY, i] = is_known and power[i] > loud(sensors, i)
        flags[SPIKES, i] = is_known and is_spiky
        flags[SILENT, i] = now - sensors.heard[i] > SILENT_FOR or sensors.missing[i] > MISSING
        flags[OUTSIDE, i] = sensors.outside[i] > 0.5 * (count - BEFORE)


@inner
def most_repeats(sensors, i):
    """Return how often the sensor of channel i repeats a reading before it is stuck: a coarse one at rest for long."""
    step = read_out(sensors, i)
    needed = readings_of_frozen(sensors.sigma, step) - 1.0
    return max(needed, LEAST_REPEATS) if step > 0.0 else math.inf


@inner
def readings_of_frozen(sigma, resolution):
    """Return the number of equal readings in a row that white noise gives with a probability below `FALSE_ALARM` each.

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
    return 2.0 if missed == 1.0 else max(2.0, 1.0 + math.ceil(math.log(FALSE_ALARM) / math.log1p(-missed)))


@inner
def is_noisy(sensors):
    """Return True if a channel shows noise. A stream that never has gives clean readings, which repeat while the boom rests."""
    found = False
    for i in range(sensors.power.shape[0]):
        found = found or sensors.power[i] > QUIET * QUIET * sensors.stated
    return found


@inner
def noise_of(sensors, stamps, left, i):
    """Return the noise of channel i: as measured over time, by the median of third differences, or as stated.

    That median does not wait for the noise to be measured, as a mean over time does, and one spike leaves it as it is. A sensor
    that has twice the stated noise gives no spikes by that.
    """
    variance, size, column = least_noise2(sensors, i), 0, sensors.column
    if sensors.power[i] > variance:
        variance = sensors.power[i]
    for t in range(BEFORE, stamps.shape[0]):
        size = sorted_in(column, size, noise2_at(stamps, left, t, i))
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
def step(stamps, left, t, i):
    """Return the change of the residual to reading t of channel i from the one before; NaN across a gap."""
    if gap(stamps, t) > SILENT_FOR:
        return math.nan
    return left[t, i] - left[t - 1, i]


@inner
def has_spikes(stamps, left, i, least):
    """Return True if a reading of channel i leaves both neighbours the same way by more than `least`, while these agree."""
    for t in range(1, stamps.shape[0] - 1):
        out, back = step(stamps, left, t, i), -step(stamps, left, t + 1, i)
        if out * back > 0.0 and abs(out) > least and abs(back) > least and abs(out - back) < 0.5 * min(abs(out), abs(back)):
            return True
    return False


@inner
def jump(stamps, raw, left, i, least, fastest):
    """Return how far readings of channel i changed at once by more than `least` and more than `fastest` allows, for good.

    The readings make most of that step themselves: where they lag all at once, the expected ones do.
    """
    total = 0.0
    for t in range(2, stamps.shape[0] - 1):
        change = step(stamps, left, t, i)
        most = max(least, fastest * gap(stamps, t))
        read = math.copysign(1.0, change) * (raw[t, i] - raw[t - 1, i])
        if not (abs(change) > most and read > max(most, 0.5 * abs(change))):
            continue
        lasting = 0.5 * (left[t, i] + left[t + 1, i]) - 0.5 * (left[t - 2, i] + left[t - 1, i])
        before, after = abs(left[t - 1, i] - left[t - 2, i]), abs(left[t + 1, i] - left[t, i])
        if abs(lasting) > 0.7 * abs(change) and before < 0.3 * abs(change) and after < 0.3 * abs(change):
            total += change
    return total
