"""Check strokes, or angles that drive the model, against what the boom can do: range and rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..types import NANO, Array
from .regular import reach_of_strokes
from .state import CHECKED, OTHERS, TRUSTED, Limits

MOST_DOUBTED = 5  # implausible readings in a row, without a jump, that are left out; the next one is accepted
SILENT_AFTER = 100_000_000  # ns after which a missing stroke is reported
BELIEVED_AFTER = 1_000_000_000  # ns after which readings that stay where they jumped are accepted
USUAL_RATE = 0.1  # share of the maximum rate; with twice the estimated rate it bounds the motion between jump and return
NEVER = -1
Flags = NDArray[np.bool_]


class StrokeCheck:
    """Check of strokes or angles that drive the model in one run, against the estimates (n,) at the sample before.

    Parameters
    ----------
    clock : ndarray of int64
        Clock of `boom_twin.twin.state.TwinState`; CHECKED, TRUSTED and OTHERS are updated.
    """

    def __init__(self, clock: NDArray[np.int64]) -> None:
        self._clock = clock
        self._before = 0
        self._jumped = np.zeros(0, np.int64)  # stamp (ns) of a stroke's jump; NEVER without one

    def is_of_others(self, stamp: int, values: Array, estimate: Array, limits: Limits) -> bool:
        """Return True if two or more strokes are out of reach of their cylinders, probably of another boom.

        After `MOST_DOUBTED` such samples in a row the result is False.
        """
        limit = self._limit(stamp, limits)
        if np.count_nonzero(_are_far(values, estimate, limit)) < 2:
            self._clock[OTHERS] = 0
            return False
        self._clock[OTHERS] += 1
        return bool(self._clock[OTHERS] <= MOST_DOUBTED)

    def _limit(self, stamp: int, limits: Limits) -> float:
        """Return the allowed difference of readings from their estimates."""
        return float(reach_of_strokes(limits.far, limits.rate, stamp - int(self._clock[CHECKED])))

    def of(
        self, stamp: int, values: Array, before: Array, estimate: Array | None, rates: Array, limits: Limits
    ) -> tuple[Array, list[str]]:
        """Return the strokes for the model, and events. If `must_restart` is then True, the model cannot follow them.

        Parameters
        ----------
        stamp : int
            ns.
        values, before : ndarray, shape (n,)
            Measured now and in the sample before, m; NaN = missing.
        estimate : ndarray, shape (n,), or None
            Estimated strokes, m; None for the first sample of a run.
        rates : ndarray, shape (n,)
            Rates of the strokes estimated at the sample before, m/s.
        limits : Limits

        Returns
        -------
        ndarray, shape (n,)
            m; NaN = missing.
        list of str
        """
        if estimate is None:
            self._strange, self._seen = np.zeros(len(values), dtype=np.int64), np.full(len(values), stamp)
            self._jumped = np.full(len(values), NEVER)
            self._clock[CHECKED] = self._clock[TRUSTED] = stamp
            return values, []
        limit = self._limit(stamp, limits)
        far = _are_far(values, estimate, limit)
        self._clock[CHECKED] = stamp
        if not far.any() and np.isfinite(values).all():
            self._clock[TRUSTED] = stamp
            return values, []
        if self._clock[TRUSTED] > self._before:  # a regular sample came since the last irregular one
            self._strange[:], self._seen[:], self._jumped[:] = 0, self._clock[TRUSTED], NEVER
        self._before = stamp
        step = values - before
        jumps, is_onward = np.abs(step) > limit, step * (before - estimate) > 0.0
        returned = jumps & (
            np.abs(values - estimate) <= limit + self._gone(stamp, USUAL_RATE * limits.rate + 2.0 * np.abs(rates))
        )
        is_back = self._note_jumps(stamp, far, jumps, is_onward, returned)
        return self._doubted(stamp, values, far & ~is_back)

    @property
    def must_restart(self) -> bool:
        """Return True if a stroke has stayed where it jumped for `BELIEVED_AFTER`.

        The model must restart, because no motion leads there.
        """
        jumped = self._jumped != NEVER
        return bool(jumped.any() and (self._before - self._jumped[jumped]).max() >= BELIEVED_AFTER)

    def _gone(self, stamp: int, rates: Array) -> Array:
        """Return the distance of each reading at these `rates` since its jump, shape (n,)."""
        elapsed = np.where(self._jumped == NEVER, 0, stamp - self._jumped) * NANO
        return np.asarray(rates * elapsed)

    def _note_jumps(self, stamp: int, far: Flags, jumps: Flags, is_onward: Flags, returned: Flags) -> Flags:
        """Update the record of strokes that jumped; return those that jumped back.

        A second jump in the same direction is motion of the cylinder, reported by a slow sensor.
        """
        is_away = self._jumped != NEVER
        is_back: Flags = is_away & returned
        is_over = is_back | ~far | (is_away & jumps & is_onward)
        self._jumped = np.where(is_over, NEVER, np.where(far & jumps, stamp, self._jumped))
        return is_back

    def _doubted(self, stamp: int, values: Array, far: Flags) -> tuple[Array, list[str]]:
        self._strange = np.where(far, self._strange + 1, np.where(np.isnan(values), self._strange, 0))
        implausible = far & ((self._strange <= MOST_DOUBTED) | (self._jumped != NEVER))
        taken = np.where(implausible, np.nan, values)
        self._strange[far & ~implausible] = 0
        self._seen = np.where(np.isfinite(taken), stamp, self._seen)
        silent = np.isnan(taken) & (stamp - self._seen > SILENT_AFTER)
        events = ["implausible"] if implausible.any() else []
        if silent.any():
            events.append("held")
        return taken, events


def _are_far(values: Array, estimate: Array, limit: float) -> Flags:
    """Return True for strokes further than `limit` (m) from their estimates; shape (n,)."""
    return np.asarray(np.abs(values - estimate) > limit)
