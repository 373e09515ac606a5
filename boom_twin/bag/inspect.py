"""Counts and times of one topic, from its messages as they pass; what is kept does not grow with their number."""

from __future__ import annotations

import struct
from collections import Counter
from dataclasses import dataclass, field

from .cdr import names_in, stamp_in

VARIANTS = 100
"""Different lists of names that are told apart in one topic."""

NANO = 1e-9


@dataclass(slots=True)
class Tally:
    """What was seen of one topic.

    Stamps are taken where the messages begin with a header and it is not 0, log times elsewhere.

    Attributes
    ----------
    name, type : str
    stamped, named : bool
        Whether its messages begin with a header, and whether they are joint states.
    count : int
    first, last : int
        Log times, ns.
    gap, gap_after : int
        Largest step between two stamps, ns, and log time of the message before it.
    not_increasing : int
        Messages with a stamp not after that of the message before.
    unset : int
        Messages with a stamp of 0, or too short for one.
    skews : list of int
        Log time minus stamp, ns: smallest, largest and sum over `skewed` messages.
    names : Counter
        Messages by their joint names.
    unreadable : int
        Joint states whose names cannot be read.
    """

    name: str
    type: str
    stamped: bool
    named: bool
    count: int = 0
    first: int = 0
    last: int = 0
    gap: int = 0
    gap_after: int = 0
    not_increasing: int = 0
    unset: int = 0
    skewed: int = 0
    skews: list[int] = field(default_factory=lambda: [0, 0, 0])
    names: Counter[tuple[str, ...]] = field(default_factory=Counter)
    unreadable: int = 0
    _before: int | None = None
    _known: tuple[bytes, tuple[str, ...]] | None = None

    def add(self, log_time: int, data: bytes) -> None:
        """Take one message in."""
        before_this, self.last = self.last, log_time
        if self.count == 0:
            self.first = log_time
        self.count += 1
        stamp: int | None = log_time
        if self.stamped:
            stamp = stamp_in(data)
            if not stamp:
                self.unset += 1
                stamp = None
            else:
                self._compare(log_time - stamp)
        if stamp is not None:
            self._step(stamp, before_this)
        if self.named:
            self._read_names(data)

    @property
    def rate(self) -> float | None:
        """Messages per second of log time; None for fewer than two, or no time between them."""
        return (self.count - 1) / ((self.last - self.first) * NANO) if self.last > self.first else None

    def _step(self, stamp: int, log_before: int) -> None:
        if self._before is not None:
            if stamp <= self._before:
                self.not_increasing += 1
            elif stamp - self._before > self.gap:
                self.gap, self.gap_after = stamp - self._before, log_before
        self._before = stamp

    def _compare(self, skew: int) -> None:
        least, most, total = self.skews if self.skewed else (skew, skew, 0)
        self.skews = [min(least, skew), max(most, skew), total + skew]
        self.skewed += 1

    def _read_names(self, data: bytes) -> None:
        """Joint names; where they are the same bytes as before, they are not read again."""
        if self._known is None or not data.startswith(self._known[0], 12):
            try:
                names, end = names_in(data)
            except (ValueError, KeyError, struct.error):
                self.unreadable += 1
                return
            self._known = data[12:end], names
        names = self._known[1]
        if names in self.names or len(self.names) < VARIANTS:
            self.names[names] += 1
