"""Summary of a batch by rig: hours of work, fatigue damage and life, drift of figures over time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, sqrt

import numpy as np
from scipy.stats import t as student

from ..report.fatigue import LIVES, hours_to_end
from ..types import SECOND
from .session_task import OK, Row

HOUR, DAY = 3600.0, 86400.0  # s
DAMAGE = "fatigue_damage_"  # prefix of the columns with the damage of a station
DRIFTING = ("residual_mean_", "frequency_ratio_mode_", "damping_mode_", "calibrated_")
"""Prefixes of the figures whose drift is computed."""
LEAST_SESSIONS = 4  # least number of sessions for a drift: a line with two residual degrees of freedom
CHANCE = 1e-3  # largest p-value of a significant drift, as in `boom_twin.report.compare.SIGNIFICANT`


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


@dataclass(frozen=True, slots=True)
class Life:
    """Fatigue of a rig's station with the largest damage, summed over sessions."""

    category: float  # detail category, MPa
    station: str
    damage: float
    sigma: float | None  # standard deviation from the scatter of sessions; None below `LEAST_SESSIONS`
    largest_share: float  # largest share of `damage` by one session
    sessions: int
    hours: float  # total of these sessions
    has_heights: bool  # heights of the sections are in the scene
    stations: dict[str, float]  # damage of every station

    @property
    def hours_to_end(self) -> float | None:
        """Hours of the same work until the damage is 1; None without damage."""
        return hours_to_end(self.damage, self.hours)

    def hours_a_year(self, years: float) -> float | None:
        """Return the hours per year of the same work until a damage of 1 in `years`; None without damage."""
        return None if self.hours_to_end is None else self.hours_to_end / years


@dataclass(frozen=True, slots=True)
class RigSummary:
    """Summary of one rig. Sessions with equal files count once."""

    rig: str
    sessions: int
    repeated: int  # sessions left out, because another one has equal files
    hours: float
    alarmed: int  # sessions with alarms
    causes: dict[str, int]  # sessions in which a cause was named
    life: Life | None  # None unless fatigue was asked for
    drifts: list[Drift]


def rigs_of(rows: Sequence[Row]) -> list[RigSummary]:
    """Return a summary of each rig with a finished session, sorted by name."""
    rigs: dict[str, list[Row]] = {}
    for row in sorted((row for row in rows if row["status"] == OK), key=lambda row: int(row["first_stamp_ns"])):
        rigs.setdefault(row["rig"], []).append(row)
    return [_summary(rig, found) for rig, found in sorted(rigs.items())]


def as_dict(rig: RigSummary) -> dict[str, object]:
    """Return a summary as plain values, including hours to damage 1."""
    life = rig.life
    told = None if life is None else {
        "detail_category_MPa": life.category, "station": life.station, "damage": life.damage, "damage_sigma": life.sigma,
        "damage_largest_share": life.largest_share, "sessions": life.sessions, "hours": life.hours,
        "section_heights_given": life.has_heights, "hours_to_damage_1": life.hours_to_end,
        **{f"hours_a_year_for_{years}_years": life.hours_a_year(years) for years in LIVES},
        "damage_by_station": life.stations,
    }  # fmt: skip
    return {
        "rig": rig.rig, "sessions": rig.sessions, "repeated": rig.repeated, "hours": rig.hours, "with_alarms": rig.alarmed,
        "causes": rig.causes, "fatigue": told, "drifts": rig.drifts,
    }  # fmt: skip


def _summary(rig: str, rows: list[Row]) -> RigSummary:
    once = [*{row["file_sha256"]: row for row in reversed(rows)}.values()][::-1]
    causes = Counter(cause for row in once for cause in {alarm["cause"] for alarm in row["alarms"]} if cause)
    names = sorted({name for row in once for name in row if name.startswith(DRIFTING) and not name.endswith("_sigma")})
    drifts = [drift for name in names if (drift := drift_of(name, once)) is not None]
    hours, alarmed = sum(row["duration_s"] for row in once) / HOUR, sum(bool(row["alarms"]) for row in once)
    return RigSummary(rig, len(once), len(rows) - len(once), hours, alarmed, dict(causes.most_common()), _life(once), drifts)


def _life(rows: list[Row]) -> Life | None:
    own = [row for row in rows if any(name.startswith(DAMAGE) for name in row)]
    if not own:
        return None
    names = dict.fromkeys(name for row in own for name in row if name.startswith(DAMAGE))
    sums = {name: sum(row.get(name, 0.0) for row in own) for name in names}
    worst = max(sums, key=lambda name: sums[name])
    damages, hours = np.array([row.get(worst, 0.0) for row in own]), np.array([row["duration_s"] / HOUR for row in own])
    total, count, sigma = sums[worst], len(own), None
    if count >= LEAST_SESSIONS:  # ratio estimate: scatter about the mean damage per hour
        sigma = float(np.sqrt(count / (count - 1) * np.sum((damages - total / hours.sum() * hours) ** 2)))
    share, has_heights = damages.max() / total if total > 0.0 else 0.0, all(row["section_heights_given"] for row in own)
    stations = {name.removeprefix(DAMAGE): value for name, value in sums.items()}
    category, station = own[0]["fatigue_category_MPa"], worst.removeprefix(DAMAGE)
    return Life(category, station, total, sigma, float(share), count, float(hours.sum()), has_heights, stations)


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
    return Drift(name, len(days), span, mean + slope * float(away.min()), slope * span, sigma * span, chance < CHANCE)


def _is_number(value: object) -> bool:
    return isinstance(value, float | int) and isfinite(value)
