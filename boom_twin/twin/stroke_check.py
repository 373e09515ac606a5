"""Check strokes against what the cylinders can do: range, rate and, with a baseline, the angles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..config.settings import Settings
from ..types import NANO, Array

MOST = 5  # readings in a row that are not believed; the next one is
FAR = 8.0  # deviations of the noise
SILENT = 100_000_000  # ns after which a missing stroke is taken to stay where it was
Flags = NDArray[np.bool_]


class StrokeCheck:
    """Looks at the strokes of one run, sample by sample; each beside what was estimated (m, shape (n,)) at the one before."""

    def __init__(self) -> None:
        self._stamp = self._trusted = self._before = 0
        self._others = 0
        self._looked_at: tuple[Array, float, bool] | None = None

    def is_of_others(self, stamp: int, values: Array, estimate: Array, settings: Settings) -> bool:
        """Whether two strokes or more are where no cylinder can be: those of another boom, unless more than `MOST` agree."""
        limit, is_near = self._look(stamp, values, estimate, settings)
        if is_near or np.count_nonzero(_are_far(values, estimate, limit)) < 2:
            self._others = 0
            return False
        self._others += 1
        return self._others <= MOST

    def _look(self, stamp: int, values: Array, estimate: Array, settings: Settings) -> tuple[float, bool]:
        """How far strokes may be from their estimates, m, and whether none is further or missing; once for a sample."""
        if self._looked_at is None or self._looked_at[0] is not values:
            span = (stamp - self._stamp) * NANO
            limit = FAR * settings.stroke_variance**0.5 + settings.stroke_rate * span
            pairs = zip(values.tolist(), estimate.tolist(), strict=True)  # few: faster one by one than as arrays
            self._looked_at = values, limit, all(abs(value - expected) <= limit for value, expected in pairs)
        return self._looked_at[1:]

    def of(self, stamp: int, values: Array, estimate: Array | None, settings: Settings) -> tuple[Array, list[str]]:
        """Strokes (m; NaN = missing), shape (n,), as the model is to take them at `stamp` (ns), and events.

        There is no estimate for the first sample of a run.
        """
        if estimate is None:
            self._strange, self._seen = np.zeros(len(values), dtype=np.int64), np.full(len(values), stamp)
            self._stamp = self._trusted = stamp
            return values, []
        limit, is_near = self._look(stamp, values, estimate, settings)
        self._stamp, self._looked_at = stamp, None
        if is_near:
            self._trusted = stamp
            return values, []
        return self._doubted(stamp, values, estimate, _are_far(values, estimate, limit))

    def _doubted(self, stamp: int, values: Array, estimate: Array, far: Flags) -> tuple[Array, list[str]]:
        if self._trusted > self._before:  # all were well since the last doubt
            self._strange[:], self._seen[:] = 0, self._trusted
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
