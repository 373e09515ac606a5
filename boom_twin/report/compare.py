"""Compare two sessions: what differs, how sure that is, and whether it can be chance."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, fields
from math import hypot
from pathlib import Path
from typing import Any

from ..bag.session_file import WHOLE, TimeWindow
from ..bag.session_model import incompleteness
from ..bag.writer import FILE_NAME as RESULT
from ..errors import BagError, UsageError
from ..offline.recording import alarm_as_text
from ..system.received_files import holds_file, open_received, sha256_of
from .quantities import Quantity, read


@dataclass(frozen=True)
class ComparedSession:
    """Figures and alarms of one session, for a comparison."""

    name: str
    scene: str  # digest of its scene
    quantities: list[Quantity]
    alarms: list[dict[str, Any]]  # as in ``summary.json``
    incomplete: str = ""  # why the session is not whole, in words


def side_of(path: Path, replayed: Callable[[Path], Path], window: TimeWindow = WHOLE) -> ComparedSession:
    """Return one side from a replay folder, or from a session that `replayed` makes one of, for the `window`.

    BagError if the session cannot be replayed, or the folder is incomplete or without figures that can be read. UsageError
    for a window of a replay folder, which has its own.
    """
    is_replay = holds_file(path / "summary.json")
    if is_replay and (told := incompleteness(path)):
        raise BagError(f"{path}: {told}")
    if is_replay and window != WHOLE:
        raise UsageError(f"{path}: a replay folder has its own window. Give the session itself with --start and --duration.")
    folder = path if is_replay else replayed(path)
    scene, found = read(folder)
    try:
        with open_received(folder / "summary.json") as file:
            summary = json.load(file)
        alarms, told = list(summary["alarms"]), summary["output_sha256"]
        incomplete = str(summary.get("session_incomplete", ""))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BagError(f"{folder / 'summary.json'}: {error}. Replay the session again with `boom_twin replay`.") from None
    bag = folder / "bag" / RESULT
    if bag.is_file() and sha256_of(bag) != told:
        raise BagError(f"{folder}: summary.json is not of the bag beside it. Replay the session again with `boom_twin replay`.")
    return ComparedSession(path.resolve().name, scene, found, alarms, incomplete)


SIGNIFICANT = 4.0
"""Standard deviations from which a difference is no chance: one in a thousand for means of ten batches (t distribution)."""


@dataclass(frozen=True, slots=True)
class ComparisonRow:
    """One figure of both sessions, None where a session has none of it."""

    name: str
    unit: str
    a: float | None
    b: float | None
    difference: float | None = None  # b minus a
    sigma: float | None = None  # standard deviation of the difference; None where that of a or b is not known
    is_significant: bool | None = None  # None where that is not known


def rows_of(one: ComparedSession, other: ComparedSession) -> list[ComparisonRow]:
    """Return all figures that either session has, in the order of the first."""
    left, right = ({each.name: each for each in side.quantities} for side in (one, other))
    return [_row(name, left.get(name), right.get(name)) for name in dict.fromkeys([*left, *right])]


def _row(name: str, a: Quantity | None, b: Quantity | None) -> ComparisonRow:
    if a is None or b is None:
        known = a or b
        assert known is not None
        return ComparisonRow(name, known.unit, a.value if a else None, b.value if b else None)
    difference = b.value - a.value
    if a.sigma is None or b.sigma is None:
        return ComparisonRow(name, a.unit, a.value, b.value, difference)
    sigma = hypot(a.sigma, b.sigma)
    return ComparisonRow(name, a.unit, a.value, b.value, difference, sigma, abs(difference) > SIGNIFICANT * sigma)


def flat(one: ComparedSession, other: ComparedSession, rows: list[ComparisonRow]) -> dict[str, Any]:
    """Return a comparison as one flat object: every column of the table as a list, and the alarms in words."""
    return {
        "session_a": one.name,
        "session_b": other.name,
        "incomplete_a": one.incomplete or None,
        "incomplete_b": other.incomplete or None,
        "same_scene": one.scene == other.scene,
        **{each.name: [getattr(row, each.name) for row in rows] for each in fields(ComparisonRow)},
        "alarms_a": [alarm_as_text(alarm) for alarm in one.alarms],
        "alarms_b": [alarm_as_text(alarm) for alarm in other.alarms],
    }


def as_text(one: ComparedSession, other: ComparedSession, rows: list[ComparisonRow]) -> list[str]:
    """Return the lines of a table, then of the alarms."""
    lines = [f"{'':32s} {'A':>12s} {'B':>12s} {'B - A':>12s} {'+-':>10s}"]
    for row in rows:
        numbers = "".join(f" {_number(value):>12s}" for value in (row.a, row.b, row.difference))
        mark = {True: "differs", False: "", None: "?"}[row.is_significant]
        lines.append(f"{row.name:32s}{numbers} {_number(row.sigma):>10s}  {row.unit:6s} {mark}".rstrip())
    lines += ["", f"differs: by more than {SIGNIFICANT:g} standard deviations; ?: it is not known how sure the figures are"]
    lines.append("damping, peaks and moments also differ where postures and moves do")
    for letter, side in (("A", one), ("B", other)):
        lines.append(f"alarms of {letter}, {side.name}: {len(side.alarms) or 'none'}")
        lines += [f"  {alarm_as_text(alarm)}" for alarm in side.alarms]
    return lines


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"
