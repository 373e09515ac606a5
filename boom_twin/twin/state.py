"""State of the twin as arrays (stamps, expected readings, waiting samples, zeros), and the rules of a regular sample by it.

The compiled update applies the rules to every sample. `boom_twin.twin.run` applies them to irregular samples, as
Python.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..deviation.estimate_row import WIDTH
from ..deviation.sensor_model import TURN
from ..kernels.jit import by_reference, inner
from ..types import LIMIT, NANO, Array, Integers

Flags = NDArray[np.bool_]

NONE = -(2**62)  # no stamp yet, ns
WAITING = 4096  # largest number of samples that wait for a stroke
ZEROS = 16  # sets of zeros that are kept for late samples
SLOT = 100_000_000  # ns; the first prediction in each has an outline, and health is judged with it

NEWEST, CHECKED, TRUSTED, OTHERS, BESIDE, IN_SLOT, UNMATCHED, STATUS, BEGINS_SLOT, IS_DEFLECTED = range(10)  # of `clock`
FIRST, COUNT = range(2)  # of a ring


class Room(NamedTuple):
    """Rows of a twin's buffers.

    expected : expected readings of the last `SPAN`. recent : residuals for the zero of a sensor, see `ResidualBuffer`.
    samples : largest number of samples in one call of the compiled update.
    """

    expected: int = 16_384
    recent: int = 16_384
    samples: int = 4096


ROOM, FOLLOWER_ROOM = Room(), Room(1024, 1, 1024)  # for 8 kHz of strokes; for samples at 50 Hz, without requests of a zero


@by_reference
class Ring(NamedTuple):
    """Ring buffer of the newest rows of a table: `bounds` has the place of the oldest row, and the number of rows."""

    bounds: Integers
    stamps: Integers
    streams: Integers
    values: Array
    sigmas: Array
    strokes: Array


@by_reference
class TwinState(NamedTuple):
    """State of the twin between samples, beside the boom; s streams of up to w channels, c measured channels in all."""

    clock: Integers  # (10,), whole numbers by the names above; stamps in ns
    interval: Array  # (1,), running mean of the time between strokes, s; 0 while unknown
    newest: Integers  # (s,), stamp of the newest sample of every stream, ns; NONE before the first
    usual: Array  # (s,), time from one sample to the next, ns; 0 while unknown
    strokes: Array  # (n,), newest strokes or angles that drive the model, less their zeros, m or rad; NaN where missing
    taken: Array  # (n,), the same without implausible ones, which are NaN: input of the model
    past: Ring  # expected readings (c,), their deviations and the strokes, of the last `SPAN`
    waiting: Ring  # measured samples that wait for a stroke, by stamp and stream
    recent: Ring  # measured less expected, without any zero
    zeros_since: Integers  # (ZEROS,)
    zeros: Array  # (ZEROS, s, w), zeros to subtract from readings, valid from a stamp on
    zero_sets: Integers  # (1,), number of sets


@by_reference
class Limits(NamedTuple):
    """Limits that `update` checks samples against."""

    gap: int  # ns
    drive: int  # code of the stream that drives the model, of strokes (m) or angles (rad)
    far: float  # largest deviation of its readings from their estimate without motion, m or rad
    rate: float  # largest rate of its readings, m/s or rad/s
    shortest: Array  # (n,), least reading that there can be
    longest: Array  # (n,), greatest
    turns: Flags  # (n,), True if readings are known up to whole turns
    valid: float  # m, largest deflection of the tip for which the model is valid
    gravity: Array  # (2,), m/s^2
    absolute: Flags  # (n,), True if the angle sensor of a joint is an inclinometer
    absent: Flags  # (c,), measured channels without a sensor
    first: Integers  # (s,), first column of every stream among the measured channels
    channels: Integers  # (s,), number of channels of every stream; 0 if it is not used


@by_reference
class UpdateOutput(NamedTuple):
    """Buffers for the results of a call, see `boom_twin.twin.blocks`."""

    counts: Integers  # rows of predictions, and of residuals
    at: Integers
    stamps: Integers
    rows: Array  # results and estimates, see `boom_twin.kernels.result_row`
    moments: Array
    estimates: Array  # see `boom_twin.deviation.estimate_row`
    measured: Array  # strokes less their zeros, m
    residual_at: Integers
    residual_streams: Integers
    residual_stamps: Integers
    values: Array
    sigmas: Array
    raw: Array  # as measured


def drop_waiting(state: TwinState, first: int, last: int, stream: int | None = None) -> int:
    """Drop the waiting samples, of one `stream` or of all, with stamps (ns) from `first` to `last`; return their number."""
    ring = state.waiting
    count = int(ring.bounds[COUNT])
    stamps, streams = ring.stamps[:count], ring.streams[:count]
    rows = np.flatnonzero((stamps < first) | (stamps > last) | (streams != (streams if stream is None else stream)))
    for column in (ring.stamps, ring.streams, ring.values):
        column[: len(rows)] = column[rows]
    ring.bounds[COUNT] = len(rows)
    return count - len(rows)


def new_ring(size: int, values: int, sigmas: int = 0, strokes: int = 0) -> Ring:
    """Return an empty ring of `size` rows with so many columns."""
    return Ring(
        np.zeros(2, np.int64), np.zeros(size, np.int64), np.zeros(size, np.int64),
        np.zeros((size, values)), np.zeros((size, sigmas)), np.zeros((size, strokes)),
    )  # fmt: skip


def new_state(joints: int, channels: Integers, room: Room) -> TwinState:
    """Return the state of a new twin for so many joints, and so many channels in every stream."""
    streams, width, measured = len(channels), int(channels.max()), int(channels[1:].sum())
    return TwinState(
        clock=np.zeros(10, np.int64), interval=np.zeros(1),
        newest=np.full(streams, NONE), usual=np.zeros(streams),
        strokes=np.zeros(joints), taken=np.zeros(joints),
        past=new_ring(room.expected, measured, measured, joints), waiting=new_ring(WAITING, width),
        recent=new_ring(room.recent, width),
        zeros_since=np.full(ZEROS, NONE), zeros=np.zeros((ZEROS, streams, width)), zero_sets=np.ones(1, np.int64),
    )  # fmt: skip


def new_output(samples: int, joints: int, row: int, moments: int, channels: Integers) -> UpdateOutput:
    """Return empty buffers for the results of so many samples."""
    width, residuals = int(channels.max()), samples + WAITING
    return UpdateOutput(
        counts=np.zeros(2, np.int64), at=np.zeros(samples, np.int64), stamps=np.zeros(samples, np.int64),
        rows=np.zeros((samples, row)), moments=np.zeros((samples, moments)),
        estimates=np.zeros((samples, WIDTH)), measured=np.zeros((samples, joints)),
        residual_at=np.zeros(residuals, np.int64), residual_streams=np.zeros(residuals, np.int64),
        residual_stamps=np.zeros(residuals, np.int64),
        values=np.zeros((residuals, width)), sigmas=np.zeros((residuals, width)), raw=np.zeros((residuals, width)),
    )  # fmt: skip


@inner
def new_row(ring):
    """Return the place of a new row of a ring; a full ring overwrites its oldest row."""
    size, first, count = ring.stamps.shape[0], ring.bounds[FIRST], ring.bounds[COUNT]
    if count == size:
        ring.bounds[FIRST] = (first + 1) % size
        return first
    ring.bounds[COUNT] = count + 1
    return (first + count) % size


@inner
def zeros_at(state, stamp):
    """Return the number of the zeros that hold at `stamp`."""
    at = state.zero_sets[0] - 1
    while at > 0 and state.zeros_since[at] > stamp:
        at -= 1
    return at


SHORTEST_STEP = 20_000  # ns from one stroke sample of a rig to the next, at least
USUAL_STEP = 1.75  # usual intervals, largest step of a stamp that is on time
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
    """Return the largest plausible deviation (m) of a stroke from its estimate, `span` (ns) after the last check."""
    return far + rate * (span * NANO)


@inner
def are_strokes_regular(estimates, limits, state, stamp, values):
    """Return True if strokes, or angles that drive the model, are on time, complete and plausible; then store them."""
    drive = limits.drive
    if state.clock[BESIDE] or stamp - state.clock[NEWEST] < SHORTEST_STEP or state.newest[drive] == NONE:
        return False
    if not is_next(state.newest[drive], state.usual[drive], limits.gap, stamp):
        return False
    zeros = zeros_at(state, stamp)
    limit = reach_of_strokes(limits.far, limits.rate, stamp - state.clock[CHECKED])
    for i in range(state.strokes.shape[0]):
        value = near(values[i] - state.zeros[zeros, drive, i], estimates[i, 0], limits.turns[i])
        if not abs(values[i]) <= LIMIT or not limits.shortest[i] <= value <= limits.longest[i]:
            return False
        if not abs(value - estimates[i, 0]) <= limit:
            return False
    for i in range(state.strokes.shape[0]):
        state.strokes[i] = near(values[i] - state.zeros[zeros, drive, i], estimates[i, 0], limits.turns[i])
        state.taken[i] = state.strokes[i]
    state.clock[CHECKED], state.clock[TRUSTED], state.clock[OTHERS] = stamp, stamp, 0
    return True


@inner
def near(value, estimate, turns):
    """Return a reading; if it is known up to whole `turns`, the value next to its estimate."""
    return value - TURN * np.rint((value - estimate) / TURN) if turns else value


@inner
def is_regular(limits, state, stream, stamp, values):
    """Return True if a measured sample is on time and complete."""
    most, newest = longest_step(state.usual[stream], limits.gap), state.newest[stream]
    if limits.channels[stream] == 0 or (newest != NONE and not 0 < stamp - newest <= most):
        return False
    complete = True
    for i in range(limits.channels[stream]):
        complete = complete and (abs(values[i]) <= LIMIT or limits.absent[limits.first[stream] + i])
    return complete
