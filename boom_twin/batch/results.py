"""Folder of a batch: a file for every finished row, with which a second call continues, and the final table and page."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from hashlib import sha256
from html import escape
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import quote

from .. import __version__
from ..errors import BagError
from ..plots.results import Trend, trends_picture
from ..report.fatigue import LIVES, hours_as_text, yearly_as_text
from ..report.html import Html, heading, image, page, paragraph, table
from ..system.atomic_files import DRAFT, write_atomic
from ..system.json_text import json_text
from ..system.received_files import real_path
from ..system.result_folder import check_lasting
from ..system.terminal_text import printable
from ..types import SECOND, sensor_kind
from .rigs import LEAST_SESSIONS, Drift, RigSummary, as_dict
from .session_task import ALARM, OK, Row

MARK, TABLE, RIGS, PAGE = "batch.json", "sessions.parquet", "rigs.json", "batch.html"
ROWS, SESSIONS = "rows", "sessions"  # folders of the rows, and of the replays
DIGEST = "row_sha256"  # key of a row's digest in its file, by which a change is detected
_OWN = frozenset({MARK, TABLE, RIGS, PAGE, ROWS, SESSIONS})


@contextmanager
def batch_folder(out: Path, sessions: Sequence[Path]) -> Iterator[BatchFolder]:
    """Make or reopen the folder of a batch and lock it against other batches.

    None of the sessions to be read may lie in `out`, nor `out` in one of them. BagError if `out` holds anything else, another
    batch works in it, or it cannot be written.
    """
    check_lasting(out)
    place = real_path(out)
    for session in sessions:
        path = Path(os.path.realpath(session))
        if path == place or place in path.parents or path in place.parents:
            raise BagError(f"{out}: {session} lies in it, or it in the session, and a source is never touched. Choose another.")
    try:
        others = sorted({each.name for each in place.iterdir()} - _OWN) if place.exists() else []
        is_new = not (place / MARK).is_file()
        if (is_new and place.exists() and any(place.iterdir())) or any(not name.endswith(DRAFT) for name in others):
            raise BagError(f"{out}: holds {(others or ['results'])[0]}, which no batch left. Choose a new folder.")
        for folder in (place / ROWS, place / SESSIONS):
            folder.mkdir(parents=True, exist_ok=True)
        lock = os.open(place / MARK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o666)
    except OSError as error:
        raise BagError(f"{out}: cannot be written ({error.strerror}). Choose a folder that can.") from None
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise BagError(f"{out}: another `boom_twin batch` is at work there. Wait for its end, or choose another.") from None
        yield BatchFolder(place, lock)
    finally:
        os.close(lock)


class BatchFolder:
    """Rows and replays of a batch in its folder; see `batch_folder`."""

    def __init__(self, folder: Path, lock: int) -> None:
        self.folder, self._lock = folder, lock

    def replay(self, key: str) -> Path:
        """Return the folder of the replay of a session."""
        return self.folder / SESSIONS / key

    def kept(self, key: str, fingerprint: str) -> Row | None:
        """Return the row of a session if it is finished and its `fingerprint` is equal; None otherwise.

        BagError if the file was changed since `keep` wrote it.
        """
        file = self.folder / ROWS / f"{key}.json"
        try:
            row = json.loads(file.read_bytes())
            if row.pop(DIGEST) != _digest(row):
                raise ValueError("changed")
        except FileNotFoundError:
            return None
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
            raise BagError(f"{file}: this row of an earlier call is damaged. Its session is done anew.") from None
        return dict(row) if row["fingerprint"] == fingerprint else None

    def keep(self, row: Row) -> None:
        """Write a finished row to its file."""
        write_atomic(self.folder / ROWS / f"{row['key']}.json", json.dumps(row | {DIGEST: _digest(row)}) + "\n")

    def mark(self, total: int, finished: int) -> None:
        """Write the number of finished sessions and the state of the batch."""
        state = "complete" if finished == total else "unfinished: the same command goes on with it"
        told = {"command": "batch", "version": __version__, "sessions": total, "finished": finished, "state": state}
        os.truncate(self._lock, 0)
        os.pwrite(self._lock, (json.dumps(told) + "\n").encode(), 0)


def _digest(row: Row) -> str:
    return sha256(json.dumps(row).encode()).hexdigest()


_ALWAYS: dict[str, str] = {
    "session": "string", "path": "string", "rig": "string", "status": "string", "reason": "string", "attempts": "int64",
    "first_stamp_ns": "int64", "duration_s": "double", "samples": "int64", "dropped": "int64", "outside_validity": "int64",
    "wall_s": "double", "realtime_factor": "double", "peak_memory_bytes": "int64", "tip_acceleration_max_m_s2": "double",
    "joint_residual_rms_rad": "list", "joint_residual_normalised_mean": "list", "joint_residual_normalised_std": "list",
    "session_incomplete": "string", "file_sha256": "string", "output_sha256": "string", "scene": "string",
    "scene_sha256": "string", "mapping": "string", "version": "string", "fingerprint": "string",
    "key": "string", "report": "bool", "section_heights_given": "bool", "calibration_reason": "string",
    "calibration_remarks": "string",
}  # fmt: skip
"""Columns that every table has, with their types; the others are the figures of `boom_twin.report.quantities`, numbers."""


def write_table(path: Path, rows: Sequence[Row]) -> None:
    """Write all rows as Parquet, one for each session. A column that a row lacks is null there."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    alarm = pa.struct([(name, pa.float64() if name.endswith("_s") else pa.string()) for name in ALARM])
    types: dict[str, Any] = {
        **{name: pa.list_(pa.float64()) if kind == "list" else pa.type_for_alias(kind) for name, kind in _ALWAYS.items()},
        "alarms": pa.list_(alarm),
        "events": pa.list_(pa.struct([("event", pa.string()), ("count", pa.int64())])),
    }
    rows = [{name: printable(value) if isinstance(value, str) else value for name, value in row.items()} for row in rows]
    figures = sorted({name for row in rows for name in row} - types.keys())
    words = {name for row in rows for name, value in row.items() if isinstance(value, str)}
    types |= {name: pa.string() if name in words else pa.float64() for name in figures}
    columns = [pa.array([row.get(name) for row in rows], kind) for name, kind in types.items()]
    sink = pa.BufferOutputStream()
    pq.write_table(pa.table(columns, schema=pa.schema(list(types.items()))), sink)
    write_atomic(path, sink.getvalue().to_pybytes())


