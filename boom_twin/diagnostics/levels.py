"""Several quantities of one component judged into one status."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from math import isfinite

from ..thresholds import Thresholds
from .gate import Bounds, Gate, Patience
from .status import Level, Status


class Judge:
    """Judges one component again and again: `begin`, any number of `check` and `note`, `finish`.

    Parameters
    ----------
    name : str
        Of the component.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._gates: defaultdict[str, Gate] = defaultdict(Gate)
        self._words: dict[str, str] = {}
        self._level: Level | None = None
        self._since = 0.0

    @property
    def level(self) -> Level | None:
        """As it was told last; None before."""
        return self._level

    def begin(self, now: float, thresholds: Thresholds) -> None:
        """A new look, at the time `now` (s, of a clock that only goes forward)."""
        self._now = now
        self._patience = Patience(thresholds.raise_after, thresholds.clear_after, thresholds.release)
        self._faults: list[tuple[Level, str]] = []
        self._values: dict[str, str | int | float] = {}

    def note(self, key: str, value: str | int | float) -> None:
        """Tell a value that is not judged."""
        self._values[key] = value

    def check(self, key: str, value: float, bounds: Bounds, words: str, at_once: bool = False) -> None:
        """Judge a value, and tell it with its bounds.

        Parameters
        ----------
        key : str
        value : float
        bounds : Bounds
        words : str
            What is wrong if it is; those that were true last are told as long as the level is held.
        at_once : bool
            A worse level counts at once.
        """
        self._values[key] = value
        for name, limit in (("warn", bounds.warn), ("error", bounds.error)):
            if isfinite(limit):
                self._values[f"{key}_{name}"] = limit
        if bounds.level(value, Level.OK, 1.0) != Level.OK:
            self._words[key] = words
        patience = replace(self._patience, raise_after=0.0) if at_once else self._patience
        level = self._gates[key].update(value, bounds, patience, self._now)
        self.fault(level, self._words.get(key, words))

    def check_age(self, age: float, limit: float, words: str) -> None:
        """Stale if nothing came for longer than `limit`, s; with the next message all is well."""
        self._values |= {"age_s": age, "age_s_stale": limit}
        if age > limit:
            self.fault(Level.STALE, words)

    def fault(self, level: Level, words: str) -> None:
        """A level that needs no judging."""
        if level != Level.OK:
            self._faults.append((level, words))

    def finish(self, clock: float, message: str) -> Status:
        """The worst of it; `message` if all is well. `clock` (s) is the time that people know, for ``since_s``."""
        faults = sorted(self._faults, key=lambda fault: -fault[0])
        level = faults[0][0] if faults else Level.OK
        if level != self._level:
            self._level, self._since = level, clock
        told = "; ".join(words for _, words in faults) or message
        return Status(self.name, level, told, {**self._values, "since_s": f"{self._since:.3f}"})
