"""Alarms of a run, collected from repeated `Health` reports, and alarms as named values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import degrees, nan

from ..types import NANO, Alarm, Health, Ranked

PROBABILITY = ": probability"
UNKNOWN = "unknown"  # cause: something else, or nothing


class Alarms:
    """All alarms of a run, each once.

    Attributes
    ----------
    all : list of Alarm
        Newest state of each alarm, in the order in which the alarms became known.
    """

    def __init__(self) -> None:
        self.all: list[Alarm] = []
        self._lasting: dict[tuple[str, int], int] = {}

    def take(self, health: Health) -> None:
        """Take the alarms of a report; an alarm that is not in it any more has ended."""
        told = {(alarm.channel, alarm.since): alarm for alarm in health.alarms}
        for key in [key for key in self._lasting if key not in told]:
            place = self._lasting.pop(key)
            self.all[place] = replace(self.all[place], until=health.stamp)
        for key, alarm in told.items():
            place = self._lasting.setdefault(key, len(self.all))
            self.all[place : place + 1] = [alarm]
            if alarm.until is not None:
                del self._lasting[key]

    def forget_ended(self) -> None:
        """Discard alarms that have ended."""
        self._keep(self.lasting)

    def fold_ended(self) -> list[Alarm]:
        """Keep only the newest of ended alarms with the same channel, kind and cause; return the others."""
        newest = {repeated(alarm): alarm for alarm in self.all if alarm.until is not None}
        gone = [alarm for alarm in self.all if alarm.until is not None and newest[repeated(alarm)] is not alarm]
        if gone:
            self._keep([alarm for alarm in self.all if alarm.until is None or newest[repeated(alarm)] is alarm])
        return gone

    def _keep(self, alarms: list[Alarm]) -> None:
        self.all = alarms
        self._lasting = {(alarm.channel, alarm.since): place for place, alarm in enumerate(alarms) if alarm.until is None}

    @property
    def lasting(self) -> list[Alarm]:
        """Alarms that have not ended."""
        return [self.all[place] for place in self._lasting.values()]


def repeated(alarm: Alarm) -> tuple[str, str, str | None]:
    """Return what is the same of an alarm that comes again: channel, kind and cause."""
    return alarm.channel, alarm.kind, alarm.cause


def values_of(alarm: Alarm) -> dict[str, str]:
    """Return an alarm as named values: times are stamps in s, units end the names, ``nan`` is not known."""
    found = {
        "kind": alarm.kind,
        "cause": alarm.cause or "",
        "from_s": f"{alarm.since * NANO:.3f}",
        "to_s": f"{nan if alarm.until is None else alarm.until * NANO:.3f}",
        "evidence": alarm.evidence,
    }
    for rank in alarm.ranked:
        found[rank.cause + PROBABILITY] = f"{rank.probability:.4g}"
        for kind, value, sigma, unit in rank.parts:
            named = f"{kind}_{unit}" if unit else kind
            found |= {f"{rank.cause}: {named}": f"{value:.6g}", f"{rank.cause}: sigma of {named}": f"{sigma:.3g}"}
    return found


def alarm_of(channel: str, values: Mapping[str, str]) -> Alarm:
    """Return an alarm from what `values_of` made of it: stamps to the millisecond, causes without what would be the matter.

    Raises
    ------
    KeyError, ValueError, ArithmeticError
        They are not the values of an alarm.
    """
    ranked = [
        Ranked(key.removesuffix(PROBABILITY), float(value), ()) for key, value in values.items() if key.endswith(PROBABILITY)
    ]
    since, end = _stamp(values["from_s"]), values["to_s"]
    until = None if end == "nan" else _stamp(end)
    return Alarm(channel, values["kind"], since, until, values["cause"] or None, values.get("evidence", ""), tuple(ranked))


def change_text(change: float, unit: str, sigma: float | None = None) -> str:
    """Return a change, with its standard deviation, in figures that read alike in all languages; angles in degrees."""
    factor, unit = (degrees(1.0), "deg") if unit == "rad" else (1.0, unit)
    doubt = "" if sigma is None else f" (+- {float(f'{factor * sigma:.2g}'):g})"
    return f"{float(f'{factor * change:.3g}'):+g} {unit}{doubt}"


def evidence_with_cause(evidence: str, causes: Iterable[tuple[str, float]]) -> str:
    """Return the evidence of an alarm with the probabilities of its two most probable causes."""
    known = [(cause, chance) for cause, chance in list(causes)[:2] if cause != UNKNOWN and chance >= 0.005]
    found = [f"{cause} {min(100.0 * chance, 99.0):.0f} %" for cause, chance in known]
    return "; ".join(part for part in (evidence, ", ".join(found)) if part)


def _stamp(seconds: str) -> int:
    """Return a stamp, ns."""
    return round(float(seconds) / NANO)
