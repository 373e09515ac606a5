"""Words for the results of a commissioning check."""

from __future__ import annotations

import math

from ..types import SENSORS
from .check import Checked, Verdict
from .readings import Channel

UNEXPLAINED = "no name, unit, sign or zero explains its readings"
ABSENT = "in no message: no such sensor, or it is broken"
STROKES_ALONE = "strokes are within the travels; swapped or shifted ones show only beside angles, forces or an IMU"


def reading(way: Channel) -> str:
    """Return how a channel is read."""
    parts = [way.name, way.unit]
    parts += ["sign -1"] if way.sign < 0 else []
    parts += [f"zero {way.zero:.6g}"] if way.zero else []
    parts += [f"scale {way.scale:g}"] if way.scale != 1.0 else []
    parts += [f"absolute at the {way.absolute}"] if way.absolute else []
    parts += [f"turned by {math.degrees(way.turned):+.1f} deg"] if way.turned else []
    return ", ".join(parts)


def finding(verdict: Verdict, checked: Checked) -> str:
    """Return the finding about a channel."""
    if checked.lacks(verdict):
        return ABSENT
    if not verdict.is_wrong:
        return "within the travel" if checked.has_strokes_alone else "as declared"
    if not verdict.is_explained or verdict.best is None:
        return f"not as declared: {UNEXPLAINED}"
    if verdict.is_sure:
        return likely(verdict)
    why = "several ways explain it" if checked.moved else "the boom stood still"
    return f"not as declared; not determined: {why}; {likely(verdict)}"


def likely(verdict: Verdict) -> str:
    """Return the most likely way in which a wrong channel is read."""
    way = "gravity taken out" if verdict.has_no_gravity or verdict.best is None else reading(verdict.best)
    return way if verdict.is_sure else f"perhaps {way}"


def channel_name(verdict: Verdict) -> str:
    """Return the name that alarms give the sensor."""
    kind = SENSORS[verdict.stream]
    return kind.stem if kind.is_accelerometer else verdict.channel
