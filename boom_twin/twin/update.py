"""Compiled update of the twin by regular samples of all streams, one or many in a call.

The live node passes one sample a call, a replay many. An irregular sample ends the call, and `boom_twin.twin.sample_taker`
takes it.
"""

from __future__ import annotations

import math

import numpy as np

from ..deviation.channels import write_expected_readings
from ..deviation.mixture import renew_estimate
from ..deviation.sensor_model import TURN
from ..deviation.sensors import take_sensor
from ..deviation.step import step_lengths
from ..deviation.tip_estimate import write_tip_estimate
from ..kernels.jit import inner, kernel
from ..kernels.result_row import estimates_in, results_in
from ..kernels.tables import OK
from ..types import NANO
from .state import (
    BEGINS_SLOT,
    COUNT,
    FIRST,
    IN_SLOT,
    IS_DEFLECTED,
    NEWEST,
    SLOT,
    SMOOTHING,
    STATUS,
    UNMATCHED,
    WAITING,
    are_strokes_regular,
    is_regular,
    new_row,
    note_stamp,
    zeros_at,
)  # fmt: skip

SPAN = 2_000_000_000  # ns for which expected readings are kept

DONE, IRREGULAR, LOOK, FAILED = range(4)
"""Reasons why `update` returns. LOOK: the sample was taken, and begins a slot or is outside the model's validity. FAILED: the
model failed, see `STATUS`."""


@kernel
def update(t, boom, live, work, p, f, bending, out, limits, state, streams, stamps, values, first, trusted, found):
    """Take the samples of a block from row `first` on until one is irregular; return the reason for the end, and its row.

    `t` to `out` are the fields of `boom_twin.deviation.predictor.CompiledBoom`, one by one: tuples of tuples take long to
    compile. `streams`, `stamps`, `values` are those of a `boom_twin.twin.blocks.SampleBlock`. If `trusted`, the block has one
    row, which `SampleTaker` has checked; its strokes are in ``state.strokes`` and ``state.taken``. Results are appended to
    `found`, an `UpdateOutput`.
    """
    row, reason = first, DONE
    while row < stamps.shape[0]:
        stamp, before = stamps[row], found.counts[1]
        if streams[row] != limits.drive:
            if not compare(limits, state, f.lags, streams[row], stamp, values[row], row, trusted, found):
                reason = IRREGULAR
                break
            take_residuals(limits, state, p, f, before, found)
            row += 1
            continue
        if not trusted:
            if not are_strokes_regular(f.strokes, limits, state, stamp, values[row]):
                reason = IRREGULAR
                break
            note_stamp(state, limits.drive, stamp)
        state.clock[BEGINS_SLOT] = stamp // SLOT != state.clock[IN_SLOT]
        span = (stamp - state.clock[NEWEST]) * NANO
        status = step_lengths(t, boom, live, work, p, f, span, stamp, state.taken, limits.gravity, out)
        state.clock[STATUS] = status
        if status != OK:
            reason = FAILED
            break
        end_step(state, stamp)
        give_prediction(t.clearances.shape[0], live, bending, out, limits, state, stamp, row, found)
        if span > 0.0:
            give_innovations(f, limits, state, stamp, row, found)
        results = results_in(out, state.strokes.shape[0], t.clearances.shape[0])
        past, at = state.past, keep_strokes(state, stamp)
        write_expected_readings(p, f, live, results, stamp, span, past.values[at], past.sigmas[at])
        flush_waiting(limits, state, row, found)
        take_residuals(limits, state, p, f, before, found)
        write_tip_estimate(p, f, live, results, found.estimates[found.counts[0] - 1])
        row += 1
        if state.clock[BEGINS_SLOT] or state.clock[IS_DEFLECTED]:
            reason, row = LOOK, row - 1
            break
    renew_estimate(p, f)
    return reason, row


@inner
def take_residuals(limits, state, p, f, first, found):
    """Correct the estimate by the residuals from row `first` on."""
    for k in range(first, found.counts[1]):
        stream = found.residual_streams[k]
        if stream != limits.drive:
            take_sensor(p, f, stream, limits.first[stream], found.values[k], found.residual_stamps[k], state.clock[NEWEST])


# -- strokes --------------------------------------------------------------------------------------------------------------


@inner
def end_step(state, stamp):
    """Update the running mean of the interval, the slot and the newest stamp after a step to `stamp` (ns)."""
    span = (stamp - state.clock[NEWEST]) * NANO
    if state.interval[0] != 0.0:
        state.interval[0] += SMOOTHING * (span - state.interval[0])
    else:
        state.interval[0] = span
    state.clock[IN_SLOT], state.clock[NEWEST] = stamp // SLOT, stamp


@inner
def give_prediction(pins, live, bending, out, limits, state, stamp, row, found):
    """Append the newest prediction with its bending moments; set `IS_DEFLECTED` if the deflection exceeds ``limits.valid``."""
    n, k = state.strokes.shape[0], found.counts[0]
    results, estimates = results_in(out, n, pins), estimates_in(out, n, pins)
    found.at[k], found.stamps[k] = row, stamp
    for i in range(out.shape[0]):
        found.rows[k, i] = out[i]
    for i in range(n):
        found.measured[k, i] = state.strokes[i]
    for i in range(found.moments.shape[1]):
        moment = 0.0
        for j in range(live.z.shape[0]):
            moment += bending[i, j] * live.z[j]
        found.moments[k, i] = moment
    found.counts[0] = k + 1
    off = math.hypot(results.tip[0, 0] - estimates.rigid_tip[0], results.tip[0, 1] - estimates.rigid_tip[1])
    state.clock[IS_DEFLECTED] = off > limits.valid


