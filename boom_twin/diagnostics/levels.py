"""Diagnostic levels: status of a component (REP-107) by several quantities, hysteresis, debounce time."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from math import isfinite, nan
from typing import Self

from ..config.settings import Thresholds


class Level(IntEnum):
    """Level of a component; the numbers are those of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


Value = str | int | float


@dataclass(frozen=True, slots=True)
class Status:
    """Status of one component, without the node's name. Units are at the end of the keys of `values`."""

    name: str
    level: Level
    message: str
    values: Mapping[str, Value] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Bounds:
    """Limits of the levels: upper limits, or lower limits if `low`. NaN is no limit."""

    warn: float = nan
    error: float = nan
    low: bool = False

    def level(self, value: float, held: Level, release: float) -> Level:
        """Return the level of `value`. Levels up to `held` end at `release` times their limit, or divided by it if `low`."""
        for level, limit in ((Level.ERROR, self.error), (Level.WARN, self.warn)):
            share = release if level <= held else 1.0
            if value < limit / share if self.low else value > limit * share:
                return level
        return Level.OK


class Hysteresis:
    """Level of one quantity with hysteresis and debounce time; NaN never raises it."""

    def __init__(self) -> None:
        self.level = Level.OK
        self._agreed: float | None = None

    def update(self, value: float, bounds: Bounds, thresholds: Thresholds, now: float, at_once: bool = False) -> Level:
        """Return the level at the monotonic time `now` (s); `at_once`: no debounce time for a worse level."""
        seen = bounds.level(value, self.level, thresholds.release)
        if seen == self.level or self._agreed is None:
            self._agreed = now
        raise_after = 0.0 if at_once else thresholds.raise_after
        if now - self._agreed >= (raise_after if seen > self.level else thresholds.clear_after):
            self.level, self._agreed = seen, now
        return self.level


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Thresholds and times of an evaluation: `now` (s) of a monotonic clock, `clock` (s) of the stamps' clock."""

    thresholds: Thresholds
    now: float
    clock: float


class ComponentJudge:
    """Judge of one component. Each evaluation is `begin`, any number of `check`, `note` and `fault`, `finish`.

    `level` is the last one reported, None before the first report. `at` is the present evaluation.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._hysteresis: defaultdict[str, Hysteresis] = defaultdict(Hysteresis)
        self.level: Level | None = None
        self._since = 0.0

    def begin(self, at: Evaluation) -> Self:
        """Begin a new evaluation; return this judge."""
        self.at, self._faults, self._values = at, list[tuple[Level, str]](), dict[str, Value]()
        return self

    def note(self, values: Mapping[str, Value]) -> None:
        """Report values without judging them."""
        self._values |= values

    def check(self, key: str, value: float, bounds: Bounds, words: str, at_once: bool = False) -> None:
        """Judge a value and report it with its bounds; `at_once`: no debounce time for a worse level.

        `words` describe the fault without figures: figures are in the values.
        """
        limits = {f"{key}_warn": bounds.warn, f"{key}_error": bounds.error}
        self._values |= {key: value} | {name: limit for name, limit in limits.items() if isfinite(limit)}
        level = self._hysteresis[key].update(value, bounds, self.at.thresholds, self.at.now, at_once)
        self.fault(level, words)

    def check_age(self, age: float, words: str) -> None:
        """Set the level STALE if nothing came for longer than `stale_after`. It ends with the next message."""
        limit = self.at.thresholds.stale_after
        self._values |= {"age_s": age, "age_s_stale": limit}
        if age > limit:
            self.fault(Level.STALE, words)

    def fault(self, level: Level, words: str) -> None:
        """Set a level without hysteresis."""
        if level != Level.OK:
            self._faults.append((level, words))

    def finish(self, message: str) -> Status:
        """Return the status with the worst level of this evaluation, or with `message` if all is OK."""
        faults = sorted(self._faults, key=lambda fault: -fault[0])
        level = faults[0][0] if faults else Level.OK
        if level != self.level:
            self.level, self._since = level, self.at.clock
        told = "; ".join(words for _, words in faults) or message
        return Status(self._name, level, told, {**self._values, "since_s": f"{self._since:.3f}"})
