"""Two sessions side by side: what differs, how sure that is, and whether it can be chance."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import Any

from ..offline.replay import alarm_as_text
from .quantities import Quantity
from .side import Side

SURE = 4.0
"""Standard deviations from which a difference is no chance: one in a thousand for means of ten batches (t distribution)."""


@dataclass(frozen=True, slots=True)
class Row:
    """One figure of both sessions, None where a session has none of it.

    Attributes
    ----------
    name, unit : str
    a, b, difference : float or None
        The difference is b minus a.
    sigma : float or None
        Standard deviation of the difference; None where that of a or b is not known.
    is_significant : bool or None
        None where nobody can say.
    """

    name: str
    unit: str
    a: float | None
    b: float | None
    difference: float | None = None
    sigma: float | None = None
    is_significant: bool | None = None


def rows_of(one: Side, other: Side) -> list[Row]:
    """All figures that either has, in the order of the first."""
    left, right = ({each.name: each for each in side.quantities} for side in (one, other))
    return [_row(name, left.get(name), right.get(name)) for name in dict.fromkeys([*left, *right])]


def _row(name: str, a: Quantity | None, b: Quantity | None) -> Row:
    if a is None or b is None:
        known = a or b
        assert known is not None
        return Row(name, known.unit, a.value if a else None, b.value if b else None)
    difference = b.value - a.value
    if a.sigma is None or b.sigma is None:
        return Row(name, a.unit, a.value, b.value, difference)
    sigma = hypot(a.sigma, b.sigma)
    return Row(name, a.unit, a.value, b.value, difference, sigma, abs(difference) > SURE * sigma)


def flat(one: Side, other: Side, rows: list[Row]) -> dict[str, Any]:
    """As one flat object: every column of the table as a list, and the alarms in words."""
    columns = ("name", "unit", "a", "b", "difference", "sigma", "is_significant")
    return {
        "session_a": one.name,
        "session_b": other.name,
        "incomplete_a": one.incomplete or None,
        "incomplete_b": other.incomplete or None,
        "same_scene": one.scene == other.scene,
        **{column: [getattr(row, column) for row in rows] for column in columns},
        "alarms_a": [alarm_as_text(alarm) for alarm in one.alarms],
        "alarms_b": [alarm_as_text(alarm) for alarm in other.alarms],
    }


def as_text(one: Side, other: Side, rows: list[Row]) -> list[str]:
    """A table, then the alarms."""
    lines = [f"{'':32s} {'A':>12s} {'B':>12s} {'B - A':>12s} {'+-':>10s}"]
    for row in rows:
        numbers = "".join(f" {_number(value):>12s}" for value in (row.a, row.b, row.difference))
        mark = {True: "differs", False: "", None: "?"}[row.is_significant]
        lines.append(f"{row.name:32s}{numbers} {_number(row.sigma):>10s}  {row.unit:6s} {mark}".rstrip())
    lines += ["", f"differs: by more than {SURE:g} standard deviations; ?: it is not known how sure the figures are"]
    lines.append("damping, peaks, moments and travel also differ where postures and moves do")
    for letter, side in (("A", one), ("B", other)):
        lines.append(f"alarms of {letter}, {side.name}: {len(side.alarms) or 'none'}")
        lines += [f"  {alarm_as_text(alarm)}" for alarm in side.alarms]
    return lines


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"
