"""Rows of the error study chosen by error and run time: Pareto front, fastest, orders, comparisons at equal error and step."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from typing import Any

from .cases import Own, Peer
from .runner import Row, Runner

EQUAL = (0.3, 1.0, 3.0, 10.0)  # mm
Measure = Callable[[Row], float]


def tip(row: Row) -> float:
    """Return the error of the tip, mm."""
    return row.tip_mm


def acceleration(row: Row) -> float:
    """Return the relative error of the tip's acceleration."""
    return row.acceleration


def of(rows: Sequence[Row], kind: type) -> list[Row]:
    """Return the rows of one program: `Own` or `Peer`."""
    return [row for row in rows if isinstance(row.case, kind)]


def front(rows: Sequence[Row], error: Measure = tip) -> list[Row]:
    """Return the Pareto front, fastest first: no row is both faster and less wrong than one of these."""
    found: list[Row] = []
    for row in sorted((row for row in rows if row.good), key=lambda row: (row.seconds, error(row))):
        if not found or error(row) < error(found[-1]):
            found.append(row)
    return found


def fastest(rows: Sequence[Row], most: float, error: Measure = tip) -> Row | None:
    """Return the fastest row whose error is at most `most`."""
    return min((row for row in rows if row.good and error(row) <= most), key=lambda row: row.seconds, default=None)


def order(rows: Sequence[Row]) -> list[tuple[Row, float | None]]:
    """Return rows of one method by falling step, each with the order of its own tip error from the step before."""
    found: list[tuple[Row, float | None]] = []
    for row in sorted(rows, key=lambda row: -row.case.step):
        last = found[-1][0] if found else None
        slope = None
        if last is not None and last.good and row.good:
            slope = math.log(last.own_mm / row.own_mm) / math.log(last.case.step / row.case.step)
        found.append((row, slope))
    return found


def same_step(runner: Runner, rows: Sequence[Row], turns: int) -> dict[str, Any] | None:
    """Run the default and Exudyn's fastest at its step that is exact enough in turn, so that both meet the same machine.

    Returns
    -------
    dict or None
        Both cases, and CPU seconds per simulated second of every run; None if no case of Exudyn is exact enough.
    """
    own = Own()
    peers = [row for row in of(rows, Peer) if row.case.step == own.step]
    most, best = next(((most, row) for most in EQUAL if (row := fastest(peers, most)) is not None), (EQUAL[-1], None))
    if best is None or not isinstance(best.case, Peer):
        return None
    ours, theirs = zip(*((runner.row(own).seconds, runner.row(best.case).seconds) for _ in range(turns)), strict=True)
    return {
        "step_s": own.step, "elements": best.case.elements, "exudyn_method": best.case.label, "exudyn_error_at_most_mm": most,
        "boom_twin_s": ours, "exudyn_s": theirs,
        "ratio_of_medians": statistics.median(theirs) / statistics.median(ours),
        "ratio_of_minima": min(theirs) / min(ours),
    }  # fmt: skip