@inner
def give_innovations(f, limits, state, stamp, row, found):
    """Append the innovations of the sample that drives the model."""
    k = new_residual(found, row, limits.drive, stamp)
    for i in range(state.taken.shape[0]):
        found.values[k, i], found.sigmas[k, i] = f.innovations[i, 0], math.sqrt(f.innovations[i, 1])
        found.raw[k, i] = state.taken[i]


@inner
def new_residual(found, row, stream, stamp):
    """Append an empty residual of the sample at `stamp` (ns), computed with sample `row` of the block; return its place."""
    k = found.counts[1]
    found.residual_at[k], found.residual_streams[k], found.residual_stamps[k] = row, stream, stamp
    for i in range(found.values.shape[1]):
        found.values[k, i] = found.sigmas[k, i] = found.raw[k, i] = math.nan
    found.counts[1] = k + 1
    return k


@inner
def keep_strokes(state, stamp):
    """Append the newest strokes to those of the last `SPAN`; return their row in ``state.past``."""
    past = state.past
    while past.bounds[COUNT] > 0 and past.stamps[past.bounds[FIRST]] < stamp - SPAN:
        past.bounds[FIRST] = (past.bounds[FIRST] + 1) % past.stamps.shape[0]
        past.bounds[COUNT] -= 1
    at = new_row(past)
    past.stamps[at] = stamp
    for i in range(state.strokes.shape[0]):
        past.strokes[at, i] = state.strokes[i]
    return at


# -- measured angles and accelerations --------------------------------------------------------------------------------------


@inner
def compare(limits, state, lags, stream, stamp, values, row, trusted, found):
    """Append the residuals of a measured sample, or store it until its strokes come; return False if it is irregular.

    Its stamp is corrected by the estimated lag of its stream. An irregular sample changes nothing.
    """
    if not trusted and not is_regular(limits, state, stream, stamp, values):
        return False
    taken = stamp - np.int64(np.rint(lags[stream] / NANO))
    if taken > state.clock[NEWEST]:
        if state.waiting.bounds[COUNT] == WAITING:
            forget_waiting(state.waiting, 1)
            state.clock[UNMATCHED] += 1
        wait(limits, state, stream, taken, values)
    elif not write_residual(limits, state, stream, taken, values, row, found):
        return False
    if not trusted:
        note_stamp(state, stream, stamp)
    return True


@inner
def wait(limits, state, stream, stamp, values):
    """Insert a measured sample into the waiting samples, sorted by stamp, then by stream."""
    ring = state.waiting
    at = ring.bounds[COUNT]
    while at > 0 and (ring.stamps[at - 1] > stamp or (ring.stamps[at - 1] == stamp and ring.streams[at - 1] > stream)):
        move_row(ring, at - 1, at)
        at -= 1
    ring.stamps[at], ring.streams[at] = stamp, stream
    for i in range(limits.channels[stream]):
        ring.values[at, i] = values[i]
    ring.bounds[COUNT] += 1


@inner
def move_row(ring, old, new):
    """Copy a row of the waiting samples."""
    ring.stamps[new], ring.streams[new] = ring.stamps[old], ring.streams[old]
    for i in range(ring.values.shape[1]):
        ring.values[new, i] = ring.values[old, i]


@inner
def flush_waiting(limits, state, row, found):
    """Append the residuals of all waiting samples up to the newest stroke, and remove these samples."""
    ring, done = state.waiting, 0
    while done < ring.bounds[COUNT] and ring.stamps[done] <= state.clock[NEWEST]:
        if not write_residual(limits, state, ring.streams[done], ring.stamps[done], ring.values[done], row, found):
            state.clock[UNMATCHED] += 1
        done += 1
    if done > 0:
        forget_waiting(ring, done)


@inner
def forget_waiting(ring, count):
    """Remove the first `count` waiting samples."""
    for k in range(count, ring.bounds[COUNT]):
        move_row(ring, k, k - count)
    ring.bounds[COUNT] -= count


@kernel
def write_residual(limits, state, stream, stamp, values, row, found):
    """Append the residuals of one sample to the readings expected at its stamp; return False if these are not in memory."""
    after, share = matched(state.past, stamp)
    if after < 0:
        return False
    zeros = zeros_at(state, stamp)
    past, at, k = state.past, limits.first[stream], new_residual(found, row, stream, stamp)
    before = (after if after > 0 else past.stamps.shape[0]) - 1
    recent = new_row(state.recent)
    state.recent.stamps[recent], state.recent.streams[recent] = stamp, stream
    for i in range(limits.channels[stream]):
        expected = past.values[after, at + i]
        if share < 1.0:
            old = past.values[before, at + i]
            expected = old + share * (expected - old)
        value = values[i] - expected
        if at + i < limits.absolute.shape[0] and limits.absolute[at + i]:
            value -= TURN * np.rint(value / TURN)
        state.recent.values[recent, i] = value
        found.values[k, i], found.sigmas[k, i] = value - state.zeros[zeros, stream, i], past.sigmas[after, at + i]
        found.raw[k, i] = values[i]
    return True


@kernel
def matched(past, stamp):
    """Return the first row of expected readings not before `stamp`, and its weight in the interpolation with the row before.

    The weight is 1 at the stamp of the row, 0 at that of the row before. The row is -1 if no rows surround `stamp`.
    """
    at = -1
    for back in range(past.bounds[COUNT]):
        row = (past.bounds[FIRST] + past.bounds[COUNT] - 1 - back) % past.stamps.shape[0]
        if past.stamps[row] == stamp:
            return row, 1.0
        if past.stamps[row] < stamp:
            if at < 0:
                return -1, 0.0
            return at, (stamp - past.stamps[row]) / (past.stamps[at] - past.stamps[row])
        at = row
    return -1, 0.0
