"""The level of one quantity, with hysteresis in value and in time."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

from .status import Level


@dataclass(frozen=True, slots=True)
class Bounds:
    """Above these a quantity has that level, or below these if it is `low` that is bad; NaN is no limit."""

    warn: float = nan
    error: float = nan
    low: bool = False

    def level(self, value: float, held: Level, release: float) -> Level:
        """The level of `value`, where a level that is `held` is left at `release` times its limit (if low: over `release`)."""
        for level, limit in ((Level.ERROR, self.error), (Level.WARN, self.warn)):
            share = release if level <= held else 1.0
            if value < limit / share if self.low else value > limit * share:
                return level
        return Level.OK


@dataclass(frozen=True, slots=True)
class Patience:
    """How long (s) a worse and a better level must last before it counts, and the share of a limit where it is left."""

    raise_after: float
    clear_after: float
    release: float


class Gate:
    """The level of one quantity; a NaN is no reason to change it to a worse one."""

    def __init__(self) -> None:
        self.level = Level.OK
        self._agreed: float | None = None

    def update(self, value: float, bounds: Bounds, patience: Patience, now: float) -> Level:
        """The level at the time `now` (s, of a clock that only goes forward)."""
        seen = bounds.level(value, self.level, patience.release)
        if seen == self.level or self._agreed is None:
            self._agreed = now
        wait = patience.raise_after if seen > self.level else patience.clear_after
        if now - self._agreed >= wait:
            self.level, self._agreed = seen, now
        return self.level
