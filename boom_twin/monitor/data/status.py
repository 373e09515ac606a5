"""Status indicators of the live page, and its list of alarms."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from math import inf, isfinite, isnan, nan
from typing import Any

from ...diagnostics.topic_status import ENDED
from ...health.alarms import evidence_with_cause
from ...system.terminal_text import printable
from ...texts import LANGUAGES, alarm_sentence, alarm_text
from ...types import Alarm

SILENCE = 3.0  # seconds without a word from a node after which its lamps are stale
MAX_NODES, FORGET_AFTER = 200, 60.0  # above this number of nodes, those silent for longer (s) are deleted
GROUPS = ("sensors", "model", "residuals", "timing", "recorder")
HEALTH = "health"  # the status that stands for all alarms of the rig's health
SENSOR_GROUPS = ("sensor", "residual")  # kinds of statuses that speak of one channel, as an alarm of the rig's health does
WITH_FIGURES = ("swing", "tip load")  # statuses whose values the page shows
_LIMITS = ("_error", "_warn", "_stale")


class Severity(IntEnum):
    """Severity of a status, in rising order. The order of diagnostic_msgs is another."""

    OFF = 0
    OK = 1
    WARN = 2
    STALE = 3
    ERROR = 4


LEVELS = (Severity.OK, Severity.WARN, Severity.ERROR, Severity.STALE)
"""Severity by the number in diagnostic_msgs/DiagnosticStatus."""


@dataclass(frozen=True, slots=True)
class StatusLamp:
    """One status of a node."""

    name: str
    group: str
    level: Severity
    reason: str
    quantity: str = ""  # that was judged, its unit at the end
    value: float = nan
    limit: float = nan
    age: float = nan  # seconds that the level had lasted when it was reported
    is_last: bool = False  # its node said that no further one comes
    figures: Mapping[str, float] = field(default_factory=dict)  # its values, of some

    @property
    def channel(self) -> str:
        """Channel that it speaks of; empty if of none."""
        kind, _, channel = self.name.partition(" ")
        return channel if kind in SENSOR_GROUPS else ""


@dataclass(frozen=True)
class StatusTable:
    """Table of all lamps by node, each with the time (s) at which that node last reported them."""

    nodes: Mapping[str, tuple[float, tuple[StatusLamp, ...]]] = field(default_factory=dict)

    def updated(self, now: float, statuses: Iterable[Any], clock: float) -> StatusTable:
        """Return the table after a DiagnosticArray with these `statuses` and the stamp `clock` (s), which came at `now` (s)."""
        found: dict[str, list[StatusLamp]] = {}
        for status in statuses:
            node, _, name = text(status.name).partition(": ")
            found.setdefault(node, []).append(_lamp(name or node, status, clock))
        nodes = {**self.nodes, **{node: (now, tuple(lamps)) for node, lamps in found.items()}}
        if len(nodes) > MAX_NODES:
            nodes = {node: told for node, told in nodes.items() if now - told[0] <= FORGET_AFTER}
        return StatusTable(nodes)

    def groups(self, now: float) -> dict[str, list[StatusLamp]]:
        """Return the lamps by group.

        Lamps of a node that is silent, and did not report its end, are stale, whatever their level was.
        """
        found: dict[str, list[StatusLamp]] = {group: [] for group in GROUPS}
        for node, (heard, lamps) in self.nodes.items():
            silence = now - heard
            for lamp in lamps:
                if silence > SILENCE and not lamp.is_last:
                    words = f"no message from {node}"
                    lamp = StatusLamp(lamp.name, lamp.group, Severity.STALE, words, "silence_s", silence, SILENCE, silence)
                found[lamp.group].append(lamp)
        return found


def worst(lamps: Iterable[StatusLamp]) -> StatusLamp | None:
    return max(lamps, key=lambda lamp: lamp.level, default=None)


def overall(groups: Mapping[str, list[StatusLamp]]) -> tuple[Severity, str]:
    """Return severity and reason of all groups together; without a status of the model, nothing is well."""
    lamp = worst(lamp for lamps in groups.values() for lamp in lamps)
    if lamp is None or (lamp.level < Severity.ERROR and not groups["model"]):
        return Severity.STALE, "no message from the twin"
    return lamp.level, "everything as expected" if lamp.level == Severity.OK else f"{lamp.name}: {lamp.reason}"


def _lamp(name: str, status: Any, clock: float) -> StatusLamp:
    raw = status.level
    level = LEVELS[(raw[0] if isinstance(raw, bytes) else int(raw)) % len(LEVELS)]
    values = {pair.key: _number(pair.value) for pair in status.values}
    quantity, limit = _judged(values, level)
    age = clock - values["since_s"] if isfinite(values.get("since_s", nan)) else nan
    figures = {key: value for key, value in values.items() if isfinite(value)} if name in WITH_FIGURES else {}
    return StatusLamp(
        name, _group(name), level, text(status.message), text(quantity), values.get(quantity, nan), limit, age,
        values.get(ENDED) == 1.0, figures,
    )  # fmt: skip


def _group(name: str) -> str:
    if name in ("model", "swing", "tip load"):
        return "model"
    kind = name.split(" ")[0]
    return {"sensor": "sensors", "residual": "residuals", HEALTH: "residuals", "recording": "recorder"}.get(kind, "timing")


def _judged(values: Mapping[str, float], level: Severity) -> tuple[str, float]:
    """Return name and limit of the quantity that is nearest to, or farthest beyond, a limit of the present level."""
    best, found = -inf, ("", nan)
    kinds = {Severity.ERROR: ("_error",), Severity.STALE: ("_stale",)}.get(level, _LIMITS)
    for key, limit in values.items():
        kind = next((kind for kind in kinds if key.endswith(kind)), None)
        if kind is None or isnan(value := values.get(key.removesuffix(kind), nan)) or not limit > 0.0:
            continue
        share = limit / value if key.startswith("disk_left") and value > 0.0 else value / limit
        if share > best:
            best, found = share, (key.removesuffix(kind), limit)
    return found


def text(found: str) -> str:
    """Return a text as it may be shown: the beginning of a long one, control characters as escapes."""
    longest_text = 500  # characters of a text that are kept
    return printable(found[:longest_text], keep="")


def _number(value: str) -> float:
    try:
        return float(value)
    except ValueError:
        return nan


MAX_ALARMS = 500  # alarms that are kept


@dataclass(slots=True)
class ListedAlarm:
    """Alarm in the list: a lamp that was not well, or an alarm of the health monitor.

    Those of lamps have no `fault`. Only the health monitor's have a `cause` and `causes`, the most probable first, each with
    its probability (NaN where the sensor itself gives it away), and `stops` if the boom is to be stopped.
    """

    number: int  # by which it is acknowledged
    name: str
    level: Severity  # the worst; of the health monitor ERROR where the cause is named, else WARN
    reason: str  # of the worst level; of the health monitor the newest
    begin: float  # s, session time
    end: float | None = None  # None while it lasts
    is_acknowledged: bool = False
    causes: tuple[tuple[str, float], ...] = ()
    evidence: str = ""
    words: dict[str, str] = field(default_factory=dict)  # the sentence by language
    stops: bool = False
    fault: str = ""  # kind of fault in one word, see `boom_twin.types.Alarm`
    cause: str | None = None  # parameter or sensor at fault; None if it is not known


class AlarmList:
    """List of alarms, which begin and end as the lamps leave and reach the level OK."""

    def __init__(self) -> None:
        self.all: list[ListedAlarm] = []  # the newest `MAX_ALARMS`, by their begin
        self._open: dict[str, ListedAlarm] = {}
        self._judged: dict[tuple[str, int], ListedAlarm] = {}
        self._number = 0

    def follow(self, time: float, statuses: StatusTable) -> None:
        """Update the alarms to the lamps at `time` (s), except the lamp of the rig's health, see `judge`."""
        longest_name = 100  # characters beyond which an alarm names no more sensors
        told = ((f"{node}: {lamp.name}", lamp) for node, (_, lamps) in statuses.nodes.items() for lamp in lamps)
        judged = {channel for channel, _ in self._judged}
        lamps = {key: lamp for key, lamp in told if lamp.name != HEALTH and lamp.channel not in judged}
        for key in [key for key in self._open if key not in lamps or lamps[key].level <= Severity.OK]:
            gone = self._open.pop(key)
            gone.end = None if any(gone is each for each in self._open.values()) else time
        begun: dict[tuple[str, Severity], ListedAlarm] = {}  # sensors that fall silent together are one alarm
        for key, lamp in lamps.items():
            alarm = self._open.get(key)
            if alarm is None and lamp.level > Severity.OK:
                same = (lamp.reason, lamp.level)
                if same in begun and len(begun[same].name) < longest_name:
                    begun[same].name += f", {lamp.channel or lamp.name}"
                self._open[key] = begun.setdefault(same, begun.get(same) or self.add(lamp.name, lamp.level, lamp.reason, time))
            elif alarm is not None and lamp.level > alarm.level:
                alarm.level, alarm.reason, alarm.is_acknowledged = lamp.level, lamp.reason, False

    def judge(self, now: float, told: Sequence[Alarm], time: Callable[[int], float]) -> None:
        """Update the alarms of the rig's health to those reported at `now` (s): active ones and those that have just ended.

        `time` converts a stamp to seconds. An alarm that is no longer reported has ended. It must be acknowledged again if its
        most probable cause changes, and when it ends.
        """
        lasting: dict[tuple[str, int], ListedAlarm] = {}
        for found in told:
            key = found.channel, found.since
            alarm = self._judged.pop(key, None) or self.add(text(found.channel), Severity.WARN, "", 0.0)
            _renew(alarm, found, time)
            self._fold(found.channel)
            if found.until is None:
                lasting[key] = alarm
        for alarm in self._judged.values():
            alarm.end, alarm.is_acknowledged = now, False
        self._judged = lasting

    def _fold(self, channel: str) -> None:
        """Remove the alarms of lamps of a channel that has a health alarm: one fault is one alarm."""
        names = [f"{kind} {channel}" for kind in SENSOR_GROUPS]
        for key in [key for key, alarm in self._open.items() if alarm.name in names]:
            gone = self._open.pop(key)
            self.all = [each for each in self.all if each is not gone]

    def active(self, time: float) -> list[ListedAlarm]:
        """Return the health alarms that were active at `time` (s), the gravest first."""
        found = [each for each in self.all if each.causes and each.begin <= time and (each.end is None or time < each.end)]
        return sorted(found, key=lambda alarm: (not alarm.stops, -alarm.level))

    def lamps(self, time: float) -> Iterable[StatusLamp]:
        """Yield the health alarms that were active at `time` (s), as lamps."""
        for alarm in self.active(time):
            yield StatusLamp(alarm.name, "residuals", alarm.level, alarm.reason, age=time - alarm.begin)

    def shift(self, seconds: float) -> None:
        """Move all times by so much, because the origin of times has moved."""
        for alarm in self.all:
            alarm.begin += seconds
            alarm.end = None if alarm.end is None else alarm.end + seconds

    def add_gap(self, channel: str, begin: float, end: float) -> None:
        """Add a gap between two stamps of a channel."""
        alarm = self.add(channel, Severity.WARN, alarm_text(channel, "gap", None), begin, end)
        alarm.words, alarm.evidence, alarm.fault = _words(channel, "gap", None), f"{end - begin:.2f} s", "gap"

    def add(self, name: str, level: Severity, reason: str, begin: float, end: float | None = None) -> ListedAlarm:
        """Add an alarm, with its end (s) if it is over, such as a gap."""
        self._number += 1
        alarm = ListedAlarm(self._number, name, level, reason, begin, end)
        self.all = [*self.all[-MAX_ALARMS + 1 :], alarm]
        return alarm

    def acknowledge(self, number: int) -> ListedAlarm | None:
        """Acknowledge an alarm by its number and return it; None if there is no such alarm."""
        alarm = next((each for each in self.all if each.number == number), None)
        if alarm is not None:
            alarm.is_acknowledged = True
        return alarm


def _words(channel: str, kind: str, cause: str | None) -> dict[str, str]:
    return {language: text(alarm_text(channel, kind, cause, language)) for language in LANGUAGES}


def _renew(alarm: ListedAlarm, found: Alarm, time: Callable[[int], float]) -> None:
    causes = tuple((text(each.cause), each.probability) for each in found.ranked) or ((text(found.cause or "not known"), nan),)
    is_same = [each[0] for each in causes[:1]] == [each[0] for each in alarm.causes[:1]]
    alarm.is_acknowledged &= is_same and found.until is None
    alarm.level = Severity.WARN if found.cause is None else Severity.ERROR
    alarm.reason, alarm.begin, alarm.causes = text(found.told), time(found.since), causes
    alarm.evidence = text(evidence_with_cause(found.evidence, causes))
    alarm.words = _words(found.channel, found.kind, found.cause)
    alarm.fault, alarm.cause = text(found.kind), None if found.cause is None else text(found.cause)
    alarm.stops = alarm_sentence(found.channel, found.kind, found.cause).stops
    alarm.end = None if found.until is None else time(found.until)
