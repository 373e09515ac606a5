"""How far sensors were from the prediction within the last second, from which their zeros are found."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping

from .errors import UsageError
from .records import Array, Stream

SPAN = 1_000_000_000  # ns
FEWEST = 5  # readings that make a mean


class Recent:
    """Measured minus predicted, without any zero, in the order in which it became known.

    Parameters
    ----------
    channels : dict of Stream to tuple of str
        See `boom_twin.records.channels_of`.
    """

    def __init__(self, channels: Mapping[Stream, tuple[str, ...]]) -> None:
        self._places = {name: (stream, i) for stream, names in channels.items() for i, name in enumerate(names)}
        self._past: deque[tuple[int, Stream, Array]] = deque()

    def add(self, stamp: int, stream: Stream, differences: Array) -> None:
        """Remember, and forget what is too old; stamp in ns."""
        self._past.append((stamp, stream, differences))
        while self._past[0][0] < stamp - SPAN:
            self._past.popleft()

    def clear(self) -> None:
        """Forget everything."""
        self._past.clear()

    def zeros_of(
        self, sensor: str, now: int, zeros: Mapping[str, float], slope: Callable[[int], float]
    ) -> dict[str, float]:
        """The zeros of a sensor, by channel, that the second before `now` (ns) tells.

        Parameters
        ----------
        sensor : str
            ``joint_i`` (rad), ``tip_imu`` (m/s^2, both axes), or ``cylinder_i`` (m): the zero that explains the residual of
            ``joint_i``.
        now : int
        zeros : dict of str to float
            Those that hold.
        slope : callable
            Stroke over angle (m/rad) of joint i, counted from 0.

        Raises
        ------
        UsageError
            It has too few readings in that time.
        """
        if sensor == "tip_imu":
            return {name: self._mean(name, now) for name in ("tip_imu_x", "tip_imu_z")}
        kind, _, number = sensor.partition("_")
        joint = f"joint_{number}"
        mean = self._mean(joint, now)
        if kind == "joint":
            return {joint: mean}
        return {sensor: zeros.get(sensor, 0.0) - (mean - zeros.get(joint, 0.0)) * slope(int(number) - 1)}

    def _mean(self, channel: str, now: int) -> float:
        own, place = self._places[channel]
        rows = [row for stamp, stream, row in self._past if stream is own and stamp > now - SPAN]
        values = [value for row in rows if math.isfinite(value := float(row[place]))]
        if len(values) < FEWEST:
            told = f"{channel}: {len(values)} residuals in the last second, {FEWEST} are needed"
            raise UsageError(f"{told}. Let its sensor and the strokes run, then ask again.")
        return math.fsum(values) / len(values)
