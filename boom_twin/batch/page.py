"""``batch.html``: all sessions of a batch in a table that sorts itself, and trends over time for every rig."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from datetime import UTC, datetime
from html import escape
from math import isfinite
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ..report.html import heading, page, paragraph
from ..system.atomic_files import write_atomic
from ..types import SECOND, sensor_kind
from .results import SESSIONS, counts
from .session_task import OK, Row

_SORT = """<script>
const compared = (a, b) => isNaN(a) || isNaN(b) ? a.localeCompare(b) : a - b;
document.querySelectorAll('table.sorted th').forEach((head, column) => head.onclick = () => {
  const body = head.closest('table').tBodies[0], way = head.dataset.way === '1' ? -1 : 1;
  const key = row => row.cells[column].dataset.key;
  head.dataset.way = way;
  const order = (a, b) => a === '' || b === '' ? (a === '') - (b === '') : way * compared(a, b);
  [...body.rows].sort((one, other) => order(key(one), key(other))).forEach(row => body.append(row));
});
</script>
<style>
body { max-width: 1400px } svg { width: 100%; max-width: 1000px; font: 12px sans-serif; fill: #555 } .wide { overflow-x: auto }
table.sorted td { white-space: nowrap } table.sorted td:last-child { white-space: normal; min-width: 8em }
@media (max-width: 1300px) { table.sorted { font-size: 13px } table.sorted th, table.sorted td { padding: .22em .4em } }
table.sorted th { cursor: pointer } tr.failed td { background: #fff0e6 }
</style>"""

_TRENDS = ("residual_rms_", "frequency_ratio_mode_", "damping_mode_", "calibrated_")
"""First part of the names of figures that are drawn over time."""
_MOST_TRENDS = 24
_WIDTH, _HEIGHT, _EDGE = 1000.0, 150.0, 14.0
_SCALE, _DATES = 90.0, 24.0
"""Room for the numbers left of a drawing, and for the times below it."""
_MINUTE = 60.0  # s; sessions that are nearer are drawn as near as they are


def write_page(path: Path, rows: Sequence[Row]) -> None:
    """Write the page beside the folder of the replays. The page loads nothing from other files."""
    right, wrong = counts(rows)
    alarmed = sum(bool(row.get("alarms")) for row in rows)
    parts = [
        heading(f"Batch of {len(rows)} sessions", 1),
        paragraph(f"{right} right, of which {alarmed} with alarms; {wrong} failed.", "alarm" if wrong or alarmed else "well"),
        paragraph("A click on a column's title sorts by it. All figures are in sessions.parquet.", "note"),
        _table(rows),
        *_trends(rows),
        _SORT,
    ]
    write_atomic(path, page("Batch of sessions", parts))


_COLUMNS = (
    "session", "rig", "begin", "state", "duration, s", "times real time", "alarms", "causes",
    "worst residual / expected", "lowest mode / model", "tip, m/s² at most", "left out", "reason",
)  # fmt: skip


def _table(rows: Sequence[Row]) -> str:
    titles = "".join(f"<th>{escape(title)}</th>" for title in _COLUMNS)
    table = f'<table class="sorted"><thead><tr>{titles}</tr></thead><tbody>{"".join(map(_line, rows))}</tbody></table>'
    return f'<div class="wide">{table}</div>'


def _line(row: Row) -> str:
    name = escape(str(row["session"]))
    if row.get("report"):
        name = f'<a href="{SESSIONS}/{quote(row["key"])}/report.html">{name}</a>'
    alarms = row.get("alarms") or []
    deviations = [value for value in row.get("joint_residual_normalised_std") or [] if value is not None]
    values: list[Any] = [
        row.get("rig"), _time(row.get("first_stamp_ns")), row["status"], row.get("duration_s"), row.get("realtime_factor"),
        len(alarms) if row["status"] == OK else None, ", ".join(sorted({alarm["cause"] or alarm["kind"] for alarm in alarms})),
        max(deviations, default=None), row.get("frequency_ratio_mode_1"), row.get("tip_acceleration_max_m_s2"),
        row.get("dropped"), row.get("reason"),
    ]  # fmt: skip
    cells = f'<td data-key="{escape(str(row["session"]))}">{name}</td>' + "".join(map(_cell, values))
    return f'<tr class="{escape(row["status"])}">{cells}</tr>'


def _cell(value: object) -> str:
    if value is None or (isinstance(value, float) and not isfinite(value)):
        return '<td class="n" data-key="">-</td>'
    if isinstance(value, float | int):
        return f'<td class="n" data-key="{value!r}">{value:.4g}</td>'
    return f'<td data-key="{escape(str(value))}">{escape(str(value))}</td>'


def _time(stamp: int | None) -> str | None:
    return None if stamp is None else datetime.fromtimestamp(stamp // SECOND, UTC).strftime("%Y-%m-%d %H:%M:%S")


# -- trends -----------------------------------------------------------------------------------------------------------


def _trends(rows: Sequence[Row]) -> Iterable[str]:
    """Yield drawings of wear-related figures over time, for every rig with several sessions."""
    rigs: dict[str, list[Row]] = {}
    for row in rows:
        if row["status"] == OK:
            rigs.setdefault(row["rig"], []).append(row)
    for rig, found in sorted(rigs.items()):
        found.sort(key=lambda row: int(row["first_stamp_ns"]))
        names = sorted({name for row in found for name in row if name.startswith(_TRENDS) and not name.endswith("_sigma")})
        drawn = [drawing for name in names if (drawing := _trend(name, found))][:_MOST_TRENDS]
        if drawn:
            yield heading(f"Over time: {rig}")
            yield paragraph("Sessions by the stamp of their first prediction; bars are standard deviations.", "note")
            yield from drawn


def _trend(name: str, rows: Sequence[Row]) -> str:
    """Return a drawing of one figure over time; empty for fewer than two values."""
    found = [
        (row["first_stamp_ns"] / SECOND, row[name], row.get(f"{name}_sigma") or 0.0) for row in rows if _is_number(row, name)
    ]
    if len(found) < 2:
        return ""
    times, (low, high) = (
        [time for time, _, _ in found],
        _span([value + way * sigma for _, value, sigma in found for way in (-1, 1)]),
    )
    low = max(low, 0.0) if min(value for _, value, _ in found) >= 0.0 else low
    first, last = min(times), max(times)
    last = max(last, first + _MINUTE)

    def place(time: float, value: float) -> tuple[float, float]:
        x = _SCALE + _EDGE + (time - first) / (last - first) * (_WIDTH - _SCALE - 2.0 * _EDGE)
        return x, _HEIGHT - _DATES - _EDGE - (value - low) / (high - low) * (_HEIGHT - _DATES - 2.0 * _EDGE)

    line = " ".join("{:.1f},{:.1f}".format(*place(time, value)) for time, value, _ in found)
    marks = ""
    for time, value, sigma in found:
        (x, y), (_, top), (_, bottom) = place(time, value), place(time, value + sigma), place(time, value - sigma)
        marks += f'<path d="M{x:.1f} {top:.1f}V{bottom:.1f}" stroke="#8A8A8A"/>'
        marks += f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="#0072B2"/>'
    unit = _unit(name)
    label = f"{name}{f', {unit}' if unit else ''}: {found[0][1]:.4g} in the first session, {found[-1][1]:.4g} in the last"
    drawing = f'{_axes(place, (first, last), (low, high))}<polyline points="{line}" fill="none" stroke="#56B4E9"/>{marks}'
    size = f'viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}"'
    return f'<div class="block">{paragraph(label)}<svg {size} role="img">{drawing}</svg></div>'


def _axes(place: Callable[[float, float], tuple[float, float]], times: tuple[float, float], values: tuple[float, float]) -> str:
    """Return lines with their values at the ends and the middle of the range, and the first and last time (s)."""
    (low, high), marks = values, ""
    for value in (low, 0.5 * (low + high), high):
        (left, y), (right, _) = place(times[0], value), place(times[1], value)
        marks += f'<path d="M{left:.1f} {y:.1f}H{right:.1f}" stroke="#DDD"/>'
        marks += f'<text x="{left - 8.0:.1f}" y="{y + 4.0:.1f}" text-anchor="end">{value:.4g}</text>'
    for time, anchor in zip(times, ("start", "end"), strict=True):
        x, _ = place(time, low)
        told = _time(round(time * SECOND))
        marks += f'<text x="{x:.1f}" y="{_HEIGHT - 6.0:.1f}" text-anchor="{anchor}">{told}</text>'
    return marks


def _unit(name: str) -> str:
    """Return the unit of a residual, which is that of its sensor; empty for other figures."""
    channel = name.removeprefix("residual_rms_")
    return "" if channel == name else next(iter(sensor_kind(channel).units))


def _is_number(row: Row, name: str) -> bool:
    return isinstance(row.get(name), float | int) and isfinite(row[name])


def _span(values: Sequence[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    margin = 0.05 * (high - low) or abs(low) * 1e-3 or 1.0
    return low - margin, high + margin
