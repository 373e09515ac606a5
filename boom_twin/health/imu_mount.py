"""Monitor how an IMU is mounted and read: its mean must be the specific force that gravity makes in its axes.

An IMU in g, one whose axes are swapped or point the other way, one that takes gravity out: each differs from the model by
much of g for good, and more than any bias of a working sensor. It is told in these words, and neither the estimate nor the
causes of residuals use such readings: as evidence they would point at a load or a section.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ..types import SENSORS, Alarm, Ranked, Stream
from .stream_readings import SlowMeans, StreamReadings

G = SENSORS[Stream.IMU].units["g"]
FAR, GONE = 0.2 * G, 0.1 * G  # m/s^2, by which the means differ from which on it is told, and below which it has ended
CLOSE, CLEAR = 0.1 * G, 0.05 * G  # m/s^2, how well a reason must explain the mean, and how much better than others
KNOWN = 0.25  # weight of the slow means from which on readings are judged, and used: after 0.6 s
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
"""Reasons for a wrong mean, each with the function from readings (x, z) in m/s^2 to true values."""
TAKEN_OUT = "with gravity taken out"


class ImuMount:
    """Monitor of the IMU of that name.

    Attributes
    ----------
    alarm : Alarm or None
        While it lasts.
    """

    def __init__(self, name: str = "tip_imu") -> None:
        self._name, self._cause = name, f"{name}.sensor"
        self.alarm: Alarm | None = None
        self._reasons: tuple[str, ...] = ()

    def take(self, readings: StreamReadings, start: int, end: int) -> list[Alarm]:
        """Take a block from `start` to `end` (ns) of readings in m/s^2; return an alarm that began or ended."""
        if not all(readings.counts.tolist()):
            return []
        slow = readings.slow
        weight, read, expected = min(slow.weight.tolist()), slow.read.tolist(), slow.expected.tolist()
        off = math.dist(read, expected)  # of sums that begin at 0: less than the means' at first
        if self.alarm is None and weight > KNOWN and off > FAR:
            swing2 = float(slow.squares.sum()) * weight - off**2  # of vibration out of step: it stays in the means
            return [self._begun(slow, start)] if off > math.sqrt(max(0.0, swing2)) else []
        if self.alarm is not None and off < GONE * weight and not self._is_reason_open(slow):
            ended, self.alarm = replace(self.alarm, until=end), None
            return [ended]
        return []

    def _begun(self, slow: SlowMeans, start: int) -> Alarm:
        read, expected = _means(slow)
        self._reasons = _likely(read, expected)
        likely = f", as if {' or '.join(self._reasons)}" if self._reasons else ""
        told = (
            f"{self._cause} reads ({read[0]:+.3g}, {read[1]:+.3g}) m/s^2 in x and z, where gravity makes "
            f"({expected[0]:+.3g}, {expected[1]:+.3g}){likely}: not used; give {self._name}_x and {self._name}_z their unit, "
            "axis and sign in the mapping"
        )
        self.alarm = Alarm(self._name, "range", start, None, self._cause, told, (Ranked(self._cause, 1.0, ()),))
        return self.alarm

    def _is_reason_open(self, slow: SlowMeans) -> bool:
        """Return True if a reason still explains the readings: a reversed axis shows only where gravity is in it."""
        read, expected = _means(slow)
        return any(_miss(reason, read, expected) < FAR for reason in self._reasons)


def _means(slow: SlowMeans) -> tuple[list[float], list[float]]:
    """Return the slow means of what was read and expected, m/s^2 in x and z."""
    return (slow.read / slow.weight).tolist(), (slow.expected / slow.weight).tolist()


def _miss(reason: str, read: list[float], expected: list[float]) -> float:
    """Return how far the mean is off the expected one if it is read as `reason` says, m/s^2."""
    return math.hypot(*read) if reason == TAKEN_OUT else math.dist(REASONS[reason](*read), expected)


def _likely(read: list[float], expected: list[float]) -> tuple[str, ...]:
    """Return the reasons that explain the mean."""
    if math.hypot(*read) < CLEAR:
        return (TAKEN_OUT,)
    missed = {reason: _miss(reason, read, expected) for reason in REASONS}
    least = min(missed.values())
    return tuple(reason for reason, miss in missed.items() if miss < CLOSE and miss < least + CLEAR)
