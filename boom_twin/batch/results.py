"""Page and summaries by rig of a batch: hours of work, fatigue damage and life, drift of figures over time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite, sqrt
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import quote

import numpy as np
from markupsafe import Markup
from scipy.stats import t as student

from ..plots.results import Trend, trends_picture
from ..report.fatigue import LIVES, hours_as_text, hours_to_end, yearly_as_text
from ..report.page import HOUR, render
from ..system.files import write_atomic
from ..system.result_text import json_text
from ..types import SECOND, sensor_kind
from .folder import PAGE, RIGS, SESSIONS
from .session_task import OK, Row

DAY = 86400.0  # s
DAMAGE = "fatigue_damage_"  # prefix of the columns with the damage of a station
DRIFTING = ("residual_mean_", "frequency_ratio_mode_", "damping_mode_", "calibrated_")
"""Prefixes of the figures whose drift is computed."""
LEAST_SESSIONS = 4  # least number of sessions for a drift: a line with two residual degrees of freedom


@dataclass(frozen=True, slots=True)
class Drift:
    """Change of a figure from first to last session, by a line of weighted least squares."""

    name: str
    sessions: int
    days: float
    first: float  # value of the line at the first session
    change: float
    sigma: float  # standard deviation of `change`, at least that from the scatter
    is_significant: bool


def rigs_of(rows: Sequence[Row]) -> list[Row]:
    """Return the summary of each rig with a finished session, as in ``rigs.json``, sorted by name."""
    return [_summary(rig, found) for rig, found in _finished_by_rig(rows)]


def _finished_by_rig(rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    rigs: dict[str, list[Row]] = {}
    for row in sorted((row for row in rows if row["status"] == OK), key=lambda row: int(row["first_stamp_ns"])):
        rigs.setdefault(row["rig"], []).append(row)
    return sorted(rigs.items())


def _figures(rows: Sequence[Row], beginnings: tuple[str, ...]) -> list[str]:
    return sorted({name for row in rows for name in row if name.startswith(beginnings) and not name.endswith("_sigma")})


def _summary(rig: str, rows: list[Row]) -> Row:
    once = [*{row["file_sha256"]: row for row in reversed(rows)}.values()][::-1]  # sessions with equal files count once
    causes = Counter(cause for row in once for cause in {alarm["cause"] for alarm in row["alarms"]} if cause)
    return {
        "rig": rig,
        "sessions": len(once),
        "repeated": len(rows) - len(once),
        "hours": sum(row["duration_s"] for row in once) / HOUR,
        "with_alarms": sum(bool(row["alarms"]) for row in once),
        "causes": dict(causes.most_common()),  # number of sessions in which each was named
        "fatigue": _fatigue(once),
        "drifts": [drift for name in _figures(once, DRIFTING) if (drift := drift_of(name, once)) is not None],
    }


def _fatigue(rows: list[Row]) -> Row | None:
    """Return damage and life of the station with the largest damage, summed over sessions; None if it was not counted."""
    own = [row for row in rows if any(name.startswith(DAMAGE) for name in row)]
    if not own:
        return None
    names = dict.fromkeys(name for row in own for name in row if name.startswith(DAMAGE))
    sums = {name.removeprefix(DAMAGE): sum(row.get(name, 0.0) for row in own) for name in names}
    worst = max(sums, key=lambda name: sums[name])
    damages, hours = (np.array([row.get(name, 0.0) for row in own]) for name in (DAMAGE + worst, "duration_s"))
    hours = hours / HOUR
    total, count, sigma = sums[worst], len(own), None
    if count >= LEAST_SESSIONS:  # ratio estimate: scatter about the mean damage per hour
        sigma = float(np.sqrt(count / (count - 1) * np.sum((damages - total / hours.sum() * hours) ** 2)))
    end = hours_to_end(total, float(hours.sum()))
    return {
        "detail_category_MPa": own[0]["fatigue_category_MPa"],
        "station": worst,
        "damage": total,
        "damage_sigma": sigma,  # None below `LEAST_SESSIONS`
        "damage_largest_share": float(damages.max() / total) if total > 0.0 else 0.0,  # of one session
        "sessions": count,
        "hours": float(hours.sum()),
        "section_heights_given": all(row["section_heights_given"] for row in own),
        "hours_to_damage_1": end,
        **{f"hours_a_year_for_{years}_years": None if end is None else end / years for years in LIVES},
        "damage_by_station": sums,
    }


def drift_of(name: str, rows: Sequence[Row]) -> Drift | None:
    """Return the drift of a figure over sessions, or None if there are too few.

    A least-squares line is fitted, weighted by the figure's standard deviations. The standard deviation of its slope is
    enlarged if the scatter about the line is larger. Student's t tests the slope.
    """
    known = [row for row in rows if _is_number(row.get(name)) and _is_number(row.get(f"{name}_sigma"))]
    found = np.array([(row["first_stamp_ns"] / SECOND / DAY, row[name], row[f"{name}_sigma"]) for row in known]).reshape(-1, 3)
    days, values, sigmas = found[found[:, 2] > 0.0].T
    if len(days) < LEAST_SESSIONS or not np.ptp(days) > 0.0:
        return None
    weights = sigmas**-2.0
    away = days - weights @ days / weights.sum()
    mean, size = float(weights @ values / weights.sum()), float(weights @ away**2)
    slope, freedom = float(weights @ (away * (values - mean))) / size, len(days) - 2
    scatter = float(weights @ (values - mean - slope * away) ** 2) / freedom
    sigma = sqrt(max(1.0, scatter) / size)
    chance = 2.0 * float(student.sf(abs(slope) / sigma, freedom))
    span = float(np.ptp(days))
    significant = 1e-3  # largest p-value, as in `boom_twin.report.quantities.SIGNIFICANT`
    return Drift(name, len(days), span, mean + slope * float(away.min()), slope * span, sigma * span, chance < significant)


def _is_number(value: object) -> bool:
    return isinstance(value, float | int) and isfinite(value)


def counts(rows: Sequence[Row]) -> tuple[int, int]:
    right = sum(row["status"] == OK for row in rows)
    return right, len(rows) - right


COLUMNS = (
    "session", "rig", "begin", "state", "duration, s", "times real time", "alarms", "causes",
    "worst residual / expected", "lowest mode / model", "tip, m/s² at most", "left out", "reason",
)  # fmt: skip
TRENDS = ("residual_rms_", "frequency_ratio_mode_", "damping_mode_", "calibrated_")
"""First part of the names of figures that are drawn over time."""


def write_summaries(folder: Path, rows: Sequence[Row]) -> None:
    """Write ``rigs.json`` and the page beside the folder of the replays. The page loads nothing from other files."""
    rigs, (right, wrong) = rigs_of(rows), counts(rows)
    write_atomic(folder / RIGS, json_text({"rigs": rigs}, indent=1) + "\n")
    lives = [rig["fatigue"] for rig in rigs if rig["fatigue"] is not None]
    with TemporaryDirectory() as pictures:
        text = render(
            "batch.html",
            title="Batch of sessions",
            right=right,
            wrong=wrong,
            alarmed=sum(bool(row.get("alarms")) for row in rows),
            rig_head=RIG_COLUMNS,
            rigs=map(_rig_cells, rigs),
            category=f"{lives[0]['detail_category_MPa']:g}" if lives else None,
            has_heights=all(life["section_heights_given"] for life in lives),
            least=LEAST_SESSIONS,
            repeated=sum(rig["repeated"] for rig in rigs),
            head=COLUMNS,
            sessions=list(map(_cells, rows)),
            trends=list(_trends(rows, rigs, Path(pictures))),
        )
    write_atomic(folder / PAGE, text)


def _cells(row: Row) -> tuple[object, ...]:
    name, is_right, begin = str(row["session"]), row["status"] == OK, row.get("first_stamp_ns")
    link = Markup('<a href="{}">{}</a>').format(f"{SESSIONS}/{quote(row['key'])}/report.html", name)
    alarms = row.get("alarms") or []
    deviations = [value for value in row.get("joint_residual_normalised_std") or [] if value is not None]
    return (
        link if row.get("report") else name,
        row.get("rig"),
        None if begin is None else str(datetime.fromtimestamp(begin // SECOND, UTC).replace(tzinfo=None)),
        OK if is_right else Markup('<span class="alarm">{}</span>').format(row["status"]),
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


def _rig_cells(rig: Row) -> tuple[object, ...]:
    causes = ", ".join(f"{cause} ({count})" for cause, count in rig["causes"].items()) or "none"
    start: tuple[object, ...] = rig["rig"], rig["sessions"], rig["hours"], rig["with_alarms"], causes
    if (life := rig["fatigue"]) is None:
        return *start, *[None] * (len(RIG_COLUMNS) - len(start))
    damage = f"{life['damage']:.3g}" + ("" if life["damage_sigma"] is None else f" ± {life['damage_sigma']:.1g}")
    years = (yearly_as_text(life[f"hours_a_year_for_{years}_years"]) for years in LIVES)
    place, share = life["station"].replace("_", " ") + " m", 100.0 * life["damage_largest_share"]
    return *start, damage, place, share, hours_as_text(life["hours_to_damage_1"]), *years


def _drift_cells(drift: Drift) -> tuple[object, ...]:
    verdict = Markup('<span class="alarm">DRIFTS</span>') if drift.is_significant else "may be chance"
    change = f"{drift.change:+.3g} ± {drift.sigma:.1g}"
    return _with_unit(drift.name), drift.sessions, drift.days, drift.first, change, verdict


def _with_unit(name: str) -> str:
    channel = name.removeprefix("residual_rms_").removeprefix("residual_mean_")
    return name if channel == name else f"{name}, {sensor_kind(channel).unit}"


def _trends(rows: Sequence[Row], summaries: Sequence[Row], folder: Path) -> Iterator[dict[str, object]]:
    """Yield name, drifts and picture in `folder` of wear-related figures over time, for every rig with several sessions."""
    max_trends = 24
    by_name = {rig["rig"]: rig for rig in summaries}
    for number, (rig, found) in enumerate(_finished_by_rig(rows)):
        trends = [trend for name in _figures(found, TRENDS) if len((trend := _trend(name, found)).values) > 1][:max_trends]
        if trends:
            picture = folder / f"{number}.png"
            trends_picture(picture, rig, trends)
            drifts = sorted(by_name[rig]["drifts"], key=lambda drift: not drift.is_significant)
            labels = "; ".join(trend.label for trend in trends)
            yield {"name": rig, "drifts": list(map(_drift_cells, drifts)), "picture": picture, "labels": labels}


def _trend(name: str, rows: Sequence[Row]) -> Trend:
    known = [row for row in rows if _is_number(row.get(name))]
    values, sigmas = [row[name] for row in known], [row.get(f"{name}_sigma") or 0.0 for row in known]
    return Trend(_with_unit(name), [row["first_stamp_ns"] / SECOND for row in known], values, sigmas)
