"""What was not well, from when to when."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import nan

from .. import records
from .checks import text
from .lamps import HEALTH, Board, Lamp, Level

MOST = 500
"""Alarms that are kept."""


@dataclass(slots=True)
class Alarm:
    """A lamp that was not well, or what the judge of the rig's health found.

    Attributes
    ----------
    number : int
        By which it is acknowledged.
    name, reason : str
        The reason is that of the worst level; the judge's are as it told them last.
    level : Level
        The worst; of the judge ERROR where the cause is named, else WARN.
    begin : float
        Session time, s.
    end : float or None
        None while it lasts.
    is_acknowledged : bool
    causes : tuple of (str, float)
        Of the judge only: what may explain it, with a probability beside the others, the most probable first; NaN where the
        sensor itself gives it away.
    """

    number: int
    name: str
    level: Level
    reason: str
    begin: float
    end: float | None = None
    is_acknowledged: bool = False
    causes: tuple[tuple[str, float], ...] = ()


class Alarms:
    """Follows the lamps from well to not well and back.

    Attributes
    ----------
    all : list of Alarm
        The newest `MOST` of them, by their begin.
    """

    def __init__(self) -> None:
        self.all: list[Alarm] = []
        self._open: dict[str, Alarm] = {}
        self._judged: dict[tuple[str, int], Alarm] = {}
        self._number = 0

    def follow(self, time: float, board: Board) -> None:
        """The lamps at `time` (s), but for that of the rig's health, whose alarms `judge` is told of."""
        told = ((f"{node}: {lamp.name}", lamp) for node, (_, lamps) in board.nodes.items() for lamp in lamps)
        lamps = {key: lamp for key, lamp in told if lamp.name != HEALTH}
        for key in [key for key in self._open if key not in lamps or lamps[key].level <= Level.OK]:
            self._open.pop(key).end = time
        for key, lamp in lamps.items():
            if lamp.level > Level.OK:
                self._raise(key, lamp.name, lamp.level, lamp.reason, time)

    def judge(self, now: float, told: Sequence[records.Alarm], time: Callable[[int], float]) -> None:
        """The alarms of the rig's health at `now` (s), those that last and those that have just ended.

        `time` gives seconds of a stamp. An alarm that is told of no more has ended. Who has seen it is asked again where its
        most probable cause is another, and when it ends.
        """
        lasting: dict[tuple[str, int], Alarm] = {}
        for found in told:
            key = found.channel, found.since
            alarm = self._judged.pop(key, None) or self._keep(Alarm(self._next(), text(found.channel), Level.WARN, "", 0.0))
            _renew(alarm, found, time)
            if found.until is None:
                lasting[key] = alarm
        for alarm in self._judged.values():
            alarm.end, alarm.is_acknowledged = now, False
        self._judged = lasting

    def lamps(self, time: float) -> Iterable[Lamp]:
        """What the judge had found at `time` (s), as lamps."""
        for alarm in self.all:
            if alarm.causes and alarm.begin <= time and (alarm.end is None or time < alarm.end):
                yield Lamp(alarm.name, "residuals", alarm.level, alarm.reason, age=time - alarm.begin)

    def add(self, name: str, level: Level, reason: str, begin: float, end: float) -> None:
        """An alarm that is over, such as a gap."""
        self._keep(Alarm(self._next(), name, level, reason, begin, end))

    def acknowledge(self, number: int) -> Alarm | None:
        """Note that somebody has seen it; None if there is none of that number."""
        alarm = next((each for each in self.all if each.number == number), None)
        if alarm is not None:
            alarm.is_acknowledged = True
        return alarm

    def acknowledge_ended(self) -> None:
        """Note that the node has let go of all judged alarms that ended."""
        for alarm in self.all:
            alarm.is_acknowledged |= bool(alarm.causes) and alarm.end is not None

    def _raise(self, key: str, name: str, level: Level, reason: str, time: float) -> None:
        alarm = self._open.get(key)
        if alarm is None:
            self._open[key] = self._keep(Alarm(self._next(), name, level, reason, time))
        elif level > alarm.level:
            alarm.level, alarm.reason, alarm.is_acknowledged = level, reason, False

    def _next(self) -> int:
        self._number += 1
        return self._number

    def _keep(self, alarm: Alarm) -> Alarm:
        self.all = [*self.all[-MOST + 1 :], alarm]
        return alarm


def _renew(alarm: Alarm, found: records.Alarm, time: Callable[[int], float]) -> None:
    """As the judge tells it now."""
    causes = tuple((text(each.cause), each.probability) for each in found.ranked) or ((text(found.cause or "not known"), nan),)
    is_same = [each[0] for each in causes[:1]] == [each[0] for each in alarm.causes[:1]]
    alarm.is_acknowledged &= is_same and found.until is None
    alarm.level = Level.WARN if found.cause is None else Level.ERROR
    alarm.reason, alarm.begin, alarm.causes = text(found.told), time(found.since), causes
    alarm.end = None if found.until is None else time(found.until)
