"""Monitor how the tip's IMU is mounted and read: its mean must be the specific force that gravity makes in its axes.

An IMU in g, one whose axes are swapped or point the other way, one that takes gravity out: each differs from the model by
much of g for good, and more than any bias of a working sensor. It is told in these words, and neither the estimate nor the
causes of residuals use such readings: as evidence they would point at a load or a section.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..types import SENSORS, Alarm, Array, Ranked, Stream

G = SENSORS[Stream.IMU].units["g"]
WINDOW = 2.0  # s, time constant of the means
FAR, GONE = 0.2 * G, 0.1 * G  # m/s^2, by which the means differ from which on it is told, and below which it has ended
CLOSE, CLEAR = 0.1 * G, 0.05 * G  # m/s^2, how well a reason must explain the mean, and how much better than others
CAUSE = "tip_imu.sensor"
REASONS = {
    "in g": lambda x, z: (G * x, G * z),
    "in mg": lambda x, z: (1e-3 * G * x, 1e-3 * G * z),
    "with both axes the other way round": lambda x, z: (-x, -z),
    "with x the other way round": lambda x, z: (-x, z),
    "with z the other way round": lambda x, z: (x, -z),
    "with x and z swapped": lambda x, z: (z, x),
    "with x and z swapped, both the other way round": lambda x, z: (-z, -x),
    "turned by 90 deg anticlockwise": lambda x, z: (-z, x),
    "turned by 90 deg clockwise": lambda x, z: (z, -x),
}
"""What may be wrong, and what readings (x, z) in m/s^2 then mean."""
TAKEN_OUT = "with gravity taken out"


class ImuMount:
    """Judges the IMU at the tip.

    Attributes
    ----------
    alarm : Alarm or None
        While it lasts.
    """

    def __init__(self) -> None:
        self.alarm: Alarm | None = None
        self._reasons: tuple[str, ...] = ()
        self.begin()

    def begin(self) -> None:
        """The boom starts from rest; an alarm lasts until it is refuted."""
        self._read, self._expected, self._squares = np.zeros(2), np.zeros(2), 0.0
        self._weight = 0.0

    def take(self, raw: Array, left: Array, span: float, start: int, end: int) -> list[Alarm]:
        """Take the readings of a block; gives an alarm that began or ended.

        Parameters
        ----------
        raw, left : ndarray, shape (k, 2)
            As measured, and less what the model has, m/s^2; NaN where there is none.
        span : float
            Length of the block, s.
        start, end : int
            Of the block, ns.
        """
        if not math.isfinite(left.sum()):
            known = np.isfinite(left).all(axis=1)
            raw, left = raw[known], left[known]
        if not len(left):
            return []
        read, share = raw.mean(axis=0), min(1.0, span / WINDOW)
        self._read += share * (read - self._read)
        self._expected += share * (read - left.mean(axis=0) - self._expected)
        self._squares += share * (float((left**2).sum(axis=1).mean()) - self._squares)
        self._weight += share * (1.0 - self._weight)
        return self._judge(start, end)

    def _judge(self, start: int, end: int) -> list[Alarm]:
        off = math.dist(self._read, self._expected)  # of sums that begin at 0: less than the means' at first
        swing = math.sqrt(max(0.0, self._squares * self._weight - off**2))  # of vibration out of step: it stays in the means
        if self.alarm is None and off > max(FAR, swing):
            return [self._begun(start)]
        if self.alarm is not None and off < GONE * self._weight and not self._is_reason_open():
            ended, self.alarm = replace(self.alarm, until=end), None
            return [ended]
        return []

    def _begun(self, start: int) -> Alarm:
        read, expected = self._read / self._weight, self._expected / self._weight
        self._reasons = _likely(read, expected)
        likely = f", as if {' or '.join(self._reasons)}" if self._reasons else ""
        told = (
            f"{CAUSE} reads ({read[0]:+.3g}, {read[1]:+.3g}) m/s^2 in x and z, where gravity makes "
            f"({expected[0]:+.3g}, {expected[1]:+.3g}){likely}: not used; give tip_imu_x and tip_imu_z their unit, axis and "
            "sign in the mapping"
        )
        self.alarm = Alarm("tip_imu", "range", start, None, CAUSE, told, (Ranked(CAUSE, 1.0, ()),))
        return self.alarm

    def _is_reason_open(self) -> bool:
        """Whether what was told explains the readings still: an axis the other way round shows only where gravity is in it."""
        read, expected = self._read / self._weight, self._expected / self._weight
        return any(_miss(reason, read, expected) < FAR for reason in self._reasons)


def _miss(reason: str, read: Array, expected: Array) -> float:
    """How far the mean is off what is expected if it is read as `reason` says, m/s^2."""
    return math.hypot(*read) if reason == TAKEN_OUT else math.dist(REASONS[reason](*read), expected)


def _likely(read: Array, expected: Array) -> tuple[str, ...]:
    """What explains the mean, in words; nothing where nothing does."""
    if math.hypot(*read) < CLEAR:
        return (TAKEN_OUT,)
    missed = {reason: _miss(reason, read, expected) for reason in REASONS}
    least = min(missed.values())
    return tuple(reason for reason, miss in missed.items() if miss < CLOSE and miss < least + CLEAR)
