"""The text messages to the page: plain values for JSON, where a number that is not known is null."""

from __future__ import annotations

import json
from dataclasses import asdict
from math import isfinite
from typing import Any

from .alarms import Alarm
from .dropped import Dropped
from .lamps import HEALTH, Lamp, Level, overall, worst
from .store import Store


def state(store: Store, now: float, time: float, dropped: Dropped | None = None) -> dict[str, Any]:
    """The lamps at `now` (s, the time they count by), while the newest data are of `time` (s), and what was dropped.

    All is not well where messages were dropped, whatever the lamps say: they may have told otherwise.
    """
    groups = store.board(now).groups(now)
    groups["residuals"] = _with_alarms(groups["residuals"], list(store.alarms.lamps(time)))
    level, reason = overall(groups)
    losses = [] if dropped is None else dropped.told()
    if losses and level == Level.OK:
        level, reason = Level.WARN, f"messages dropped: {sum(loss['count'] for loss in losses)}, see below"
    told = [{"name": name, **_group(lamps)} for name, lamps in groups.items()]
    return {"kind": "state", "time": time, "level": level.name, "reason": reason, "groups": told, "dropped": losses}


def layout(store: Store) -> dict[str, Any]:
    """The tables that there are."""
    tables = [{"name": table.name, "columns": table.columns} for table in store.tables.values()]
    return {"kind": "layout", "epoch_ns": str(store.epoch), "tables": tables}


def alarms(found: list[Alarm]) -> dict[str, Any]:
    """All alarms, oldest first."""
    return {"kind": "alarms", "alarms": [{**asdict(alarm), "level": alarm.level.name} for alarm in found]}


def dump(message: Any) -> str:
    """As JSON."""
    return json.dumps(_plain(message), allow_nan=False, separators=(",", ":"))


def _with_alarms(lamps: list[Lamp], alarms: list[Lamp]) -> list[Lamp]:
    """Lamps with the rig's health as the alarms that last; a lamp that stands for them goes, unless its node is silent."""
    health = next((lamp for lamp in lamps if lamp.name == HEALTH), None)
    if not alarms or (health is not None and health.level == Level.STALE):
        return lamps
    return [*alarms, *(lamp for lamp in lamps if lamp is not health)]


def _group(lamps: list[Lamp]) -> dict[str, Any]:
    lamp = worst(lamps)
    if lamp is None:
        return {"level": Level.OFF.name, "reason": "not there", "lamps": []}
    reason = f"{len(lamps)} as expected" if lamp.level == Level.OK and len(lamps) > 1 else lamp.reason
    return {"level": lamp.level.name, "reason": reason, "lamps": [{**asdict(each), "level": each.level.name} for each in lamps]}


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return value