def write_rigs(path: Path, rigs: Sequence[RigSummary]) -> None:
    """Write the summaries of all rigs as one JSON object, with the list ``rigs``."""
    write_atomic(path, json_text({"rigs": [as_dict(rig) for rig in rigs]}, indent=1) + "\n")


def counts(rows: Sequence[Row]) -> tuple[int, int]:
    """Return the number of rows with a result and of failed rows."""
    right = sum(row["status"] == OK for row in rows)
    return right, len(rows) - right


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
body { max-width: 1400px } .sorted, .wide { overflow-x: auto } .sorted th { cursor: pointer }
tr:has(.alarm) td { background: #fff0e6 }
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


def write_page(path: Path, rows: Sequence[Row], rigs: Sequence[RigSummary]) -> None:
    """Write the page beside the folder of the replays. The page loads nothing from other files."""
    right, wrong = counts(rows)
    alarmed = sum(bool(row.get("alarms")) for row in rows)
    parts = [
        heading(f"Batch of {len(rows)} sessions", 1),
        paragraph(f"{right} right, of which {alarmed} with alarms; {wrong} failed.", "alarm" if wrong or alarmed else "well"),
        *_by_rig(rigs),
        heading("Sessions"),
        paragraph("A click on a column's title sorts by it. All figures are in sessions.parquet.", "note"),
        f'<div class="sorted">{table(COLUMNS, map(_cells, rows))}</div>',
        *_trends(rows, rigs),
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


RIG_COLUMNS = (
    "rig", "sessions", "hours", "with alarms", "causes named (sessions)", "damage", "at station", "by one session, %",
    "hours of such work to damage 1", *(f"h a year for {years} years" for years in LIVES),
)  # fmt: skip
DAMAGE_NOTE = (
    "Damage (Palmgren and Miner) is the sum of the sessions at the station where it is largest, by the predicted bending "
    "stress for detail category {category:g} MPa of EN 1993-1-9, without partial factors. Hours are of work as in these "
    "sessions. Work of other kinds, and vibration that only sensors show, such as by a pump, are NOT in it. "
)
ASSUMED = "Section heights are not in every scene: stresses are those of thin-walled boxes there. "


def _by_rig(rigs: Sequence[RigSummary]) -> Iterator[str]:
    yield heading("Rigs")
    yield f'<div class="wide">{table(RIG_COLUMNS, map(_rig_cells, rigs))}</div>'
    lives = [rig.life for rig in rigs if rig.life is not None]
    if not lives:
        yield paragraph("Damage is not known: give --fatigue, and sections that bend.", "note")
    else:
        told = DAMAGE_NOTE.format(category=lives[0].category) + ("" if all(life.has_heights for life in lives) else ASSUMED)
        yield paragraph(told + f"± is the scatter of the sessions, not known below {LEAST_SESSIONS} of them.", "note")
    if repeated := sum(rig.repeated for rig in rigs):
        yield paragraph(f"Counted once: {repeated} sessions whose files equal those of another one.", "note")


def _rig_cells(rig: RigSummary) -> tuple[object, ...]:
    causes = ", ".join(f"{cause} ({count})" for cause, count in rig.causes.items()) or "none"
    start: tuple[object, ...] = rig.rig, rig.sessions, rig.hours, rig.alarmed, causes
    if (life := rig.life) is None:
        return *start, *[None] * (len(RIG_COLUMNS) - len(start))
    damage = f"{life.damage:.3g}" + ("" if life.sigma is None else f" ± {life.sigma:.1g}")
    years = (yearly_as_text(life.hours_a_year(years)) for years in LIVES)
    place = life.station.replace("_", " ") + " m"
    return *start, damage, place, 100.0 * life.largest_share, hours_as_text(life.hours_to_end), *years


DRIFT_NOTE = (
    f"Change from the first session to the last, along a line of weighted least squares. It needs {LEAST_SESSIONS} sessions "
    "with a standard deviation. DRIFTS: by chance less than once in a thousand. Other postures, loads and temperatures change "
    "figures, too."
)


def _drifts(rig: RigSummary) -> Iterator[str]:
    if not rig.drifts:
        yield paragraph(f"Drift is not known: fewer than {LEAST_SESSIONS} sessions have one figure at different times.", "note")
        return
    rows = [
        (_with_unit(each.name), each.sessions, each.days, each.first, f"{each.change:+.3g} ± {each.sigma:.1g}", _verdict(each))
        for each in sorted(rig.drifts, key=lambda drift: not drift.is_significant)
    ]
    yield paragraph(DRIFT_NOTE, "note")
    yield table(("figure", "sessions", "days", "at first", "change", "verdict"), rows)


def _verdict(drift: Drift) -> object:
    return Html('<span class="alarm">DRIFTS</span>') if drift.is_significant else "may be chance"


def _with_unit(name: str) -> str:
    """Return the name of a figure, with its unit where a channel has one."""
    channel = name.removeprefix("residual_rms_").removeprefix("residual_mean_")
    return name if channel == name else f"{name}, {sensor_kind(channel).unit}"


def _trends(rows: Sequence[Row], summaries: Sequence[RigSummary]) -> Iterator[str]:
    """Yield drift and pictures of wear-related figures over time, for every rig with several sessions."""
    by_name = {rig.rig: rig for rig in summaries}
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
            yield from _drifts(by_name[rig])
            yield paragraph("Sessions by the stamp of their first prediction; bars are standard deviations.", "note")
            with TemporaryDirectory() as folder:
                picture = Path(folder) / "trends.png"
                trends_picture(picture, rig, trends)
                yield image(picture, "; ".join(trend.label for trend in trends))


def _trend(name: str, rows: Sequence[Row]) -> Trend:
    known = [row for row in rows if isinstance(row.get(name), float | int) and isfinite(row[name])]
    values, sigmas = [row[name] for row in known], [row.get(f"{name}_sigma") or 0.0 for row in known]
    return Trend(_with_unit(name), [row["first_stamp_ns"] / SECOND for row in known], values, sigmas)
