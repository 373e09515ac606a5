"""Monitor which joint's angle every encoder reads, and with which sign and unit; a swap is reported as a swap.

Readings of two joints that are exchanged, of the other sign or in degrees, differ from the model by far more than a boom can
give way, and by an amount that is known. As evidence of a fault they would point at a stroke's scale or an offset.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from math import degrees, radians

import numpy as np
from numpy.typing import NDArray

from ..errors import BoomTwinError
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.schema import Scene
from ..types import Alarm, Array, Mount, Ranked
from .stream_readings import ENOUGH, WINDOW, StreamReadings

FAR = radians(1.0)  # by which readings have to be off, and two expected angles apart, for their exchange to be told
FAR_SIGN = radians(10.0)  # likewise a reading for its sign: an offset looks like it where the angle is minus half of it
FAR_STROKES = radians(6.0)  # likewise two joints for strokes that are swapped
CLOSE = 0.1  # of how far a reading is off: by so much it may miss what it is taken for
TURN = radians(360.0)  # beyond which no joint reads: one does where all read in degrees
SAG = radians(2.0)  # what cylinders and links give way by, which rigid angles of strokes leave out
RIGHT = 0.3  # of how far an exchange would put it off: a reading that is less off is right again


@dataclass(frozen=True)
class _Exchange:
    """Exchanged readings of one or more joints, with their alarm.

    `joints` are 0-based, a single one if its sign or unit is wrong. `is_of_strokes` is True if strokes are exchanged.
    """

    joints: tuple[int, ...]
    is_of_strokes: bool
    alarm: Alarm
    is_in_degrees: bool = False


class AngleReading:
    """Monitor of the angle sensors by comparison with one another.

    Parameters
    ----------
    scene : Scene
    mounts : sequence of Mount or None
        Of the sensors; strokes are only judged where all are encoders.
    """

    def __init__(self, scene: Scene, mounts: tuple[Mount | None, ...]) -> None:
        self._scene, self._are_encoders = scene, not any(mounts)
        self._found: list[_Exchange] = []
        self._none = np.zeros(len(scene.joints), dtype=bool)
        self.begin()

    def begin(self) -> None:
        """Restart with the boom at rest; alarms last until they are refuted."""
        count = len(self._scene.joints)
        self._strokes, self._since = np.zeros(count), np.full(count, -1, dtype=np.int64)
        self._is_off = False

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """Alarms that last."""
        return tuple(found.alarm for found in self._found)

    @property
    def masked(self) -> NDArray[np.bool_]:
        """Mask of the angle sensors that must not be used, shape (n,)."""
        if not self._found:
            return self._none
        mask = np.full(len(self._scene.joints), self.has_wrong_strokes)
        for found in self._found:
            mask[list(found.joints)] = True
        return mask

    @property
    def has_wrong_strokes(self) -> bool:
        """Return True if strokes are swapped, so that every prediction is wrong."""
        return any(found.is_of_strokes for found in self._found)

    def explains(self, alarm: Alarm) -> bool:
        """Return True if an alarm of a single sensor is part of an exchange reported here."""
        joints = {joint for found in self._found if not found.is_of_strokes for joint in found.joints}
        return alarm.kind in {"range", "jump", "noise", "spikes"} and alarm.channel in {f"joint_{i + 1}" for i in joints}

    def take(self, readings: StreamReadings, strokes: Array, span: float, start: int, end: int) -> list[Alarm]:
        """Take a block; return alarms that began or ended.

        Parameters
        ----------
        readings : StreamReadings
            Of the angle sensors, rad.
        strokes : ndarray, shape (n,)
            Mean of the measured strokes, m.
        span : float
            Length of the block, s.
        start, end : int
            Of the block, ns.
        """
        heard, is_off = readings.counts > 0.0, np.abs(readings.off) > FAR
        self._strokes[heard] += min(1.0, span / WINDOW) * (strokes - self._strokes)[heard]
        if not heard.any() or not (self._is_off or self._found or is_off.any()):
            return []
        self._since = np.where(is_off, np.where(self._since < 0, start, self._since), np.where(heard, -1, self._since))
        self._is_off = bool((self._since >= 0).any())
        weight = np.maximum(readings.slow.weight, 1e-9)
        read, expected = readings.slow.read / weight, readings.slow.expected / weight
        is_known = readings.slow.weight > ENOUGH
        return self._ended(read, expected, end) + self._begun(is_known, read, expected, self._strokes / weight)

    def _ended(self, read: Array, expected: Array, end: int) -> list[Alarm]:
        over = [found for found in self._found if self._is_over(found, read, expected)]
        self._found = [found for found in self._found if found not in over]
        return [replace(found.alarm, until=end) for found in over]

    @staticmethod
    def _is_over(found: _Exchange, read: Array, expected: Array) -> bool:
        """Return True if joints read their own angles; False where an exchange would make no difference."""
        if found.is_in_degrees:
            return all(abs(read[i] - expected[i]) < max(FAR, RIGHT * abs(degrees(expected[i]))) for i in found.joints)
        first, last = found.joints[0], found.joints[-1]
        apart = abs(expected[first] - (expected[last] if last != first else -expected[first]))
        least = FAR_STROKES if found.is_of_strokes else apart
        return bool(apart > FAR and all(abs(read[i] - expected[i]) < RIGHT * least for i in found.joints))

    def _begun(self, is_known: NDArray[np.bool_], read: Array, expected: Array, strokes: Array) -> list[Alarm]:
        """Return alarms that begin, by slow means of angles read and expected (rad) and of strokes (m), shape (n,) each."""
        taken = self.masked
        off = is_known & (np.abs(read - expected) > FAR) & ~taken & (self._since >= 0)
        if not off.any():
            return []
        news: list[Alarm] = []
        candidates = self._exchanges(np.flatnonzero(off).tolist(), read, expected, strokes)
        if is_known.all() and _are_in_degrees(read, expected):
            candidates = (self._in_degrees(i, read[i], expected[i]) for i in np.flatnonzero(off).tolist())
        for found in candidates:
            if not any(taken[i] for i in found.joints):
                self._found.append(found)
                news.append(found.alarm)
                taken = self.masked
        return news

    def _exchanges(self, off: list[int], read: Array, expected: Array, strokes: Array) -> Iterator[_Exchange]:
        for i, j in combinations(off, 2):
            apart = float(abs(expected[i] - expected[j]))
            if max(abs(read[i] - expected[j]), abs(read[j] - expected[i])) < CLOSE * apart and apart > FAR:
                yield self._swapped_angles(i, j, apart)
        for i in off:
            apart = abs(expected[i] - read[i])
            if abs(read[i] + expected[i]) < CLOSE * apart and apart > FAR_SIGN:
                yield self._of_other_sign(i, read[i], expected[i])
        if self._are_encoders:
            for i, j in combinations(off, 2):
                if self._would_swapped_strokes_fit([i, j], read, expected, strokes.copy()):
                    yield self._swapped_strokes(i, j)

    def _would_swapped_strokes_fit(self, pair: list[int], read: Array, expected: Array, strokes: Array) -> bool:
        off = np.abs(read[pair] - expected[pair])
        if off.min() < FAR_STROKES:
            return False
        strokes[pair] = strokes[pair[::-1]]
        try:
            angles = joint_angles_of_strokes(self._scene, strokes, read)
        except BoomTwinError:  # no angle has such a stroke
            return False
        return bool((np.abs(angles[pair] - read[pair]) < np.maximum(SAG, CLOSE * off)).all())

    def _swapped_angles(self, i: int, j: int, apart: float) -> _Exchange:
        told = (
            f"joint_{i + 1}.sensor and joint_{j + 1}.sensor read each other's angle, {degrees(apart):.3g} deg apart: not used; "
            "exchange their names in the mapping, or their cables"
        )
        return _Exchange((i, j), False, self._alarm(i, "swapped", f"joint_{i + 1}.sensor", told))

    def _of_other_sign(self, i: int, read: float, expected: float) -> _Exchange:
        told = (
            f"joint_{i + 1}.sensor reads {degrees(read):+.4g} deg where the model has {degrees(expected):+.4g} deg, as if of "
            "the other sign: not used; give it its sign in the mapping"
        )
        return _Exchange((i,), False, self._alarm(i, "range", f"joint_{i + 1}.sensor", told))

    def _in_degrees(self, i: int, read: float, expected: float) -> _Exchange:
        told = (
            f"joint_{i + 1}.sensor reads {read:+.4g} where the model has {expected:+.4g} rad, as if in degrees, as all of "
            "them: not used; give the mapping `unit: deg`"
        )
        return _Exchange((i,), False, self._alarm(i, "range", f"joint_{i + 1}.sensor", told), is_in_degrees=True)

    def _swapped_strokes(self, i: int, j: int) -> _Exchange:
        told = (
            f"cylinder_{i + 1}.sensor and cylinder_{j + 1}.sensor read each other's stroke: joint_{i + 1} and joint_{j + 1} "
            "stand where the other's stroke would put them; nothing is predicted rightly until their names in the mapping, or "
            "their cables, are exchanged"
        )
        return _Exchange((i, j), True, self._alarm(i, "swapped", f"cylinder_{i + 1}.sensor", told))

    def _alarm(self, i: int, kind: str, cause: str, told: str) -> Alarm:
        return Alarm(f"joint_{i + 1}", kind, int(self._since[i]), None, cause, told, (Ranked(cause, 1.0, ()),))


def _are_in_degrees(read: Array, expected: Array) -> bool:
    """Return True if all readings are the expected angles (rad) in degrees, and one of them can be nothing else."""
    is_near = np.abs(np.radians(read) - expected) < FAR + CLOSE * np.abs(expected)
    return bool(is_near.all() and np.abs(read).max() > TURN)
