"""What the rows of `study error` say: who is on the front, and who is the fastest at an error."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .error_cases import Own, Peer
from .error_run import Row

EQUAL = (0.3, 1.0, 3.0, 10.0)  # mm
NOISE = 0.9  # a run must take less than this share of another's time to be called faster
SAME = 1.1  # errors that differ by less than a tenth count as equal
Measure = Callable[[Row], float]


def tip(row: Row) -> float:
    """Error of the tip, mm."""
    return row.tip_mm


def acceleration(row: Row) -> float:
    """Relative error of the tip's acceleration."""
    return row.acceleration


def front(rows: Sequence[Row], error: Measure = tip) -> list[Row]:
    """The Pareto front, fastest first: no row is both faster and less wrong than one of these."""
    found: list[Row] = []
    for row in sorted((row for row in rows if row.good), key=lambda row: (row.seconds, error(row))):
        if not found or error(row) < error(found[-1]):
            found.append(row)
    return found


def fastest(rows: Sequence[Row], most: float, error: Measure = tip) -> Row | None:
    """The fastest row whose error is at most `most`."""
    return min((row for row in rows if row.good and error(row) <= most), key=lambda row: row.seconds, default=None)


def of(rows: Sequence[Row], kind: type) -> list[Row]:
    """Rows of one program: `Own`, `Peer` or `Stiff`."""
    return [row for row in rows if isinstance(row.case, kind)]


def best_way(rows: Sequence[Row], elements: int, step: float) -> Row | None:
    """Exudyn's fastest way to solve a step that errs at the tip at most a tenth more than its best, None if none ran."""
    here = [row for row in rows if isinstance(row.case, Peer) and (row.case.elements, row.case.step) == (elements, step)]
    return fastest(here, SAME * min((row.tip_mm for row in here if row.good), default=0.0))


@dataclass(frozen=True)
class Match:
    """The fastest of both programs at an error of the tip (mm); a row is None where none reaches it."""

    most: float
    own: Row | None
    other: Row | None

    @property
    def ratio(self) -> float | None:
        """Time of the other over the own one."""
        return None if self.own is None or self.other is None else self.other.seconds / self.own.seconds


def matches(rows: Sequence[Row], kind: type = Peer) -> list[Match]:
    """At equal error of the tip."""
    own, other = of(rows, Own), of(rows, kind)
    return [Match(most, fastest(own, most), fastest(other, most)) for most in EQUAL]


@dataclass(frozen=True)
class Duel:
    """The default against a case of Exudyn at its step, run in turn: wall seconds per simulated second of all runs."""

    case: Peer
    own: tuple[float, ...]
    other: tuple[float, ...]

    @property
    def medians(self) -> tuple[float, float]:
        """Of the own runs and of the other's."""
        return statistics.median(self.own), statistics.median(self.other)

    @property
    def ratio_of_minima(self) -> float:
        """The other's fastest run over the own one."""
        return min(self.other) / min(self.own)

    @property
    def told(self) -> dict[str, object]:
        """Everything as one flat object."""
        own, other = self.medians
        return {
            "step_s": self.case.step, "elements": self.case.elements, "exudyn_method": self.case.label,
            "boom_twin_s": self.own, "exudyn_s": self.other, "ratio_of_medians": other / own,
            "ratio_of_minima": self.ratio_of_minima,
        }  # fmt: skip


def better(rows: Sequence[Row], row: Row) -> Row | None:
    """The fastest own row that is clearly faster than `row` and no worse in both errors; None if `row` is on the front."""
    faster = [
        other
        for other in of(rows, Own)
        if other.good
        and other.seconds < NOISE * row.seconds
        and other.tip_mm <= row.tip_mm
        and other.acceleration <= row.acceleration
    ]
    return min(faster, key=lambda other: other.seconds, default=None)


def order(rows: Sequence[Row]) -> list[tuple[Row, float | None]]:
    """Rows of one method by falling step, each with the order of its own tip error from the step before."""
    found: list[tuple[Row, float | None]] = []
    for row in sorted(rows, key=lambda row: -row.case.step if isinstance(row.case, Own | Peer) else 0.0):
        last = found[-1][0] if found else None
        slope = None
        if last is not None and last.good and row.good and isinstance(row.case, Own) and isinstance(last.case, Own):
            slope = math.log(last.own_mm / row.own_mm) / math.log(last.case.step / row.case.step)
        found.append((row, slope))
    return found
