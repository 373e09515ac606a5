"""Deviation of angle sensors from what the cylinder lengths say, told in its own units: no cause is inferred from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..types import Alarm
from .imu_mount import KNOWN
from .stream_readings import StreamReadings

FAR, GONE = 0.02, 0.01  # m at the tip, by which an angle is off from which on it is told, and below which that has ended


class LengthResiduals:
    """Judges slow means of the residuals of angle sensors, on lengths.

    Parameters
    ----------
    names : sequence of str
        Of the channels.
    lengths : ndarray, shape (n,)
        Of the sections, m: an angle turns all that is outboard of its joint.

    Attributes
    ----------
    alarms : tuple of Alarm
        Those that last.
    """

    def __init__(self, names: Sequence[str], lengths: NDArray[np.float64]) -> None:
        self._names, self._reach = names, np.cumsum(lengths[::-1])[::-1]
        self._last: dict[int, Alarm] = {}

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """Those that last."""
        return tuple(self._last.values())

    def take(self, readings: StreamReadings, masked: NDArray[np.bool_], start: int, end: int) -> list[Alarm]:
        """Take a block from `start` to `end` (ns); returns the alarms that began or ended."""
        slow, news = readings.slow, []
        weight = np.maximum(slow.weight, 1e-9)
        off = (slow.read - slow.expected) / weight
        for i, name in enumerate(self._names):
            far = abs(float(off[i])) * self._reach[i]
            is_known = bool(readings.counts[i]) and slow.weight[i] > KNOWN and not masked[i]
            if i not in self._last and is_known and far > FAR:
                told = (
                    f"{name} reads {1e3 * off[i]:+.2f} mrad against the cylinder lengths, up to {1e3 * far:.0f} mm at the tip: "
                    f"its sensor, a stroke transducer, or the scene is off. Compare both at rest"
                )
                self._last[i] = Alarm(name, "deviation", start, None, None, told)
                news.append(self._last[i])
            elif i in self._last and (masked[i] or (is_known and far < GONE)):
                news.append(replace(self._last.pop(i), until=end))
        return news
