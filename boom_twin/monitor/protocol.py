"""Protocol of the live page: binary and text messages to the browser.

A binary message is a sequence of blocks. A block has a multiple of 8 bytes. Numbers are little endian:

======  =====================  ========================================================================================
offset  type                   meaning
======  =====================  ========================================================================================
0       uint8                  kind: 1 = rows of a table, 2 = spectrum
1       uint8                  index of the table in the newest ``layout`` message
2       uint16                 columns, c
4       uint32                 rows, k
8       float64 x k            kind 1: seconds since the session's epoch; kind 2: frequencies, Hz
8 + 8k  float32 x k x c        values column by column, then zeros up to a multiple of 8 bytes
======  =====================  ========================================================================================

A spectrum has two columns: the directions named by the message ``lines`` before it. Text messages are JSON with a key ``kind``:
``hello``, ``layout``, ``reset``, ``state``, ``alarms``, ``lines``, ``answer``.
"""

from __future__ import annotations

import struct
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..system.result_text import json_text
from ..types import SENSORS
from .data.status import HEALTH, ListedAlarm, Severity, StatusLamp, overall, worst
from .data.store import DroppedMessages, Store
from .data.topic_rows import RESIDUALS

ROWS, SPECTRUM = 1, 2
HEAD = struct.Struct("<BBHI")


def pack(kind: int, table: int, times: NDArray[np.float64], values: NDArray[np.float32]) -> bytes:
    """Return one block: `times` (k,), `values` (k, c)."""
    rows, columns = values.shape
    body = values.T.astype("<f4").tobytes()
    return HEAD.pack(kind, table, columns, rows) + times.astype("<f8").tobytes() + body + bytes(-len(body) % 8)


def state(store: Store, now: float, time: float, dropped: DroppedMessages | None = None) -> dict[str, Any]:
    """Return the message ``state``: lamps at `now` (s, on the lamps' clock), time (s) of the newest data, dropped messages.

    The level is at least WARN if messages were dropped, because they may have changed the lamps. `action` is the advice:
    ``go``, ``look``, ``stop``, or ``unknown``. `alarm` is the number of the alarm in `reason`, or None.
    """
    groups = store.statuses(now).groups(now)
    groups["residuals"] = _with_alarms(groups["residuals"], list(store.alarms.lamps(time)))
    level, reason = overall(groups)
    losses = [] if dropped is None else dropped.losses()
    if losses and level == Severity.OK:
        level, reason = Severity.WARN, "messages dropped"
    alarm = next(iter(store.alarms.active(time)), None)
    model = worst(groups["model"])
    has_failed = model is not None and model.level == Severity.ERROR
    if alarm is not None and alarm.level >= level and not (has_failed and not alarm.stops):
        reason = alarm.reason
    else:
        alarm = None
    is_swing = has_failed and model is not None and model.name == SWING
    stops = level == Severity.ERROR and (is_swing if alarm is None else alarm.stops)
    told = [{"name": name, **_group(lamps)} for name, lamps in groups.items()]
    message = {"kind": "state", "time": time, "level": level.name, "action": "stop" if stops else ACTIONS[level]}
    number = None if alarm is None else alarm.number
    return message | {"reason": reason, "alarm": number, "groups": told, "dropped": losses}


ACTIONS = {
    Severity.OFF: "unknown", Severity.OK: "go", Severity.WARN: "look", Severity.STALE: "unknown", Severity.ERROR: "look",
}  # fmt: skip
SWING = "swing"  # status whose ERROR means: stop the boom


def layout(store: Store) -> dict[str, Any]:
    """Return the message ``layout``: all tables, residuals with title, unit and display factor."""
    tables = [{"name": name, "columns": table.columns, **_residuals(name)} for name, table in store.tables.items()]
    return {"kind": "layout", "epoch_ns": str(store.epoch), "tables": tables}


def _residuals(table: str) -> dict[str, Any]:
    stream = next((stream for stream, name in RESIDUALS.items() if name == table), None)
    if stream is None:
        return {}
    factor, unit = SENSORS[stream].shown_unit
    return {"residuals": {"title": SENSORS[stream].title, "factor": factor, "unit": unit}}


def alarms(found: list[ListedAlarm]) -> dict[str, Any]:
    return {"kind": "alarms", "alarms": [{**asdict(alarm), "level": alarm.level.name} for alarm in found]}


def dump(message: Any) -> str:
    return json_text(message, separators=(",", ":"))


def _with_alarms(lamps: list[StatusLamp], alarms: list[StatusLamp]) -> list[StatusLamp]:
    """Return the lamps with active alarms in place of the health lamp, unless that is STALE."""
    health = next((lamp for lamp in lamps if lamp.name == HEALTH), None)
    if not alarms or (health is not None and health.level == Severity.STALE):
        return lamps
    return [*alarms, *(lamp for lamp in lamps if lamp is not health)]


def _group(lamps: list[StatusLamp]) -> dict[str, Any]:
    lamp = worst(lamps)
    if lamp is None:
        return {"level": Severity.OFF.name, "reason": "not there", "lamps": []}
    reason = f"{len(lamps)} as expected" if lamp.level == Severity.OK and len(lamps) > 1 else lamp.reason
    return {"level": lamp.level.name, "reason": reason, "lamps": [{**asdict(each), "level": each.level.name} for each in lamps]}
