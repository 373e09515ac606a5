"""Monitor of single sensors: findings in their readings become alarms, and an alarm ends when its finding is gone.

A sensor that fails again within `AGAIN` has one alarm, `intermittent`, until it has not failed for that time.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..types import NANO, SECOND, SENSORS, Alarm, Array, Stream
from .alarms import change_text
from .causes import MEMORY
from .sensor_check import CAME_BACK, MISSTATED, NOISE_OVER, WINDOW, Flags, SensorFindings
from .sensor_survey import MEASURED

SETTLED = round(WINDOW / NANO)  # ns without the fault after which it has ended
AGAIN = MEMORY * SECOND  # ns between failures of one intermittent contact
_WRONG = "stuck", "noise", "jump"
WHOLE = -1  # place of the whole stream behind its channels


def noise_as_text(figures: Mapping[str, Any]) -> list[str]:
    """Return a warning for every stream whose sensors are noisier than stated, by figures as in `Health.noise`."""
    found = {name.removeprefix(NOISE_OVER): times for name, times in figures.items() if name.startswith(NOISE_OVER)}
    return [
        f"most sensors are {times:.1f} times {'or more ' if times > MEASURED else ''}as noisy as {name} states; set it to that"
        for name, times in found.items()
        if times > MISSTATED
    ]


@dataclass
class _Fault:
    alarm: Alarm
    seen: int
    offset: float = 0.0
    before: float = math.nan  # residual before a jump
    is_told: bool = True

    def ended(self, until: int) -> list[Alarm]:
        """Return the alarm with its end, if it was told."""
        return [replace(self.alarm, until=until)] if self.is_told else []


class SensorMonitor:
    """Monitor that turns the findings about one stream into alarms.

    Parameters
    ----------
    names : tuple of str
        Channels of the stream.
    stream : Stream
        Stream, whose kind of sensor decides which findings give an alarm.
    is_predicted : bool
        True if a model predicts the readings.
    absent : collection of str
        Channels without a sensor, which have no findings.

    Attributes
    ----------
    masked, unusable : ndarray of bool, shape (channels,)
        Channels to leave out of judgements (a new array whenever they change), and channels whose readings are wrong.
    """

    def __init__(self, names: tuple[str, ...], stream: Stream, is_predicted: bool = True, absent: Collection[str] = ()) -> None:
        self._names, self._sensors, self._is_predicted = (*names, stream.value), SENSORS[stream], is_predicted
        self._there = np.array([name not in absent for name in names])
        self._faults: dict[tuple[int, str], _Fault] = {}
        self._onsets: dict[int, list[int]] = {}  # of failures, by channel, ns
        self._intermittent: dict[int, Alarm] = {}  # by channel
        self._none: Flags = np.zeros(len(names), dtype=bool)
        self.masked, self.unusable, self._is_anew = self._none, self._none, False

    def begin(self) -> None:
        """Note a start from rest: a reading that jumped may have come back unseen."""
        self._is_anew = True

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """Alarms that last."""
        return (*(fault.alarm for fault in self._faults.values() if fault.is_told), *self._intermittent.values())

    def _mask(self, end: int) -> None:
        """Mask the channels that have faults by now."""
        places, faults = np.arange(len(self._none)), self._faults.items()
        failing = [channel for channel, kind in self._faults if kind != "spikes"]
        wrong = [c for (c, kind), each in faults if kind in _WRONG or (kind == "range" and each.seen == end)]
        masked, self.unusable = np.isin(places, failing) | (WHOLE in failing), np.isin(places, wrong)
        self.masked = self.masked if (masked == self.masked).all() else masked

    def take(self, findings: SensorFindings, start: int, end: int, newest: Array | None = None) -> list[Alarm]:
        """Take the findings of a block from `start` to `end` (ns); return alarms that began or ended.

        `newest`: by how much the block's last readings are off (strokes: the readings), shape (channels,), if it has any.
        """
        news = self._back_after_start(end, newest)
        if findings.flags or self._faults or self._intermittent:
            news += self._found(findings, start, end, newest)
        self._mask(end)
        return news

    def _found(self, findings: SensorFindings, start: int, end: int, newest: Array | None) -> list[Alarm]:
        """Begin, keep and end faults by the findings; return alarms that began or ended. See `take`."""
        news: list[Alarm] = []
        for kind, flags in findings.flags.items():
            if kind not in self._sensors.alarms or not flags.any():
                continue
            for channel in self._chosen(flags & self._there, kind):
                if kind != "jump" or not self._is_wild(channel):
                    news += self._seen(channel, kind, start, end, findings)
        for key, fault in list(self._faults.items()):
            off = abs(float(newest[key[0]])) if newest is not None and self._is_predicted else math.inf
            if key[1] == "jump" and not off < abs(fault.before) + CAME_BACK * abs(fault.offset):
                fault.seen = end
            if end - fault.seen > SETTLED:
                del self._faults[key]
                news += fault.ended(fault.seen)
        failing = {channel for channel, _ in self._faults}
        well = [c for c in self._intermittent if c not in failing and end - self._onsets[c][-1] > AGAIN]
        return [*news, *(replace(self._intermittent.pop(channel), until=end) for channel in well)]

    def _chosen(self, flags: Flags, kind: str) -> list[int]:
        """Return the channels in flags of a kind; `WHOLE` if all channels fall silent together, which has one source."""
        chosen: list[int] = np.flatnonzero(flags).tolist()
        is_whole = kind == "dropout" and 1 < len(chosen) == self._there.sum()
        return [WHOLE] if is_whole and all((channel, kind) not in self._faults for channel in chosen) else chosen

    def _back_after_start(self, end: int, newest: Array | None) -> list[Alarm]:
        """End jumps of sensors that read what they had before, with the first readings after a start from rest."""
        if not self._is_anew or newest is None:
            return []
        self._is_anew, news = False, list[Alarm]()
        for key, fault in list(self._faults.items()):
            is_jump = key[1] == "jump" and not self._is_predicted
            if is_jump and abs(newest[key[0]] - fault.before) < CAME_BACK * abs(fault.offset):
                del self._faults[key]
                news += fault.ended(end)
        return news

    def _is_wild(self, channel: int) -> bool:
        """Return True if jumps mean nothing: the sensor has another fault, out of which it jumps when it recovers."""
        return (channel, "jump") not in self._faults and any(known in (channel, WHOLE) for known, _ in self._faults)

    def _seen(self, channel: int, kind: str, start: int, end: int, findings: SensorFindings) -> list[Alarm]:
        """Begin, keep or end a fault that was found in a block."""
        key, name = (channel, kind), self._names[channel]
        fault = self._faults.get(key)
        size, level = float(findings.jumped[channel]) if kind == "jump" else 0.0, float(findings.level[channel])
        if fault is not None:
            off = np.fmin(abs(fault.offset + size), abs(level - fault.before))
            if size * fault.offset < 0.0 and off < CAME_BACK * abs(fault.offset):
                del self._faults[key]
                return fault.ended(end)
            fault.seen = end
            return []
        off = size if kind == "jump" else level if kind == "range" and self._is_predicted else math.nan
        evidence = change_text(off, self._sensors.unit) if math.isfinite(off) else ""
        is_first = all(known != channel for known, _ in self._faults)
        if is_first:
            self._onsets[channel] = [*(t for t in self._onsets.get(channel, []) if start - t < AGAIN), start]
        onsets, cause = self._onsets[channel], f"{name}.sensor"
        alarm = Alarm(name, kind, start, None, cause, evidence)
        self._faults[key] = _Fault(alarm, end, size, level - size, len(onsets) == 1)
        if not is_first or len(onsets) == 1:
            return [alarm] if len(onsets) == 1 else []
        since = self._intermittent[channel].since if channel in self._intermittent else start
        times = f"{len(onsets)}x / {(start - onsets[0]) * NANO:.0f} s"
        self._intermittent[channel] = Alarm(name, "intermittent", since, None, cause, times)
        return [self._intermittent[channel]]
