"""Pareto fronts and tables of the error study."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from ..report import table
from .cases import Case, Own, Peer, Stiff
from .runner import Row

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


def fastest_at_step(rows: Sequence[Row], step: float, most: float = EQUAL[0]) -> Row | None:
    """Exudyn's fastest row of a step (s) that errs at the tip at most `most` (mm), None if there is none."""
    return fastest([row for row in of(rows, Peer) if isinstance(row.case, Peer) and row.case.step == step], most)


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
    """Return the fastest own row and the fastest of the other kind at equal errors of the tip."""
    own, other = of(rows, Own), of(rows, kind)
    return [Match(most, fastest(own, most), fastest(other, most)) for most in EQUAL]


@dataclass(frozen=True)
class PairedTiming:
    """The default against a case of Exudyn at its step, run in turn: CPU seconds per simulated second of all runs."""

    case: Peer
    own: tuple[float, ...]
    other: tuple[float, ...]

    @property
    def medians(self) -> tuple[float, float]:
        """Medians of the own runs and of the other's."""
        return statistics.median(self.own), statistics.median(self.other)

    @property
    def ratio_of_minima(self) -> float:
        """The other's fastest run over the own one."""
        return min(self.other) / min(self.own)

    @property
    def told(self) -> dict[str, object]:
        """Flat dict of all results."""
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


TIPS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # mm
ACCELERATIONS = (1e-3, 3e-3, 1e-2, 3e-2, 0.1)


def name(case: Case) -> str:
    """Method with its step or tolerance."""
    return f"{case.label}, " + (f"tolerance {case.tolerance:g}" if isinstance(case, Stiff) else f"step {1e3 * case.step:g} ms")


def run_time(row: Row | None) -> float | None:
    """CPU milliseconds per simulated second."""
    return None if row is None else 1e3 * row.seconds


def equal_error_table(found: Sequence[Match], other: str) -> str:
    """The fastest of ours against the fastest of another program."""
    head = ("tip error, mm", "boom_twin", "ms/s", other, "ms/s", f"{other} takes")
    return table(head, [_match(match) for match in found])


def _match(match: Match) -> tuple[object, ...]:
    ratio = None if match.ratio is None else f"{match.ratio:.{0 if match.ratio > 10.0 else 1}f} times as long"
    own, theirs = (_or_none(row) for row in (match.own, match.other))
    return f"{match.most:g}", own, run_time(match.own), theirs, run_time(match.other), ratio


def cheapest_table(rows: Sequence[Row]) -> str:
    """The fastest own row that keeps an error."""
    own = of(rows, Own)
    lines = [(f"tip {most:g} mm", fastest(own, most, tip)) for most in TIPS]
    lines += [(f"acceleration {100 * most:g} %", fastest(own, most, acceleration)) for most in ACCELERATIONS]
    head = ("error kept", "fastest of boom_twin", "ms/s", "tip, mm", "acceleration, %")
    return table(head, [(what, _or_none(row), *_numbers(row)) for what, row in lines])


def front_table(rows: Sequence[Row]) -> str:
    """The Pareto front of all programs, in the tip and in its acceleration."""
    chosen = {id(row): "tip" for row in front(rows, tip)}
    for row in front(rows, acceleration):
        chosen[id(row)] = "both" if id(row) in chosen else "acceleration"
    listed = sorted((row for row in rows if id(row) in chosen), key=lambda row: row.seconds)
    return table(("method", "front of", "ms/s", "tip, mm", "acceleration, %"),
                 [(name(row.case), chosen[id(row)], *_numbers(row)) for row in listed])  # fmt: skip


def order_table(rows: Sequence[Row], label: str) -> str:
    """One own method by step, with the order of its error against the own reference."""
    listed = [row for row in of(rows, Own) if row.case.label == label]
    head = ("step, ms", "tip, mm, own reference", "order", "tip, mm, independent", "acceleration, %", "ms/s", "passes")
    return table(head, [
        (f"{1e3 * row.case.step:g}", row.own_mm, slope, row.independent_mm, 100.0 * row.acceleration, run_time(row), row.passes)
        for row, slope in order(listed) if isinstance(row.case, Own)
    ])  # fmt: skip


def matrices(rows: Sequence[Row], kind: type) -> str:
    """Every method of a program by its steps: error of the tip, of the acceleration, and run time."""
    parts = (
        ("Tip, mm rms", tip),
        ("Acceleration, % of its rms", lambda row: 100.0 * row.acceleration),
        ("Run time of the stepping, ms per simulated second", lambda row: 1e3 * row.seconds),
    )
    return "\n".join(f"{title}\n\n{_matrix(of(rows, kind), value)}" for title, value in parts)


def _matrix(rows: Sequence[Row], value: Callable[[Row], float]) -> str:
    """Methods down, steps (or tolerances) across."""
    columns = sorted({_column(row.case) for row in rows})
    methods = list(dict.fromkeys(row.case.label for row in rows))
    cells = {(row.case.label, _column(row.case)): value(row) if row.good else "failed" for row in rows}
    unit = "tolerance" if rows and isinstance(rows[0].case, Stiff) else "step, ms"
    head = [f"method \\ {unit}", *(f"{column:g}" for column in columns)]
    return table(head, [(method, *(cells.get((method, column)) for column in columns)) for method in methods])


def _column(case: Case) -> float:
    return case.tolerance if isinstance(case, Stiff) else round(1e3 * case.step, 6)


def failures_table(rows: Iterable[Row]) -> str:
    """Return a table of the cases that failed, and why."""
    return table(("method", "status"), [(name(row.case), _why(row)) for row in rows if not row.good])


def _why(row: Row) -> str:
    return row.status if row.status != "ok" else "its numbers are not finite"


def feeding_share(rows: Sequence[Row]) -> float | None:
    """Share of Exudyn's run time that its drives' Python function takes, median."""
    shares = [row.feeding for row in of(rows, Peer) if row.good and row.feeding]
    return statistics.median(shares) if shares else None


def _or_none(row: Row | None) -> str:
    return "none" if row is None else name(row.case)


def _numbers(row: Row | None) -> tuple[object, object, object]:
    return (None, None, None) if row is None else (run_time(row), row.tip_mm, 100.0 * row.acceleration)
