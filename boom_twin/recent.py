"""Residuals of the last second, from which a sensor's zero is found."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from .errors import UsageError
from .records import Residuals

SPAN = 1_000_000_000  # ns
FEWEST = 5  # readings that make a mean


class Recent:
    """The newest residuals, all streams in the order in which they became known."""

    def __init__(self) -> None:
        self._past: deque[Residuals] = deque()

    def add(self, residuals: Residuals) -> None:
        """Remember, and forget what is too old."""
        self._past.append(residuals)
        while self._past[0].stamp < residuals.stamp - SPAN:
            self._past.popleft()

    def clear(self) -> None:
        """Forget everything."""
        self._past.clear()

    def offsets(self, sensor: str, now: int, slope: Callable[[int], float]) -> dict[str, float]:
        """What a sensor reads too much, by channel, as the second before `now` (ns) has it.

        Parameters
        ----------
        sensor : str
            ``joint_i`` (rad), ``tip_imu`` (m/s^2, both axes), or ``cylinder_i`` (m): the offset that explains the residual of
            ``joint_i``.
        now : int
        slope : callable
            Stroke over angle (m/rad) of joint i - 1.

        Raises
        ------
        UsageError
            There is no such sensor, or it has too few readings in that time.
        """
        if sensor == "tip_imu":
            return {name: self._mean(name, now) for name in ("tip_imu_x", "tip_imu_z")}
        kind, _, number = sensor.partition("_")
        mean = self._mean(f"joint_{number}", now)
        return {sensor: mean if kind == "joint" else -mean * slope(int(number) - 1)}

    def _mean(self, channel: str, now: int) -> float:
        ready = [r for r in self._past if channel in r.names and r.stamp > now - SPAN]
        values = [value for r in ready if math.isfinite(value := float(r.values[r.names.index(channel)]))]
        if len(values) < FEWEST:
            told = f"{channel}: {len(values)} residuals in the last second, {FEWEST} are needed"
            raise UsageError(f"{told}. Let its sensor and the strokes run, then ask again.")
        return math.fsum(values) / len(values)
