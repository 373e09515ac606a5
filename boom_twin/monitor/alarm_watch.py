"""Changes of the alarms about the rig: an alarm begins, changes its cause, or ends."""

from __future__ import annotations

from collections import Counter
from datetime import UTC, datetime, timedelta
from typing import Any

from ..types import SECOND
from .data.feed import Feed
from .data.status import ListedAlarm

BEGIN, CAUSE, END = "begin", "cause", "end"  # kinds of changes


class AlarmWatch:
    """Watch of one feed's alarms with channel and kind: alarms of the rig's health, and gaps."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self._known: dict[int, tuple[str | None, bool]] = {}  # (cause, has ended) by number of the alarm
        self.begun: Counter[tuple[str, str]] = Counter()  # alarms so far, by channel and kind

    def active(self) -> list[ListedAlarm]:
        """Return the active alarms."""
        return [alarm for alarm in self._feed.store.alarms.all if alarm.fault and alarm.end is None]

    def changes(self) -> list[dict[str, Any]]:
        """Return the changes since the last call, as plain values for JSON, oldest alarm first.

        After a clock was set back, changes wait until the origin of times is known.
        """
        if not self._feed.store.epoch:
            return []
        found: list[dict[str, Any]] = []
        known, self._known = self._known, {}
        for alarm in self._feed.store.alarms.all:
            if not alarm.fault:
                continue
            cause, has_ended = self._known[alarm.number] = alarm.cause, alarm.end is not None
            if alarm.number not in known:
                self.begun[alarm.name, alarm.fault] += 1
                kinds = [BEGIN, END] if has_ended else [BEGIN]
            else:
                before, had_ended = known[alarm.number]
                kinds = [kind for kind, is_new in ((CAUSE, cause != before), (END, has_ended and not had_ended)) if is_new]
            found += [self._change(kind, alarm) for kind in kinds]
        return found

    def _change(self, kind: str, alarm: ListedAlarm) -> dict[str, Any]:
        return {
            "event": kind,
            "boom": self._feed.boom,
            "source": self._feed.title,
            "channel": alarm.name,
            "kind": alarm.fault,
            "cause": alarm.cause,
            "text": alarm.reason,
            "evidence": alarm.evidence,
            "stop": alarm.stops,
            "from": self._date(alarm.begin),
            "to": self._date(alarm.end) if kind == END and alarm.end is not None else None,
        }

    def _date(self, time: float) -> str:
        stamp = self._feed.store.epoch + round(time * SECOND)
        date = datetime.fromtimestamp(stamp // SECOND, UTC) + timedelta(microseconds=stamp % SECOND // 1000)
        return date.isoformat(timespec="microseconds").replace("+00:00", "Z")
