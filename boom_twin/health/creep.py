"""Monitor of cylinders that creep: their lengths change slowly and evenly, unlike a move by an operator.

A leak makes a cylinder creep, and its joint turns. If the angle sensor shows no turn, the stroke transducer drifts.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np

from ..scene.kinematics import strokes_of_angles
from ..scene.schema import Scene
from ..types import SECOND, Alarm, Array, Stream
from .alarms import change_text

SPAN, PARTS = 12, 4  # s of a window, several periods of a pump; equal parts of it whose means are compared
UNEVEN = 0.4  # largest relative difference of the rates between parts, and of the rates by length and by angle
SWING = 1e-3  # m, largest change of a mean length from second to second by pump and wind; short moves change it by more
SLOWEST, FASTEST = 1e-4, 3e-3  # m/s, rates of creeping: above noise, and below the moves of an operator
CREPT = 4e-3  # m, least change of length for an alarm: a softening oil spring changes it by less


class CreepMonitor:
    """Monitor of mean lengths and angles of each second.

    Attributes
    ----------
    creeping : dict of int to int
        Onset (ns) by creeping cylinder (from 0).
    """

    def __init__(self, scene: Scene) -> None:
        self._scene, self.creeping = scene, dict[int, int]()
        self._seconds: deque[tuple[int, Array]] = deque(maxlen=SPAN)
        self._alarms: dict[int, Alarm] = {}  # by cylinder

    def take(self, stamp: int, block: Any) -> list[Alarm]:
        """Take the samples of a second that begins at a stamp (ns); return the alarms that end or begin."""
        if self._seconds and stamp - self._seconds[-1][0] != SECOND:
            self._seconds.clear()
        count, codes = len(self._scene.joints), list(Stream)
        both = (block.values[block.streams == codes.index(stream), :count] for stream in (Stream.STROKES, Stream.ANGLES))
        with np.errstate(invalid="ignore"):  # means of no readings are NaN
            lengths, angles = (np.nansum(rows, axis=0) / np.isfinite(rows).sum(axis=0) for rows in both)
        self._seconds.append((stamp, np.stack([lengths, strokes_of_angles(self._scene, angles)])))
        begun = self._begun(stamp + SECOND)
        ended = [replace(self._alarms.pop(i), until=stamp) for i in [*self._alarms] if i not in self.creeping]
        self._alarms |= begun
        return [*ended, *begun.values()]

    def _begun(self, now: int) -> dict[int, Alarm]:
        """Note which cylinders creep up to a stamp (ns); return the alarms of those that are even in the newest window."""
        before, self.creeping, begun = self.creeping, {}, dict[int, Alarm]()
        if len(self._seconds) < SPAN:
            return begun
        seconds = np.array([each for _, each in self._seconds])
        parts = seconds.reshape(PARTS, -1, *seconds.shape[1:]).mean(axis=1)
        rates = np.diff(parts[:, 0], axis=0) * PARTS / SPAN
        rate, by_angle = (parts[-1] - parts[0]) / (SPAN - SPAN / PARTS)
        is_slow = (np.abs(rate) > SLOWEST) & (np.abs(rate) < FASTEST) & (np.abs(by_angle - rate) < UNEVEN * np.abs(rate))
        is_slow &= (np.abs(np.diff(seconds[:, 0], axis=0) - rate) < UNEVEN * np.abs(rate) + SWING).all(axis=0)
        is_even = (np.abs(rates - rate) < UNEVEN * np.abs(rate)).all(axis=0)
        for i in np.flatnonzero(is_slow & (is_even | np.isin(np.arange(len(rate)), [*before]))).tolist():
            onset = self.creeping[i] = before.get(i, self._seconds[0][0])
            change = float(rate[i]) * (now - onset) / SECOND
            if abs(change) >= CREPT and is_even[i] and i not in self._alarms:
                name, told = f"cylinder_{i + 1}", f"{change_text(1e3 * rate[i], 'mm/s')}, {change_text(1e3 * change, 'mm')}"
                begun[i] = Alarm(name, "creeps", onset, None, f"{name}.drive", told)
        return begun
