"""``batch.html``: all sessions of a batch in a table that sorts itself, and trends over time for every rig."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from html import escape
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import quote

from ..plots.session import Trend, trends_picture
from ..report.html import Html, heading, image, page, paragraph, table
from ..system.atomic_files import write_atomic
from ..types import SECOND, sensor_kind
from .results import SESSIONS, counts
from .session_task import OK, Row

SORT = """<script>
const compared = (a, b) => isNaN(a) || isNaN(b) ? a.localeCompare(b) : a - b;
document.querySelectorAll('.sorted th').forEach((head, column) => head.onclick = () => {
  const body = head.closest('table').tBodies[0], way = head.dataset.way === '1' ? -1 : 1;
  const text = row => row.cells[column].textContent;
  head.dataset.way = way;
  const order = (a, b) => a === '-' || b === '-' ? (a === '-') - (b === '-') : way * compared(a, b);
  [...body.rows].sort((one, other) => order(text(one), text(other))).forEach(row => body.append(row));
});
</script>
<style>
body { max-width: 1400px } .sorted { overflow-x: auto } .sorted th { cursor: pointer } tr:has(.alarm) td { background: #fff0e6 }
.sorted td { white-space: nowrap } .sorted td:last-child { white-space: normal; min-width: 8em }
@media (max-width: 1300px) { .sorted table { font-size: 13px } .sorted th, .sorted td { padding: .22em .4em } }
</style>"""
COLUMNS = (
    "session", "rig", "begin", "state", "duration, s", "times real time", "alarms", "causes",
    "worst residual / expected", "lowest mode / model", "tip, m/s² at most", "left out", "reason",
)  # fmt: skip
TRENDS = ("residual_rms_", "frequency_ratio_mode_", "damping_mode_", "calibrated_")
"""First part of the names of figures that are drawn over time."""
MAX_TRENDS = 24


def write_page(path: Path, rows: Sequence[Row]) -> None:
    """Write the page beside the folder of the replays. The page loads nothing from other files."""
    right, wrong = counts(rows)
    alarmed = sum(bool(row.get("alarms")) for row in rows)
    parts = [
        heading(f"Batch of {len(rows)} sessions", 1),
        paragraph(f"{right} right, of which {alarmed} with alarms; {wrong} failed.", "alarm" if wrong or alarmed else "well"),
        paragraph("A click on a column's title sorts by it. All figures are in sessions.parquet.", "note"),
        f'<div class="sorted">{table(COLUMNS, map(_cells, rows))}</div>',
        *_trends(rows),
        SORT,
    ]
    write_atomic(path, page("Batch of sessions", parts))


def _cells(row: Row) -> tuple[object, ...]:
    name, is_right, begin = str(row["session"]), row["status"] == OK, row.get("first_stamp_ns")
    alarms = row.get("alarms") or []
    deviations = [value for value in row.get("joint_residual_normalised_std") or [] if value is not None]
    return (
        Html(f'<a href="{SESSIONS}/{quote(row["key"])}/report.html">{escape(name)}</a>') if row.get("report") else name,
        row.get("rig"),
        None if begin is None else str(datetime.fromtimestamp(begin // SECOND, UTC).replace(tzinfo=None)),
        OK if is_right else Html(f'<span class="alarm">{escape(row["status"])}</span>'),
        row.get("duration_s"),
        row.get("realtime_factor"),
        len(alarms) if is_right else None,
        ", ".join(sorted({alarm["cause"] or alarm["kind"] for alarm in alarms})),
        max(deviations, default=None),
        row.get("frequency_ratio_mode_1"),
        row.get("tip_acceleration_max_m_s2"),
        row.get("dropped"),
        row.get("reason"),
    )


def _trends(rows: Sequence[Row]) -> Iterator[str]:
    """Yield pictures of wear-related figures over time, for every rig with several sessions."""
    rigs: dict[str, list[Row]] = {}
    for row in rows:
        if row["status"] == OK:
            rigs.setdefault(row["rig"], []).append(row)
    for rig, found in sorted(rigs.items()):
        found.sort(key=lambda row: int(row["first_stamp_ns"]))
        names = sorted({name for row in found for name in row if name.startswith(TRENDS) and not name.endswith("_sigma")})
        trends = [trend for name in names if len((trend := _trend(name, found)).values) > 1][:MAX_TRENDS]
        if trends:
            yield heading(f"Over time: {rig}")
            yield paragraph("Sessions by the stamp of their first prediction; bars are standard deviations.", "note")
            with TemporaryDirectory() as folder:
                picture = Path(folder) / "trends.png"
                trends_picture(picture, rig, trends)
                yield image(picture, "; ".join(trend.label for trend in trends))


def _trend(name: str, rows: Sequence[Row]) -> Trend:
    known = [row for row in rows if isinstance(row.get(name), float | int) and isfinite(row[name])]
    values, sigmas = [row[name] for row in known], [row.get(f"{name}_sigma") or 0.0 for row in known]
    channel = name.removeprefix("residual_rms_")
    label = name if channel == name else f"{name}, {sensor_kind(channel).unit}"
    return Trend(label, [row["first_stamp_ns"] / SECOND for row in known], values, sigmas)
