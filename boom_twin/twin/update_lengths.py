"""Compiled update of a twin whose stroke transducers read lengths; what is common with drives is in `boom_twin.twin.update`."""

from __future__ import annotations

from ..deviation.models import take_sensor
from ..deviation.step import step_lengths, write_expected_readings, write_tip_estimate
from ..kernels.jit import inner, kernel
from ..kernels.result_row import results_in
from ..kernels.tables import OK
from ..types import NANO
from .state import BEGINS_SLOT, IS_DEFLECTED, NEWEST, STATUS, STROKES
from .update import (
    ALONE,
    DONE,
    FAILED,
    LOOK,
    ODD,
    begin_step,
    compare,
    end_step,
    flush_waiting,
    give_prediction,
    is_ordinary,
    keep_strokes,
    note_stamp,
)

ONE_PASS = 1


@kernel
def update_lengths(t, boom, live, work, p, f, bending, out, limits, state, streams, stamps, values, first, trusted, found):
    """Take the samples of a block from row `first` on, as long as they are ordinary.

    Parameters
    ----------
    t, boom, live, work, p, f, bending, out : fields of CompiledLengths
        See `boom_twin.deviation.predictor`.
    limits, state, streams, stamps, values, first, trusted, found
        As of `boom_twin.twin.update.update`.

    Returns
    -------
    reason, row : int
        See `boom_twin.twin.update.DONE`; the row that it is about.
    """
    row, pins = first, t.clearances.shape[0]
    while row < stamps.shape[0]:
        stamp, before = stamps[row], found.counts[1]
        if streams[row] != STROKES:
            if not compare(limits, state, streams[row], stamp, values[row], row, trusted, found):
                return ODD, row
            take_residuals(limits, state, p, f, before, found)
            row += 1
            continue
        if not trusted:
            if not is_ordinary(f.strokes, limits, state, stamp, values[row]):
                return ODD, row
            note_stamp(state, STROKES, stamp)
        begin_step(limits, state, stamp)
        span = (stamp - state.clock[NEWEST]) * NANO
        status = step_lengths(t, boom, live, work, p, f, span, stamp, state.taken, limits.gravity, out)
        state.clock[STATUS] = status
        if status != OK:
            return FAILED, row
        end_step(state, stamp)
        results = results_in(out, state.strokes.shape[0], pins)
        give_prediction(live, bending, out, pins, ONE_PASS, limits, state, stamp, row, found)
        past, at = state.past, keep_strokes(state, stamp)
        write_expected_readings(p, f, live, results, limits.inclination, past.values[at], past.sigmas[at])
        flush_waiting(limits, state, row, found)
        take_residuals(limits, state, p, f, before, found)
        write_tip_estimate(p, f, results, found.estimates[found.counts[0] - 1])
        row += 1
        if state.clock[BEGINS_SLOT] or state.clock[IS_DEFLECTED]:
            return LOOK, row - 1
    return DONE, row


@kernel
def measure_beside_lengths(p, f, limits, state, stream, stamp, values, trusted, found):
    """Take one measured sample, as `boom_twin.twin.update.measure` does."""
    before = found.counts[1]
    if not compare(limits, state, stream, stamp, values, ALONE, trusted, found):
        return False
    take_residuals(limits, state, p, f, before, found)
    return True


@inner
def take_residuals(limits, state, p, f, first, found):
    """Let the estimate know of the residuals from row `first` on."""
    for k in range(first, found.counts[1]):
        stream = found.residual_streams[k]
        take_sensor(p, f, stream, limits.first[stream], found.values[k], found.residual_stamps[k], state.clock[NEWEST])
