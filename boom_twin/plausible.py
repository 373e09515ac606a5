"""Keeps single wrong strokes from the model, and holds a stroke that has fallen silent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .records import Array
from .settings import Settings

MOST = 5  # readings in a row that are not believed; the next one is
FAR = 8.0  # deviations of the noise
SILENT = 100_000_000  # ns after which a missing stroke is taken to stay where it was
NANO = 1e-9
Flags = NDArray[np.bool_]


class Plausible:
    """Looks at the strokes of one run, sample by sample.

    Attributes
    ----------
    estimate : ndarray, shape (n,), or None
        Strokes (m) as estimated at the sample before; None at the first one.
    """

    def __init__(self) -> None:
        self.estimate: Array | None = None
        self._stamp = self._trusted = self._before = 0
        self._others = 0
        self._looked_at: tuple[Array, bool] | None = None

    def is_of_others(self, stamp: int, values: Array, settings: Settings) -> bool:
        """Whether two strokes or more are where no cylinder can be: those of another boom, unless more than `MOST` agree."""
        if self._are_near(stamp, values, settings) or np.count_nonzero(self._are_far(stamp, values, settings)) < 2:
            self._others = 0
            return False
        self._others += 1
        return self._others <= MOST

    def _are_near(self, stamp: int, values: Array, settings: Settings) -> bool:
        """Whether no stroke is missing, or where its cylinder cannot be; looked at once for a sample."""
        assert self.estimate is not None
        if self._looked_at is None or self._looked_at[0] is not values:
            limit = self._limit(stamp, settings)
            pairs = zip(values.tolist(), self.estimate.tolist(), strict=True)  # of a few floats, faster than arrays
            self._looked_at = values, all(abs(value - expected) <= limit for value, expected in pairs)
        return self._looked_at[1]

    def _are_far(self, stamp: int, values: Array, settings: Settings) -> Flags:
        """Which strokes are where their cylinders cannot be; shape (n,)."""
        assert self.estimate is not None
        return np.asarray(np.abs(values - self.estimate) > self._limit(stamp, settings))

    def _limit(self, stamp: int, settings: Settings) -> float:
        """How far (m) strokes may be from their estimates."""
        limit: float = FAR * settings.stroke_variance**0.5 + settings.stroke_rate * ((stamp - self._stamp) * NANO)
        return limit

    def of(self, stamp: int, values: Array, settings: Settings) -> tuple[Array, list[str]]:
        """Strokes (m; NaN = missing), shape (n,), as the model is to take them at `stamp` (ns), and events."""
        if self.estimate is None:
            self._strange, self._seen = np.zeros(len(values), dtype=np.int64), np.full(len(values), stamp)
            self._stamp = self._trusted = stamp
            return values, []
        is_near, self._looked_at = self._are_near(stamp, values, settings), None
        if is_near:
            self._stamp = self._trusted = stamp
            return values, []
        far, self._stamp = self._are_far(stamp, values, settings), stamp
        return self._doubted(stamp, values, far)

    def _doubted(self, stamp: int, values: Array, far: Flags) -> tuple[Array, list[str]]:
        assert self.estimate is not None
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
            taken = np.where(silent, self.estimate, taken)
            events.append("held")
        return taken, events
