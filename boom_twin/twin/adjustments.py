"""Adjustments of a running twin: sensor zeros, the residuals they are found from, requests of load, limits and restarts."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping

import numpy as np

from ..config.settings import Settings
from ..errors import UsageError
from ..types import SECOND, SENSORS, Array, Change, Stream

KEPT = 16  # sets of zeros that late samples may still need


class SensorZeros:
    """The zeros of all sensors.

    Parameters
    ----------
    channels : dict of Stream to tuple of str
        See `boom_twin.types.channels_of`.

    Attributes
    ----------
    values : dict of str to float
        The newest ones, by channel: m, rad, m/s^2.
    """

    def __init__(self, channels: Mapping[Stream, tuple[str, ...]]) -> None:
        self._channels = channels
        self.values: dict[str, float] = {}
        self._past: deque[tuple[int, dict[Stream, Array]]] = deque([(0, {})], maxlen=KEPT)

    def put(self, stamp: int, values: Mapping[str, float]) -> bool:
        """Others from `stamp` (ns) on; samples of earlier stamps keep what they had. Tells whether those of strokes differ."""
        before, self.values = self.values, dict(values)
        rows = {}
        for stream, names in self._channels.items():
            row = np.array([self.values.get(name, 0.0) for name in names])
            if row.any():
                rows[stream] = row
        self._past.append((stamp, rows))
        return any(before.get(name) != values.get(name) for name in self._channels[Stream.STROKES])

    def forget_past(self) -> None:
        """The newest zeros hold for every stamp."""
        rows = self._past[-1][1]
        self._past.clear()
        self._past.append((0, rows))

    def of(self, stream: Stream, stamp: int) -> Array | None:
        """What is to be taken from a sample; None where nothing is."""
        for since, rows in reversed(self._past):
            if since <= stamp:
                return rows.get(stream)
        return None


SPAN = SECOND  # ns
FEWEST = 5  # readings that make a mean
WHOLE = {kind.stem: kind.channels(0) for kind in SENSORS.values() if kind.ends}
"""Sensors with a zero for each of their channels; all others have one for each joint."""


class ResidualBuffer:
    """Measured minus predicted, without any zero, in the order in which it became known.

    Parameters
    ----------
    channels : dict of Stream to tuple of str
        See `boom_twin.types.channels_of`.
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

    def zeros_of(self, sensor: str, now: int, zeros: Mapping[str, float], slope: Callable[[int], float]) -> dict[str, float]:
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
        if sensor in WHOLE:
            return {name: self._mean(name, now) for name in WHOLE[sensor]}
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


class Requests:
    """Collects what is asked for between two stroke samples.

    Attributes
    ----------
    settings : Settings
    zeros : dict of str to float
        As they will be.
    from_rest : bool
        Whether a start from rest is asked for.
    due : bool
        Whether anything waits.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.zeros: dict[str, float] = {}
        self.from_rest = self.due = False

    def tune(self, live: Mapping[str, float]) -> None:
        """Other live settings.

        Raises
        ------
        UsageError
            A value is out of bounds, or cannot change while the twin runs.
        """
        self.settings, self.due = self.settings.tuned(live), True

    def zero(self, values: Mapping[str, float]) -> None:
        """Other zeros of some sensors."""
        self.zeros, self.due = {**self.zeros, **values}, True

    def rest(self) -> None:
        """A start of the model from rest."""
        self.from_rest = self.due = True

    def repeat(self, change: Change) -> None:
        """All that was done to another twin with the sample of that stamp; UsageError as for `tune`."""
        self.settings = self.settings.tuned(change.settings)
        self.zeros, self.from_rest, self.due = change.zeros, change.from_rest, True

    def take(self) -> bool:
        """Nothing waits any more; tells whether a start from rest was asked for."""
        from_rest, self.from_rest, self.due = self.from_rest, False, False
        return from_rest
