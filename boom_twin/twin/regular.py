"""Rules of a regular sample, each once: on time, complete, within reach of the cylinders.

The compiled update applies them to every sample; `boom_twin.twin.stamp_check` and `boom_twin.twin.run` apply them as Python to
irregular samples.
"""

from __future__ import annotations

import numpy as np

from ..deviation.sensor_model import TURN
from ..kernels.jit import inner
from ..types import LIMIT, NANO
from .state import CHECKED, EPOCH, NEWEST, NONE, OTHERS, TRUSTED, zeros_at

SHORTEST_STEP = 20_000  # ns from one stroke sample of a rig to the next, at least
USUAL_STEP = 1.75  # usual intervals; a longer one is looked at
SMOOTHING = 0.05  # weight of the newest interval in the usual one
NOISE_REACH = 8.0  # standard deviations of a stroke's noise


@inner
def is_next(newest, usual, gap, stamp):
    """Return True if a stamp (ns) comes at its usual time after the `newest`; within `gap` (ns) if no time is usual yet."""
    most = USUAL_STEP * usual
    if most == 0.0:
        most = gap
    return 0 < stamp - newest <= most


@inner
def longest_step(usual, gap):
    """Return the longest step of a stamp (ns) that needs no confirmation by the next sample."""
    return max(gap, USUAL_STEP * usual)


@inner
def smoothed(usual, span):
    """Return the usual interval (ns) after one of `span` (ns); 0 is unknown."""
    if usual != 0.0:
        return usual + SMOOTHING * (min(span, 2.0 * usual) - usual)
    return 1.0 * span


@inner
def note_stamp(state, stream, stamp):
    """Take a stream's stamp as its newest."""
    if state.newest[stream] != NONE:
        state.usual[stream] = smoothed(state.usual[stream], stamp - state.newest[stream])
    state.newest[stream] = stamp


@inner
def reach_of_strokes(far, rate, span):
    """Return how far (m) a stroke may be off its estimate `span` (ns) after the last check."""
    return far + rate * (span * NANO)


@inner
def are_strokes_regular(estimates, limits, state, stamp, values):
    """Return True if strokes, or angles that drive the model, are on time, complete and within reach; write them to `state`."""
    drive = limits.drive
    if state.held[drive] or stamp - state.clock[NEWEST] < SHORTEST_STEP or state.newest[drive] == NONE:
        return False
    if not is_next(state.newest[drive], state.usual[drive], limits.gap, stamp):
        return False
    zeros = zeros_at(state, stamp)
    time = stamp - state.clock[EPOCH]
    limit = reach_of_strokes(limits.far, limits.rate, time - state.clock[CHECKED])
    for i in range(state.strokes.shape[0]):
        value = near(values[i] - state.zeros[zeros, drive, i], estimates[i, 0], limits.turns[i])
        if not abs(values[i]) <= LIMIT or not limits.shortest[i] <= value <= limits.longest[i]:
            return False
        if not abs(value - estimates[i, 0]) <= limit:
            return False
    for i in range(state.strokes.shape[0]):
        state.strokes[i] = near(values[i] - state.zeros[zeros, drive, i], estimates[i, 0], limits.turns[i])
        state.taken[i] = state.strokes[i]
    state.clock[CHECKED], state.clock[TRUSTED], state.clock[OTHERS] = time, time, 0
    return True


@inner
def near(value, estimate, turns):
    """Return a reading; if it may be whole `turns` off, the one next to its estimate."""
    return value - TURN * np.rint((value - estimate) / TURN) if turns else value


@inner
def is_regular(limits, state, stream, stamp, values):
    """Return True if a measured sample is on time and complete."""
    most = limits.leap
    if state.usual[stream] != 0.0:
        most = longest_step(state.usual[stream], limits.gap)
    if (
        limits.channels[stream] == 0
        or state.held[stream]
        or (state.newest[stream] != NONE and not 0 < stamp - state.newest[stream] <= most)
    ):
        return False
    complete = True
    for i in range(limits.channels[stream]):
        complete = complete and (abs(values[i]) <= LIMIT or limits.absent[limits.first[stream] + i])
    return complete
