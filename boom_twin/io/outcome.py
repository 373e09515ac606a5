"""What a rescue of a damaged session brought."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from .salvage import Fault

MOST_FAULTS = 1000
"""Faults that are told one by one."""


@dataclass(slots=True)
class Outcome:
    """What a rescue brought.

    Attributes
    ----------
    saved : Counter
        Messages by topic, counted in the new session after it was written.
    unvouched : Counter
        Those of them that were under no checksum.
    lost : dict of str to int, or None
        By topic; None where no sound count of the source says how many there were.
    nameless : int
        Sound messages that were left out, because the definition of their topic is lost.
    copies : int
        Messages that were left out, because they stand in a chunk that is the copy of one before it.
    faults : list of (Path, Fault)
        The first `MOST_FAULTS`.
    fault_count : int
    """

    saved: Counter[str] = field(default_factory=Counter)
    unvouched: Counter[str] = field(default_factory=Counter)
    lost: dict[str, int] | None = None
    nameless: int = 0
    copies: int = 0
    faults: list[tuple[Path, Fault]] = field(default_factory=list)
    fault_count: int = 0

    def note(self, path: Path, fault: Fault) -> None:
        """Count a fault; the first ones are kept."""
        self.fault_count += 1
        if len(self.faults) < MOST_FAULTS:
            self.faults.append((path, fault))
