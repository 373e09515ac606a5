"""Fatigue of a session: rainflow counts of the bending stress at every station, and damage by the S-N curves of EN 1993-1-9.

A cycle of range S (Pa) does the damage 1/N(S) (Palmgren and Miner). The detail category C is the range endured 2e6 times, D
the range endured 5e6 times and L the range endured 1e8 times:

    N = 2e6 (C/S)^3  for S >= D,   5e6 (D/S)^5  for L <= S < D,   infinite  for S < L.

Cycles are counted by the package `rainflow` (ASTM E1049), in a long session stretch by stretch. Cycles that have closed are
added up. Turning points of open cycles are put before the next stretch, so the count is that of the whole session.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module

import numpy as np

from ..analysis.bending_stress import Station, section_moduli, stations
from ..errors import UsageError
from ..plots import History
from ..scene.schema import Scene
from ..types import Array

CATEGORY = 71.0  # MPa, of a welded box where nothing better is known
LIVES = (10, 20, 30)  # years of life for which the hours of work a year are given
YEAR = 8760.0  # hours
NOISE_RANGE = 1e5  # Pa; cycles below are noise, and do no damage in any category
BIN = 1e4  # Pa, in which ranges are added up


@dataclass(frozen=True)
class Fatigue:
    """Fatigue of one station in one session: cycles above `NOISE_RANGE`, their largest range (Pa), damage.

    A damage of 1 is the end of the station's life.
    """

    station: Station
    cycles: float
    largest: float
    damage: float


def endured(ranges: Array, category: float) -> Array:
    """Return the cycles N that a detail of `category` (MPa) endures at stress `ranges` (Pa), shape (k,).

    N is infinite below the cut-off.
    """
    category_cycles, knee_cycles, cut_off_cycles = 2e6, 5e6, 1e8  # EN 1993-1-9, 7.1
    knee = 1e6 * category * (category_cycles / knee_cycles) ** (1.0 / 3.0)
    limit = knee * (knee_cycles / cut_off_cycles) ** 0.2
    with np.errstate(divide="ignore", over="ignore"):
        steep, flat = category_cycles * (1e6 * category / ranges) ** 3, knee_cycles * (knee / ranges) ** 5
    return np.where(ranges >= knee, steep, np.where(ranges >= limit, flat, np.inf))


def damage_of(cycles: Iterable[tuple[float, float]], category: float) -> float:
    """Return the damage of cycles, given range (Pa) and count of each."""
    table = np.array([*cycles], float).reshape(-1, 2)
    return float(np.sum(table[:, 1] / endured(table[:, 0], category)))


def hours_to_end(damage: float, hours: float) -> float | None:
    """Return the hours of such work to a damage of 1, from the damage of so many `hours`; None without damage."""
    return hours / damage if damage > 0.0 else None


def hours_as_text(hours: float | None) -> str:
    """Return hours to three digits, in groups of thousands; a dash for None."""
    return "-" if hours is None else f"{float(f'{hours:.3g}'):,.{0 if hours >= 100.0 else 1}f}".replace(",", " ")


def yearly_as_text(hours: float | None) -> str:
    """Return hours a year; more than a year has are not written out."""
    return f"> {YEAR:g}" if hours is not None and hours > YEAR else hours_as_text(hours)


class RainflowCounter:
    """Rainflow counter of a stress that comes in parts. It needs the package `rainflow`."""

    def __init__(self) -> None:
        try:
            self._rainflow = import_module("rainflow")
        except ImportError:
            raise UsageError("--fatigue: needs the package rainflow. Install it: pip install 'boom_twin[fatigue]'.") from None
        self._open = np.zeros(0)
        self._closed: Counter[int] = Counter()  # by range in `BIN`

    def add(self, stress: Array) -> None:
        """Add the next values, shape (k,), Pa."""
        if not len(stress):
            return
        series = np.concatenate([self._open, stress])
        left: set[int] = {0, len(series) - 1}
        for size, _, count, start, end in self._rainflow.extract_cycles(series):
            if count == 1.0:
                self._closed[round(size / BIN)] += 1
            else:
                left |= {start, end}
        self._open = series[sorted(left)]

    def cycles(self) -> list[tuple[float, float]]:
        """Return range (Pa) and count of all cycles so far above `NOISE_RANGE`.

        A cycle that has not closed counts as a half.
        """
        found = Counter({size: float(count) for size, count in self._closed.items()})
        series = self._open if len(self._open) != 2 else np.insert(self._open, 1, self._open.mean())  # of two it counts none
        for size, _, count, _, _ in self._rainflow.extract_cycles(series):
            found[round(size / BIN)] += count
        return [(size * BIN, count) for size, count in sorted(found.items()) if size * BIN > NOISE_RANGE]


class FatigueCounter:
    """Fatigue of all stations of one detail `category`, MPa, added up over the blocks of a session."""

    def __init__(self, scene: Scene, category: float) -> None:
        if not (np.isfinite(category) and category > 0.0):
            raise UsageError(f"--fatigue {category:g}: a detail category is above 0, in MPa. Take {CATEGORY:g}.")
        self.category, self._stations = category, stations(scene)
        self._moduli = section_moduli(scene, self._stations)
        self._counters = [RainflowCounter() for _ in self._stations]

    def add(self, history: History) -> None:
        for counter, stress in zip(self._counters, (history.moments / self._moduli).T, strict=True):
            counter.add(stress)

    def results(self) -> list[Fatigue]:
        rows = []
        for station, counter in zip(self._stations, self._counters, strict=True):
            cycles = counter.cycles()
            count, largest = sum(count for _, count in cycles), max((size for size, _ in cycles), default=0.0)
            rows.append(Fatigue(station, count, largest, damage_of(cycles, self.category)))
        return rows
