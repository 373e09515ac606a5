"""Predictions of the last seconds, for samples that come later than the stroke they belong to."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from .records import Array

SPAN = 2_000_000_000  # ns


class Expected(NamedTuple):
    """What sensors should read at a stamp (ns): angles (n,) rad, force (2,) m/s^2, deviations of both; strokes (n,) m."""

    stamp: int
    angles: Array
    force: Array
    angle_sigmas: Array
    force_sigmas: Array
    strokes: Array


class Memory:
    """Expected readings by stamp, the last `SPAN` of them."""

    def __init__(self) -> None:
        self._past: deque[Expected] = deque()

    def add(self, expected: Expected) -> None:
        """Remember; stamps only grow."""
        self._past.append(expected)
        while self._past[0].stamp < expected.stamp - SPAN:
            self._past.popleft()

    def at(self, stamp: int) -> Expected | None:
        """Linear between the two predictions around `stamp`, with the deviations of the later one; None outside."""
        after: Expected | None = None
        for entry in reversed(self._past):
            if entry.stamp == stamp:
                return entry
            if entry.stamp < stamp:
                return None if after is None else _between(entry, after, stamp)
            after = entry
        return None


def _between(old: Expected, new: Expected, stamp: int) -> Expected:
    share = (stamp - old.stamp) / (new.stamp - old.stamp)
    angles = old.angles + share * (new.angles - old.angles)
    force, strokes = old.force + share * (new.force - old.force), old.strokes + share * (new.strokes - old.strokes)
    return Expected(stamp, angles, force, new.angle_sigmas, new.force_sigmas, strokes)
