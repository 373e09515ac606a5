"""The tables of `study error`, in Markdown."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Sequence

from .error_cases import Case, Own, Peer, Stiff
from .error_front import Match, acceleration, fastest, front, of, order, tip
from .error_run import Row
from .report import table

TIPS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # mm
ACCELERATIONS = (1e-3, 3e-3, 1e-2, 3e-2, 0.1)


def name(case: Case) -> str:
    """Method with its step or tolerance."""
    return f"{case.label}, " + (f"tolerance {case.tolerance:g}" if isinstance(case, Stiff) else f"step {1e3 * case.step:g} ms")


def run_time(row: Row | None) -> float | None:
    """Wall milliseconds per simulated second."""
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
    """What did not go through, and why."""
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
