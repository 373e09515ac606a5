"""Alarms of single sensors that give themselves away: each begins, is masked while it lasts, and ends."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..records import Alarm, Array
from .sensors import Findings, Flags

SETTLED = 2_000_000_000  # ns without the fault after which it has ended
TOLD = {
    "stuck": "repeats one reading again and again",
    "noise": "is noisier than stated",
    "spikes": "has single readings far from their neighbours",
    "jump": "jumped at once, which no boom can",
    "dropout": "gives no readings",
    "range": "reads out of its range",
}


@dataclass
class _Fault:
    alarm: Alarm
    seen: int
    offset: float = 0.0


class SensorWatch:
    """Turns the findings about one stream into alarms.

    Parameters
    ----------
    names : tuple of str
        Of its channels.
    unit : str
        Of its readings.
    """

    def __init__(self, names: tuple[str, ...], unit: str) -> None:
        self._names, self._unit = names, unit
        self._faults: dict[tuple[int, str], _Fault] = {}

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """Those that last."""
        return tuple(fault.alarm for fault in self._faults.values())

    @property
    def masked(self) -> Flags:
        """Channels that are not to be trusted, shape (channels,)."""
        flags = np.zeros(len(self._names), dtype=bool)
        for channel, kind in self._faults:
            flags[channel] |= kind != "spikes"
        return flags

    def take(self, findings: Findings, start: int, end: int) -> list[Alarm]:
        """Take what was found in a block from `start` to `end` (ns); gives alarms that began or ended."""
        news: list[Alarm] = []
        for kind, flags in findings.by_kind().items():
            for channel in np.flatnonzero(flags).tolist():
                if kind == "jump" and self._is_wild(channel):
                    continue
                news += self._seen(channel, kind, start, end, findings.jumped)
        for key, fault in list(self._faults.items()):
            if key[1] != "jump" and end - fault.seen > SETTLED:
                del self._faults[key]
                news.append(replace(fault.alarm, until=fault.seen))
        return news

    def _is_wild(self, channel: int) -> bool:
        """Whether the sensor has a fault in which jumps mean nothing more."""
        return any((channel, kind) in self._faults for kind in ("noise", "spikes"))

    def _seen(self, channel: int, kind: str, start: int, end: int, jumped: Array) -> list[Alarm]:
        key = (channel, kind)
        fault = self._faults.get(key)
        size = float(jumped[channel]) if kind == "jump" else 0.0
        if fault is not None:
            if kind == "jump" and end - fault.seen > SETTLED // 10 and abs(fault.offset + size) < 0.3 * abs(fault.offset):
                del self._faults[key]
                return [replace(fault.alarm, until=end)]
            fault.seen = end
            return []
        name = self._names[channel]
        told = f"{name}.sensor {TOLD[kind]}" + (f": {size:+.3g} {self._unit}" if size else "")
        self._faults[key] = _Fault(Alarm(name, kind, start, None, f"{name}.sensor", told), end, size)
        return [self._faults[key].alarm]
