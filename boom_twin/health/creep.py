"""Monitor of cylinders that creep: their lengths change slowly and evenly, as an operator hardly moves them.

A leak makes a cylinder creep, and its joint turns. If the angle sensor shows no turn, the stroke transducer drifts.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..scene.kinematics import strokes_of_angles
from ..scene.schema import Scene
from ..types import SECOND, Alarm, Array, Stream
from .blocks import means_of

SPAN, PARTS = 12, 4  # s of a window, several periods of a pump; equal parts of it whose means are compared
UNEVEN = 0.4  # largest relative difference of the rates between parts, and of the rates by length and by angle
SWING = 1e-3  # m, largest change of a mean length from second to second by pump and wind; short moves change it by more
SLOWEST, FASTEST = 1e-4, 3e-3  # m/s, rates of creeping: above noise, and below the moves of an operator
CREPT = 4e-3  # m, least change of length for an alarm: a softening oil spring changes it by less


class Creep(NamedTuple):
    """Creeping of a cylinder since `onset` (ns): mean rate (m/s) and change of length (m), positive if it extends.

    is_even : True if it is even in the newest window, not a few short moves.
    """

    onset: int
    rate: float
    change: float
    is_even: bool


class CreepMonitor:
    """Monitor of mean lengths and angles, one second after the other.

    Attributes
    ----------
    creeping : dict of int to Creep
        By cylinder, from 0.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene, self.creeping = scene, dict[int, Creep]()
        self._seconds: deque[tuple[int, Array]] = deque(maxlen=SPAN)
        self._alarms: dict[int, Alarm] = {}  # by cylinder

    def take(self, stamp: int, block: Any) -> list[Alarm]:
        """Take the samples of a second that begins at a stamp (ns); return the alarms that begin or end."""
        if self._seconds and stamp - self._seconds[-1][0] != SECOND:
            self._seconds.clear()
        count, codes = len(self._scene.joints), list(Stream)
        lengths, angles = (
            means_of(block.values[block.streams == codes.index(stream), :count]) for stream in (Stream.STROKES, Stream.ANGLES)
        )
        self._seconds.append((stamp, np.stack([lengths, strokes_of_angles(self._scene, angles)])))
        if len(self._seconds) < SPAN:
            self.creeping.clear()
            return self._news(stamp)
        seconds = np.array([each for _, each in self._seconds])
        parts = seconds.reshape(PARTS, -1, 2, count).mean(axis=1)
        rates = np.diff(parts[:, 0], axis=0) * PARTS / SPAN
        rate, by_angle = (parts[-1] - parts[0]) / (SPAN - SPAN / PARTS)
        is_slow = (np.abs(rate) > SLOWEST) & (np.abs(rate) < FASTEST) & (np.abs(by_angle - rate) < UNEVEN * np.abs(rate))
        is_slow &= (np.abs(np.diff(seconds[:, 0], axis=0) - rate) < UNEVEN * np.abs(rate) + SWING).all(axis=0)
        is_even = (np.abs(rates - rate) < UNEVEN * np.abs(rate)).all(axis=0)
        for i in range(count):
            old = self.creeping.pop(i, None)
            if is_slow[i] and (is_even[i] or old is not None):
                onset = self._seconds[0][0] if old is None else old.onset
                change = float(rate[i]) * (stamp + SECOND - onset) / SECOND
                self.creeping[i] = Creep(onset, float(rate[i]), change, bool(is_even[i]))
        return self._news(stamp)

    def _news(self, stamp: int) -> list[Alarm]:
        gone = [i for i in self._alarms if i not in self.creeping]
        news = [replace(self._alarms.pop(i), until=stamp) for i in gone]
        for i, each in self.creeping.items():
            if abs(each.change) >= CREPT and each.is_even and i not in self._alarms:
                name, told = f"cylinder_{i + 1}", f"by {1e3 * each.rate:+.2g} mm/s, {1e3 * each.change:+.2g} mm up to now"
                self._alarms[i] = Alarm(name, "creeps", each.onset, None, f"{name}.drive", told)
                news.append(self._alarms[i])
        return news
