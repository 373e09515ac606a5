"""The state of everything as lamps, grouped as an operator looks for it, from the statuses on ``/diagnostics``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from math import inf, isfinite, isnan, nan
from typing import Any

from ..watch.recording import ENDED
from .checks import text

SILENCE = 3.0
"""Seconds without a word from a node after which its lamps are stale."""
MOST_NODES, FORGOTTEN = 200, 60.0
"""Where more nodes than so many have told something, those that have been silent for so many seconds are forgotten."""
GROUPS = ("sensors", "model", "residuals", "timing", "recorder")
HEALTH = "health"
"""The status that stands for all alarms of the rig's health."""
_LIMITS = ("_error", "_warn", "_stale")


class Level(IntEnum):
    """By rising severity, which is not the order of diagnostic_msgs."""

    OFF = 0
    OK = 1
    WARN = 2
    STALE = 3
    ERROR = 4


LEVELS = (Level.OK, Level.WARN, Level.ERROR, Level.STALE)
"""By the number in diagnostic_msgs/DiagnosticStatus."""


@dataclass(frozen=True, slots=True)
class Lamp:
    """One status of a node.

    Attributes
    ----------
    name, group, reason : str
    level : Level
    quantity : str
        What was judged, its unit at the end; empty if nothing was.
    value, limit : float
    age : float
        Seconds that the level had lasted when it was told; NaN if not known.
    is_last : bool
        Whether its node said that no further one comes.
    """

    name: str
    group: str
    level: Level
    reason: str
    quantity: str = ""
    value: float = nan
    limit: float = nan
    age: float = nan
    is_last: bool = False


@dataclass(frozen=True)
class Board:
    """All lamps by node, each with the time (s) at which that node last told them."""

    nodes: Mapping[str, tuple[float, tuple[Lamp, ...]]] = field(default_factory=dict)

    def told(self, now: float, statuses: Iterable[Any], clock: float) -> Board:
        """The board after one DiagnosticArray of one or more nodes.

        Parameters
        ----------
        now : float
            Time of its arrival, s, as given to `groups` later.
        statuses : iterable of diagnostic_msgs/DiagnosticStatus
        clock : float
            Its stamp, s.
        """
        found: dict[str, list[Lamp]] = {}
        for status in statuses:
            node, _, name = text(status.name).partition(": ")
            found.setdefault(node, []).append(_lamp(name or node, status, clock))
        nodes = {**self.nodes, **{node: (now, tuple(lamps)) for node, lamps in found.items()}}
        if len(nodes) > MOST_NODES:
            nodes = {node: told for node, told in nodes.items() if now - told[0] <= FORGOTTEN}
        return Board(nodes)

    def groups(self, now: float) -> dict[str, list[Lamp]]:
        """Lamps by group; those of a node that is silent, and did not say that it ended, are stale, whatever they were."""
        found: dict[str, list[Lamp]] = {group: [] for group in GROUPS}
        for node, (heard, lamps) in self.nodes.items():
            silence = now - heard
            for lamp in lamps:
                if silence > SILENCE and not lamp.is_last:
                    words = f"no word from {node}"
                    lamp = Lamp(lamp.name, lamp.group, Level.STALE, words, "silence_s", silence, SILENCE, silence)
                found[lamp.group].append(lamp)
        return found


def worst(lamps: Iterable[Lamp]) -> Lamp | None:
    """The lamp of the highest level, the first of equal ones."""
    return max(lamps, key=lambda lamp: lamp.level, default=None)


def overall(groups: Mapping[str, list[Lamp]]) -> tuple[Level, str]:
    """Level and reason of everything; without a word about the model nothing is well."""
    lamp = worst(lamp for lamps in groups.values() for lamp in lamps)
    if lamp is None or (lamp.level < Level.ERROR and not groups["model"]):
        return Level.STALE, "no word from the twin"
    return lamp.level, "everything as expected" if lamp.level == Level.OK else f"{lamp.name}: {lamp.reason}"


def _lamp(name: str, status: Any, clock: float) -> Lamp:
    raw = status.level
    level = LEVELS[(raw[0] if isinstance(raw, bytes) else int(raw)) % len(LEVELS)]
    values = {pair.key: _number(pair.value) for pair in status.values}
    quantity, limit = _judged(values, level)
    age = clock - values["since_s"] if isfinite(values.get("since_s", nan)) else nan
    is_last = values.get(ENDED) == 1.0
    return Lamp(name, _group(name), level, text(status.message), text(quantity), values.get(quantity, nan), limit, age, is_last)


def _group(name: str) -> str:
    if name == "model":
        return "model"
    kind = name.split(" ")[0]
    return {"sensor": "sensors", "residual": "residuals", HEALTH: "residuals", "recording": "recorder"}.get(kind, "timing")


def _judged(values: Mapping[str, float], level: Level) -> tuple[str, float]:
    """The quantity that is nearest to, or farthest beyond, a limit of the present level; its name and that limit."""
    best, found = -inf, ("", nan)
    kinds = {Level.ERROR: ("_error",), Level.STALE: ("_stale",)}.get(level, _LIMITS)
    for key, limit in values.items():
        kind = next((kind for kind in kinds if key.endswith(kind)), None)
        if kind is None or isnan(value := values.get(key.removesuffix(kind), nan)) or not limit > 0.0:
            continue
        share = limit / value if key.startswith("disk_left") and value > 0.0 else value / limit
        if share > best:
            best, found = share, (key.removesuffix(kind), limit)
    return found


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return nan
