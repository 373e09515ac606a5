"""One run of the twin: from a start of the model at rest to the next one."""

from __future__ import annotations

import numpy as np

from ..types import Array
from .state import EPOCH, IN_SLOT, NEWEST, TwinState
from .stroke_check import StrokeCheck
from .update import matched


class Run:
    """State of the twin since the boom last started from rest, in addition to `TwinState`."""

    def __init__(self, state: TwinState, stamp: int, is_again: bool) -> None:
        self.is_again, self._state = is_again, state
        self.plausible = StrokeCheck(state.clock)
        self.is_predicted = False
        state.clock[EPOCH] = state.clock[NEWEST] = stamp
        state.clock[IN_SLOT] = -1
        state.interval[:] = 0.0
        state.past.bounds[:] = 0

    @property
    def epoch(self) -> int:
        """Stamp (ns) of the start."""
        return int(self._state.clock[EPOCH])

    @property
    def newest(self) -> int:
        """Stamp (ns) of the newest strokes that were followed."""
        return int(self._state.clock[NEWEST])

    @property
    def interval(self) -> float:
        """Running mean of the time between strokes, s."""
        return float(self._state.interval[0])

    @property
    def strokes(self) -> Array:
        """Newest strokes less their zeros, m, shape (n,); NaN where missing."""
        return self._state.strokes

    def strokes_at(self, stamp: int) -> Array | None:
        """Return the measured strokes at `stamp` (ns), linear between samples, m, shape (n,); None if not in memory."""
        past = self._state.past
        row, share = matched(past, stamp)
        if row < 0:
            return None
        old = past.strokes[row - 1]
        return np.asarray(past.strokes[row] if share == 1.0 else old + share * (past.strokes[row] - old))

    def rebase(self, shift: int) -> None:
        """Shift all stamps by `shift` (ns); discard what is stored by stamp."""
        self._state.clock[EPOCH] += shift
        self._state.clock[NEWEST] += shift
        self._state.past.bounds[:] = 0
