"""Monitor in which unit and with which sign cylinder forces are read: their means must be what holds the boom up.

Forces in kN for N, or positive in compression, differ from the model by a factor that no load at the tip makes. The estimate
does not use them. Other offsets and scales it knows as states, see `boom_twin.deviation.sensors`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..types import SENSORS, Alarm, Ranked, Stream
from .stream_readings import ENOUGH, SlowMeans, StreamReadings

LARGE = 0.2  # of the largest force, from which on a cylinder's is judged: a smaller one may be as large by a load
NEAR_PEAK = 0.3  # likewise of the largest that this cylinder ever had: while it passes zero a load may make it anything
LASTING = 3_000_000_000  # ns for which a reason has to explain a reading: in a move a wrong mean passes by many factors
CLOSE = 0.2  # of the factor by which a reason explains it: share by which the reading may be off it
RIGHT = 0.5  # of the force: a reading that is less off has the right unit and sign


def _reasons() -> dict[str, float]:
    """Return reasons for a wrong reading with its factor: units of who states N, and N of who states another unit."""
    units = {unit: size for unit, size in SENSORS[Stream.FORCES].units.items() if size != 1.0}
    found = {f"in {unit}": 1.0 / size for unit, size in units.items()}
    found |= {f"in N and stated as {unit}": size for unit, size in units.items()}
    return found | {f"{reason} and positive in compression": -factor for reason, factor in found.items()}


REASONS = {"positive in compression": -1.0} | _reasons()


class ForceReading:
    """Monitor of the cylinder forces.

    Parameters
    ----------
    names : tuple of str
        Of its channels.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names, self._alarms, self._peaks = names, dict[int, Alarm](), np.zeros(len(names))
        self.begin()

    def begin(self) -> None:
        """Restart with the boom at rest; alarms last until they are refuted."""
        self._is_large = np.zeros(len(self._names), dtype=bool)
        self._reasons: dict[int, tuple[str, int]] = {}  # of a channel, and since when it explains what is read, ns

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """Alarms that last."""
        return tuple(self._alarms.values())

    @property
    def masked(self) -> NDArray[np.bool_]:
        """Mask of the channels that must not be used, shape (channels,).

        If all large forces are wrong, the small ones are masked as well.
        """
        found = np.isin(np.arange(len(self._names)), list(self._alarms))
        return found | bool(self._alarms) & (found | ~self._is_large).all()

    def take(self, readings: StreamReadings, start: int, end: int) -> list[Alarm]:
        """Take a block from `start` to `end` (ns) of forces in N; return alarms that began or ended."""
        if not any(readings.counts.tolist()):
            return []
        heard, slow = readings.counts > 0.0, readings.slow
        expected = np.abs(slow.expected)
        self._peaks = np.fmax(self._peaks, expected / np.fmax(slow.weight, ENOUGH))
        is_near_peak = expected > NEAR_PEAK * self._peaks * slow.weight
        self._is_large = (expected > LARGE * expected.max()) & is_near_peak & (expected > 0.0)
        news: list[Alarm] = []
        means, models = slow.read.tolist(), slow.expected.tolist()
        for i in np.flatnonzero(heard & self._is_large).tolist():
            factor = means[i] / models[i]
            if i in self._alarms:
                if abs(factor - 1.0) < RIGHT:
                    news.append(replace(self._alarms.pop(i), until=end))
            elif self._is_lasting(i, _reason(factor) if slow.weight[i] > ENOUGH else "", start, end):
                self._alarms[i] = self._begun(i, *self._reasons.pop(i), slow)
                news.append(self._alarms[i])
        return news

    def _is_lasting(self, i: int, reason: str, start: int, end: int) -> bool:
        """Return True if this reason has explained channel `i` for `LASTING` at the block from `start` to `end` (ns)."""
        if self._reasons.get(i, ("", 0))[0] != reason:
            self._reasons[i] = reason, start
        return bool(reason) and end - self._reasons[i][1] >= LASTING

    def _begun(self, i: int, reason: str, start: int, slow: SlowMeans) -> Alarm:
        name, cause = self._names[i], f"{self._names[i]}.sensor"
        read, expected = slow.read[i] / slow.weight[i], slow.expected[i] / slow.weight[i]
        told = (
            f"{cause} reads {_three_digits(read)} N where the model has {_three_digits(expected)} N, as if {reason}: not used; "
            "give cylinder forces their unit and sign (positive in tension) in the mapping"
        )
        return Alarm(name, "range", start, None, cause, told, (Ranked(cause, 1.0, ()),))


def _three_digits(force: float) -> str:
    return f"{float(f'{force:.3g}'):+g}"


def _reason(factor: float) -> str:
    """Return the reason for reading `factor` times the model's force; empty where none explains it or is needed."""
    if abs(factor - 1.0) < RIGHT:
        return ""
    return next((reason for reason, by in REASONS.items() if abs(factor / by - 1.0) < CLOSE), "")
