"""Run of the twin, from a start of the model at rest to the next start: its stamps, and its check of strokes or angles.

CHECKED, TRUSTED and OTHERS of `boom_twin.twin.state.TwinState.clock` are updated by the check.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..types import NANO, Array
from .state import CHECKED, IN_SLOT, NEWEST, NONE, OTHERS, TRUSTED, Limits, TwinState, reach_of_strokes
from .update import matched

MAX_IMPLAUSIBLE = 5  # consecutive implausible readings without a jump that are left out; the next one is used
SILENT_AFTER = 100_000_000  # ns after which a missing stroke is reported
JUMP_ACCEPTED_AFTER = 1_000_000_000  # ns after which the model restarts where a reading jumped and stayed
USUAL_RATE = 0.1  # motion during a jump: at most this share of the maximum rate, plus twice the estimated rate
Flags = NDArray[np.bool_]


class Run:
    """State of the twin since the last start from rest, in addition to `TwinState`, and check of the strokes that drive it."""

    def __init__(self, state: TwinState, stamp: int, is_again: bool) -> None:
        self.start, self.is_again, self._state, self._clock = stamp, is_again, state, state.clock
        self.is_predicted = False
        self._before = NONE  # stamp (ns) of the newest irregular sample
        self._jumped = np.zeros(0, np.int64)  # stamp (ns) of a stroke's jump; NONE without one
        state.clock[NEWEST] = stamp
        state.clock[IN_SLOT] = -1
        state.interval[:] = 0.0
        state.past.bounds[:] = 0

    @property
    def newest(self) -> int:
        """Stamp (ns) of the newest strokes that were followed."""
        return int(self._state.clock[NEWEST])

    @property
    def interval(self) -> float:
        """Running mean of the time between strokes, s."""
        return float(self._state.interval[0])

    @property
    def strokes(self) -> Array:
        """Newest strokes less their zeros, m, shape (n,); NaN where missing."""
        return self._state.strokes

    def strokes_at(self, stamp: int) -> Array | None:
        """Return the measured strokes at `stamp` (ns), linear between samples, m, shape (n,); None if not in memory."""
        past = self._state.past
        row, share = matched(past, stamp)
        if row < 0:
            return None
        old = past.strokes[row - 1]
        return np.asarray(past.strokes[row] if share == 1.0 else old + share * (past.strokes[row] - old))

    def is_of_others(self, stamp: int, values: Array, estimate: Array, limits: Limits) -> bool:
        """Return True if two or more strokes are out of reach of their cylinders, probably of another boom.

        After `MAX_IMPLAUSIBLE` such samples in a row the result is False.
        """
        limit = self._limit(stamp, limits)
        if np.count_nonzero(_are_far(values, estimate, limit)) < 2:
            self._clock[OTHERS] = 0
            return False
        self._clock[OTHERS] += 1
        return bool(self._clock[OTHERS] <= MAX_IMPLAUSIBLE)

    def _limit(self, stamp: int, limits: Limits) -> float:
        return float(reach_of_strokes(limits.far, limits.rate, stamp - int(self._clock[CHECKED])))

    def checked(
        self, stamp: int, values: Array, before: Array, estimate: Array | None, rates: Array, limits: Limits
    ) -> tuple[Array, list[str]]:
        """Return the strokes (n,) for the model, NaN = missing, and events. The caller then checks `must_restart`.

        `values` and those `before` are measured, m; `estimate` is None for the first sample of a run; `rates` (m/s) are
        estimated at the sample before. `stamp` is in ns.
        """
        if estimate is None:
            self._implausible = np.zeros(len(values), np.int64)
            self._seen = np.full(len(values), stamp)  # stamp (ns) of the newest reading used of every stroke
            self._jumped = np.full(len(values), NONE)
            self._clock[CHECKED] = self._clock[TRUSTED] = stamp
            return values, []
        limit = self._limit(stamp, limits)
        far = _are_far(values, estimate, limit)
        self._clock[CHECKED] = stamp
        if not far.any() and np.isfinite(values).all():
            self._clock[TRUSTED] = stamp
            return values, []
        if self._clock[TRUSTED] > self._before:  # a regular sample came since the last irregular one
            self._implausible[:], self._seen[:], self._jumped[:] = 0, self._clock[TRUSTED], NONE
        self._before = stamp
        step = values - before
        jumps, is_onward = np.abs(step) > limit, step * (before - estimate) > 0.0
        returned = jumps & (
            np.abs(values - estimate) <= limit + self._travel(stamp, USUAL_RATE * limits.rate + 2.0 * np.abs(rates))
        )
        is_back = self._note_jumps(stamp, far, jumps, is_onward, returned)
        return self._accepted(stamp, values, far & ~is_back)

    @property
    def must_restart(self) -> bool:
        """Return True if a stroke stays where it jumped for `JUMP_ACCEPTED_AFTER`: no motion leads there."""
        jumped = self._jumped != NONE
        return bool(jumped.any() and (self._before - self._jumped[jumped]).max() >= JUMP_ACCEPTED_AFTER)

    def _travel(self, stamp: int, rates: Array) -> Array:
        """Return the distance of each reading at these `rates` since its jump, shape (n,)."""
        elapsed = np.where(self._jumped == NONE, 0, stamp - self._jumped) * NANO
        return np.asarray(rates * elapsed)

    def _note_jumps(self, stamp: int, far: Flags, jumps: Flags, is_onward: Flags, returned: Flags) -> Flags:
        """Note the stamps of jumps; return the strokes that jumped back. A second jump onward is motion, sampled slowly."""
        is_away = self._jumped != NONE
        is_back: Flags = is_away & returned
        is_over = is_back | ~far | (is_away & jumps & is_onward)
        self._jumped = np.where(is_over, NONE, np.where(far & jumps, stamp, self._jumped))
        return is_back

    def _accepted(self, stamp: int, values: Array, far: Flags) -> tuple[Array, list[str]]:
        """Return the strokes without implausible ones, which are NaN, and events."""
        self._implausible = np.where(far, self._implausible + 1, np.where(np.isnan(values), self._implausible, 0))
        implausible = far & ((self._implausible <= MAX_IMPLAUSIBLE) | (self._jumped != NONE))
        taken = np.where(implausible, np.nan, values)
        self._implausible[far & ~implausible] = 0
        self._seen = np.where(np.isfinite(taken), stamp, self._seen)
        silent = np.isnan(taken) & (stamp - self._seen > SILENT_AFTER)
        events = ["implausible"] if implausible.any() else []
        if silent.any():
            events.append("held")
        return taken, events


def _are_far(values: Array, estimate: Array, limit: float) -> Flags:
    return np.asarray(np.abs(values - estimate) > limit)
