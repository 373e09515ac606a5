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
        self._away: tuple[Array, Array, float, bool] | None = None

    def is_of_others(self, stamp: int, values: Array, settings: Settings) -> bool:
        """Whether two strokes or more are where no cylinder can be: those of another boom, unless more than `MOST` agree."""
        away, limit, is_near = self._distances(stamp, values, settings)
        if is_near or np.count_nonzero(away > limit) < 2:
            self._others = 0
            return False
        self._others += 1
        return self._others <= MOST

    def _distances(self, stamp: int, values: Array, settings: Settings) -> tuple[Array, float, bool]:
        """From the estimates (n,), how far strokes may be from them, m, and whether all are within; once for a sample."""
        assert self.estimate is not None
        if self._away is None or self._away[0] is not values:
            span = (stamp - self._stamp) * NANO
            limit = FAR * settings.stroke_variance**0.5 + settings.stroke_rate * span
            away = np.abs(values - self.estimate)
            self._away = values, away, limit, bool(np.maximum.reduce(away) <= limit)
        return self._away[1:]

    def of(self, stamp: int, values: Array, settings: Settings) -> tuple[Array, list[str]]:
        """Strokes (m; NaN = missing), shape (n,), as the model is to take them at `stamp` (ns), and events."""
        if self.estimate is None:
            self._strange, self._seen = np.zeros(len(values), dtype=np.int64), np.full(len(values), stamp)
            self._stamp = self._trusted = stamp
            return values, []
        away, limit, is_near = self._distances(stamp, values, settings)
        self._stamp, self._away = stamp, None
        if is_near:
            self._trusted = stamp
            return values, []
        return self._doubted(stamp, values, away > limit)

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
