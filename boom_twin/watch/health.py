"""What the judge of the rig's health has found, kept until somebody has seen it."""

from __future__ import annotations

from ..alarms import Alarms, values_of
from ..records import Alarm, Health
from ..thresholds import Thresholds
from .judge import Judge
from .status import Level, Status


class HealthWatch:
    """Alarms that last, and those that ended and are not acknowledged.

    Attributes
    ----------
    has_news : bool
        Whether an alarm began since the last look.
    """

    def __init__(self) -> None:
        self._judge = Judge("health")
        self._alarms = Alarms()
        self.has_news = False

    def took(self, health: Health) -> None:
        """Go on with what the twin tells."""
        before = len(self._alarms.all)
        self._alarms.take(health)
        self.has_news |= len(self._alarms.all) > before

    def acknowledge(self) -> str:
        """Let go of alarms that ended; says which."""
        ended = [alarm for alarm in self._alarms.all if alarm.until is not None]
        self._alarms.forget_ended()
        return "; ".join(f"{alarm.channel}: {alarm.told}" for alarm in ended) or "no alarm has ended"

    def of(self, channel: str) -> Alarm | None:
        """The alarm that lasts in a channel."""
        return next((alarm for alarm in self._alarms.lasting if alarm.channel == channel), None)

    def status(self, thresholds: Thresholds, now: float, clock: float) -> Status:
        """State of the rig; times as for `boom_twin.watch.sensor.SensorJudge`."""
        judge, self.has_news = self._judge, False
        judge.begin(now, thresholds)
        alarms = self._alarms.all
        judge.note("alarms", len(self._alarms.lasting))
        judge.note("not_acknowledged", len(alarms) - len(self._alarms.lasting))
        for number, alarm in enumerate(alarms, 1):
            judge.fault(level_of(alarm), told_of(alarm))
            for key, value in {"channel": alarm.channel, **values_of(alarm)}.items():
                judge.note(f"{number} {key}", value)
        return judge.finish(clock, "no alarm")


def level_of(alarm: Alarm) -> Level:
    """An error is what lasts and has a name."""
    return Level.WARN if alarm.until is not None or alarm.cause is None else Level.ERROR


def told_of(alarm: Alarm) -> str:
    """In words."""
    return f"{alarm.channel}: {alarm.told}" + ("" if alarm.until is None else " (ended; not acknowledged)")
