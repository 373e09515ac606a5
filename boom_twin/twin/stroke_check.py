"""Check strokes against what the cylinders can do: range, rate and, with a baseline, the angles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..config.settings import Settings
from ..types import NANO, Array
from .state import CHECKED, OTHERS, TRUSTED

MOST = 5  # readings in a row that are not believed; the next one is
FAR = 8.0  # deviations of the noise
SILENT = 100_000_000  # ns after which a missing stroke is taken to stay where it was
Flags = NDArray[np.bool_]


class StrokeCheck:
    """Looks at the strokes of one run, sample by sample; each beside what was estimated (m, shape (n,)) at the one before.

    Parameters
    ----------
    clock : ndarray of int64
        Where it keeps CHECKED, TRUSTED and OTHERS, see `boom_twin.twin.state.TwinState`.
    """

    def __init__(self, clock: NDArray[np.int64]) -> None:
        self._clock = clock
        self._before = 0

    def is_of_others(self, stamp: int, values: Array, estimate: Array, settings: Settings) -> bool:
        """Whether two strokes or more are where no cylinder can be: those of another boom, unless more than `MOST` agree."""
        limit = self._limit(stamp, settings)
        if np.count_nonzero(_are_far(values, estimate, limit)) < 2:
            self._clock[OTHERS] = 0
            return False
        self._clock[OTHERS] += 1
        return bool(self._clock[OTHERS] <= MOST)

    def _limit(self, stamp: int, settings: Settings) -> float:
        """How far strokes may be from their estimates, m."""
        span = (stamp - int(self._clock[CHECKED])) * NANO
        return float(FAR * settings.stroke_variance**0.5 + settings.stroke_rate * span)

    def of(self, stamp: int, values: Array, estimate: Array | None, settings: Settings) -> tuple[Array, list[str]]:
        """Strokes (m; NaN = missing), shape (n,), as the model is to take them at `stamp` (ns), and events.

        There is no estimate for the first sample of a run.
        """
        if estimate is None:
            self._strange, self._seen = np.zeros(len(values), dtype=np.int64), np.full(len(values), stamp)
            self._clock[CHECKED] = self._clock[TRUSTED] = stamp
            return values, []
        far = _are_far(values, estimate, self._limit(stamp, settings))
        self._clock[CHECKED] = stamp
        if not far.any() and np.isfinite(values).all():
            self._clock[TRUSTED] = stamp
            return values, []
        return self._doubted(stamp, values, estimate, far)

    def _doubted(self, stamp: int, values: Array, estimate: Array, far: Flags) -> tuple[Array, list[str]]:
        if self._clock[TRUSTED] > self._before:  # all were well since the last doubt
            self._strange[:], self._seen[:] = 0, self._clock[TRUSTED]
        self._before = stamp
        self._strange = np.where(far, self._strange + 1, np.where(np.isnan(values), self._strange, 0))
        implausible = far & (self._strange <= MOST)
        taken = np.where(implausible, np.nan, values)
        self._strange[far & ~implausible] = 0
        self._seen = np.where(np.isfinite(taken), stamp, self._seen)
        silent = np.isnan(taken) & (stamp - self._seen > SILENT)
        events = ["implausible"] if implausible.any() else []
        if silent.any():
            taken = np.where(silent, estimate, taken)
            events.append("held")
        return taken, events


def _are_far(values: Array, estimate: Array, limit: float) -> Flags:
    """Which strokes are further than `limit` (m) from their estimates; shape (n,)."""
    return np.asarray(np.abs(values - estimate) > limit)
