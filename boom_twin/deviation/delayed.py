"""Readings of late streams as states of the estimate.

A reading that arrives late belongs to a state of the past. When the boom passes an instant, the reading expected there from
a late sensor is copied into the state vector, with its covariance (stochastic cloning: S. Roumeliotis and J. Burdick, Proc.
IEEE Int. Conf. Robotics and Automation 2002, 1788-1795). A copy has no dynamics. All later readings correct it as they correct
the other states, as in a fixed-lag smoother, and the late reading is a reading of the copy. At copied instants this is exact
for a linear filter: the order of arrival does not change the estimate. A reading between two copied instants is compared with
the linear interpolation of both copies.
"""

from __future__ import annotations

from ..kernels.jit import inner
from .rows import clear, difference, read, spread_of
from .states import ALL_BURST, ALL_VALVES, DELAYED, ESTIMATE, FED, PREDICTION, all_states, copy_place

FEWEST_INSTANTS = 4  # that must fit into `DELAYED` states; a late stream that would leave fewer is not copied
NEAREST = 4e6  # ns from one instant to the next, at least: a tenth of the period of the fastest mode
EARLIEST = -(2**62)  # ns


@inner
def copy_width(f):
    """Return how many channels are late: the number of states of one instant."""
    width = 0
    for c in range(f.copies.shape[0]):
        width = max(width, f.copies[c] + 1)
    return width


@inner
def note_lateness(p, f, stream, first, last, age):
    """Note that a sample of channels `first` to `last` - 1 is `age` (s) old.

    If these channels were not late before, all copies are discarded, because each instant now needs more states.
    """
    width = copy_width(f)
    if f.copies[first] < 0 and (width + last - first) * FEWEST_INSTANTS <= DELAYED:
        for c in range(first, last):
            f.copies[c] = width + c - first
        p.delayed[0] = 0
    f.late[stream] = max(f.late[stream], age)


@inner
def instant_to(f, count, stamp):
    """Return the latest of the instants up to `stamp`; -1 if there is none."""
    found = -1
    for k in range(count):
        if f.instants[k] <= stamp and (found < 0 or f.instants[k] > f.instants[found]):
            found = k
    return found


@inner
def instant_beyond(f, count, stamp):
    """Return the earliest of the instants after `stamp`; -1 if there is none."""
    found = -1
    for k in range(count):
        if f.instants[k] > stamp and (found < 0 or f.instants[k] < f.instants[found]):
            found = k
    return found


@inner
def begin_instant(p, f, stamp):
    """Make room for the copies at the newest instant; return its first state, -1 without late streams.

    The newest instant is replaced if it is nearer than `NEAREST` to the one before, or if instants at this
    spacing could not span the longest lateness.
    """
    width = copy_width(f)
    if width == 0 or f.status[FED] == 0:
        return -1
    count, room, longest = p.delayed[0] // width, DELAYED // width, 0.0
    for stream in range(f.late.shape[0]):
        longest = max(longest, 1e9 * f.late[stream])
    at, newest = count, instant_to(f, count, stamp)
    if count > 1:
        second = instant_to(f, count, f.instants[newest] - 1)
        oldest = instant_beyond(f, count, EARLIEST)
        following = instant_beyond(f, count, f.instants[oldest])
        if f.instants[newest] - f.instants[second] < max(NEAREST, longest / (room - 2)):
            at = newest
        elif count == room or f.instants[following] < stamp - longest:
            at = oldest
    f.instants[at], p.delayed[0] = stamp, max(p.delayed[0], (at + 1) * width)
    return copy_place(p) + at * width


@inner
def copy_reading(p, f, at, value):
    """Set state `at` of the estimate to the reading of `f.row`, predicted as `value`."""
    every = all_states(p)
    f.mean[PREDICTION, at] = value
    for k in range(ALL_VALVES, ALL_BURST + 1):
        copy_to(f, f.x[k], f.p[k], at, every)
    copy_to(f, f.mean[ESTIMATE], f.spread[ESTIMATE], at, every)


@inner
def copy_to(f, x, covariance, at, every):
    """Set state `at`, and its row and column of the covariance, to the reading with the coefficients `f.row`."""
    spread_of(f.row, covariance, f.gain, every)
    x[at] = f.mean[PREDICTION, at] + difference(f.row, x, f.mean[PREDICTION], every)
    f.gain[at] = read(f.row, f.gain, every)
    for i in range(every):
        covariance[at, i] = covariance[i, at] = f.gain[i]


@inner
def delayed_row(p, f, c, stamp, row, rates):
    """Write the row of late channel `c` at `stamp` (ns), and the row of its rate.

    Return the time (s) between the instants around it and its place between them, from 0 to 1; 0 s if it was not copied.
    """
    width, every = copy_width(f), all_states(p)
    count = p.delayed[0] // max(width, 1)
    before, after = instant_to(f, count, stamp), instant_beyond(f, count, stamp)
    if f.copies[c] < 0 or before < 0 or after < 0:
        return 0.0, 0.0
    clear(row, every)
    clear(rates, every)
    span, first = 1e-9 * (f.instants[after] - f.instants[before]), copy_place(p) + f.copies[c]
    share = 1e-9 * (stamp - f.instants[before]) / span
    row[first + before * width], row[first + after * width] = 1.0 - share, share
    rates[first + before * width], rates[first + after * width] = -1.0 / span, 1.0 / span
    return span, share
