"""Rows of the error study, one per case, and the choice among them: front, fastest, order, equal step."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....analysis.methods import integrate_with
from .cases import Case, Own, Peer
from .problem import ROW, Path, Problem, at_rest, every, load_rig, path_of

ROUNDS = 5  # over all cases, so that the runs of a case lie minutes apart; the time is that of the fastest
REPEATS = 3  # in each of them
BRIEF = 0.5  # s; a run of Exudyn that takes longer is not repeated within a round
LONG = 2.0  # s; a run of Exudyn that takes longer is not repeated in another round


@dataclass(frozen=True)
class Row:
    """Result of one case; NaN where it failed. Errors are rms, against the own and the independent reference."""

    case: Case
    own_mm: float = math.nan  # of the tip
    own_acceleration: float = math.nan  # of the tip, relative
    independent_mm: float = math.nan
    independent_acceleration: float = math.nan
    seconds: float = math.nan  # CPU time of the stepping alone per simulated second
    steps: int = 0
    passes: float = math.nan  # of Newton's method per step
    status: str = "ok"  # or why there are no numbers

    @property
    def tip_mm(self) -> float:
        """Return the larger of both errors: no program is judged by itself alone."""
        return float(np.fmax(self.own_mm, self.independent_mm))

    @property
    def acceleration(self) -> float:
        """Return the larger of both errors."""
        return float(np.fmax(self.own_acceleration, self.independent_acceleration))

    @property
    def good(self) -> bool:
        """Return True if the case went through to finite numbers."""
        return self.status == "ok" and math.isfinite(self.own_mm) and math.isfinite(self.seconds)


class Runner:
    """Runs cases on one problem; booms of Exudyn that are at rest are kept and moved again."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.resting: dict[tuple[int, bool], Any] = {}

    def rows(self, cases: list[Case], rounds: int, tick: Callable[[], object]) -> list[Row]:
        """Return a row for every case, in their order; `tick` is called after each case of each of the `rounds`."""
        found = dict[Case, Row]()
        for turn in range(rounds):
            for case in cases:
                if turn == 0:
                    found[case] = self.row(case)
                elif (row := found[case]).good and (isinstance(case, Own) or row.seconds * self.problem.motion.duration < LONG):
                    found[case] = replace(row, seconds=min(row.seconds, self.row(case).seconds))
                tick()
        return list(found.values())

    def row(self, case: Case) -> Row:
        """Run one case once. Whatever it raises becomes its status."""
        try:
            return self._own(case) if isinstance(case, Own) else self._exudyn(case)
        except Exception as failure:  # a report on methods must survive every one of them
            text = " ".join(str(failure).split()) or "no reason was given"
            return Row(case, status=f"{type(failure).__name__}: {text}"[:300])

    def _own(self, case: Own) -> Row:
        motion, scene = self.problem.motion, case.scene(self.problem.scene)
        rest = motion.duration, case.step, every(case.step), case.method, case.basis, motion.angles
        found = min((integrate_with(scene, motion, *rest) for _ in range(REPEATS)), key=lambda run: run.seconds)
        path = Path(found.tip, found.tip_acceleration)
        return self._row(case, path, found.seconds, found.steps, found.passes, found.status)

    def _exudyn(self, case: Peer) -> Row:
        rig, missing = load_rig()
        if rig is None:
            raise RuntimeError(missing)
        motion, boom = self.problem.motion, (case.elements, case.lumped)
        if boom not in self.resting:
            self.resting[boom] = at_rest(rig, self.problem.scene, motion.first, *boom)
        scheme = rig.Scheme(kept=case.kept, tolerance=case.tolerance)
        efforts: list[Any] = []
        while not efforts or (len(efforts) < REPEATS and efforts[-1].seconds < BRIEF):
            columns, effort = rig.move(self.resting[boom], motion, motion.duration, case.step, ROW, scheme)
            efforts.append(effort)
        best, count = min(efforts, key=lambda effort: effort.seconds), round(motion.duration / case.step)
        return self._row(case, path_of(columns), best.seconds, count, best.passes / count)

    def _row(self, case: Case, path: Path, seconds: float, steps: int, passes: float, status: str = "ok") -> Row:
        own, independent = self.problem.errors(path)
        return Row(
            case, *own, *(independent or (math.nan, math.nan)), seconds / self.problem.motion.duration, steps, passes, status
        )


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


def fastest(rows: Sequence[Row], most: float) -> Row | None:
    """Return the fastest row whose tip is wrong by at most `most` (mm)."""
    return min((row for row in rows if row.good and row.tip_mm <= most), key=lambda row: row.seconds, default=None)


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
    """Run the default and Exudyn's fastest at its step that is exact enough in turn; None if none of its cases is.

    Both meet the same machine so. Times are CPU seconds per simulated second of every run.
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
