"""Run the cases of the error study: one row per case, also for those that fail."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....analysis.methods import integrate_with
from ....types import Array
from ...reference.segments.stiff_solver import follow
from .cases import Case, Own, Peer, Stiff
from .problem import ROW, Path, Problem, at_rest, every, load_rig, path_of

ROUNDS = 5  # over all cases, so that the runs of a case lie minutes apart; the time is that of the fastest
REPEATS = 3  # in each of them
BRIEF = 0.5  # s; a run of Exudyn that takes longer is not repeated within a round
LONG = 2.0  # s; a peer that takes longer is not run again


@dataclass(frozen=True)
class Timed:
    """A path, CPU seconds of the stepping alone, steps (or evaluations of an adaptive solver), passes per step, status."""

    path: Path
    seconds: float
    steps: int
    passes: float | None
    status: str = "ok"
    feeding: float | None = None


@dataclass(frozen=True)
class Row:
    """Result of one case; NaN where it failed.

    Attributes
    ----------
    own_mm, independent_mm : float
        rms of the tip against the own and the independent reference.
    own_acceleration, independent_acceleration : float
        The same of its acceleration, relative.
    seconds : float
        Of CPU time per simulated second, stepping alone.
    feeding : float
        Share of it in which Exudyn's drives get their lengths.
    """

    case: Case
    own_mm: float = math.nan
    own_acceleration: float = math.nan
    independent_mm: float = math.nan
    independent_acceleration: float = math.nan
    seconds: float = math.nan
    steps: int = 0
    passes: float | None = None
    feeding: float | None = None
    status: str = "ok"

    @property
    def tip_mm(self) -> float:
        """The larger of both errors: no program is judged by itself alone."""
        return float(np.nanmax([self.own_mm, self.independent_mm])) if math.isfinite(self.own_mm) else math.nan

    @property
    def acceleration(self) -> float:
        """The larger of both errors."""
        both = [self.own_acceleration, self.independent_acceleration]
        return float(np.nanmax(both)) if math.isfinite(self.own_acceleration) else math.nan

    @property
    def good(self) -> bool:
        """Return True if the case went through to finite numbers."""
        return self.status == "ok" and math.isfinite(self.tip_mm) and math.isfinite(self.seconds)


class Runner:
    """Runs cases on one problem; booms of Exudyn that are at rest are kept and moved again."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.resting: dict[tuple[int, bool], Any] = {}

    def rows(self, cases: list[Case], rounds: int, tick: Callable[[], object]) -> list[Row]:
        """A row for every case, in their order; `tick` is called after each case of each of the `rounds`."""
        found, times = dict[Case, Row](), dict[Case, list[float]]()
        for turn in range(rounds):
            for case in cases:
                if turn == 0 or self._again(case, found[case]):
                    row = self.row(case)
                    found.setdefault(case, row)
                    times.setdefault(case, []).append(row.seconds)
                tick()
        return [replace(row, seconds=min(times[case])) for case, row in found.items()]

    def row(self, case: Case) -> Row:
        """Run one case once. Whatever it raises becomes its status."""
        try:
            timed = self._timed(case)
        except Exception as failure:  # a report on methods must survive every one of them
            return Row(case, status=_sentence(failure))
        return self._judged(case, timed)

    def _again(self, case: Case, row: Row) -> bool:
        short = row.seconds * self.problem.motion.duration < LONG
        return row.good and (isinstance(case, Own) or (isinstance(case, Peer) and short))

    def _judged(self, case: Case, timed: Timed) -> Row:
        span = self.problem.motion.duration
        own, independent = self.problem.errors(timed.path)
        away = (math.nan, math.nan) if independent is None else independent
        feeding = None if timed.feeding is None else timed.feeding / timed.seconds
        return Row(case, *own, *away, timed.seconds / span, timed.steps, timed.passes, feeding, timed.status)

    def _timed(self, case: Case) -> Timed:
        if isinstance(case, Own):
            return self._own(case)
        return self._exudyn(case) if isinstance(case, Peer) else self._scipy(case)

    def _own(self, case: Own) -> Timed:
        motion = self.problem.motion
        found = integrate_with(
            case.scene(self.problem.scene), motion, motion.duration, case.step, every(case.step), case.method, case.basis,
            motion.angles, REPEATS,
        )  # fmt: skip
        path = Path(found.tip, found.tip_acceleration)
        return Timed(path, found.seconds, found.steps, found.passes, found.status)

    def _exudyn(self, case: Peer) -> Timed:
        rig, missing = load_rig()
        if rig is None:
            raise RuntimeError(missing)
        motion = self.problem.motion
        boom = case.elements, case.lumped
        if boom not in self.resting:
            self.resting[boom] = at_rest(rig, self.problem.scene, motion.first, *boom)
        scheme = rig.Scheme(kept=case.kept, tolerance=case.tolerance)
        count = round(motion.duration / case.step)
        efforts: list[Any] = []
        while not efforts or (len(efforts) < REPEATS and efforts[-1].seconds < BRIEF):
            columns, effort = rig.move(self.resting[boom], motion, motion.duration, case.step, ROW, scheme)
            efforts.append(effort)
        best = min(efforts, key=lambda effort: effort.seconds)
        return Timed(path_of(columns), best.seconds, count, best.passes / count, feeding=best.feeding)

    def _scipy(self, case: Stiff) -> Timed:
        scene, motion = self.problem.scene, self.problem.motion
        closed = np.array([joint.cylinder.closed_length for joint in scene.joints])

        def drive(time: float) -> tuple[Any, Any, Any]:
            strokes, rates, accelerations = motion.at(time)
            return closed + strokes, rates, accelerations

        times: Array = ROW * np.arange(round(motion.duration / ROW) + 1, dtype=np.float64)
        found = follow(scene, drive, motion.angles, times, case.fineness, case.tolerance, case.solver, REPEATS)
        return Timed(Path(found.tip, found.tip_acceleration), found.seconds, found.evaluations, None)


def in_turn(problem: Problem, own: Own, peer: Peer, repeats: int) -> tuple[list[float], list[float]]:
    """Both cases in turn, so that they meet the same machine: CPU seconds per simulated second of every run."""
    runner = Runner(problem)
    rows = [(runner.row(own), runner.row(peer)) for _ in range(repeats)]
    return [row.seconds for row, _ in rows], [row.seconds for _, row in rows]


def _sentence(failure: Exception) -> str:
    text = " ".join(str(failure).split()) or "no reason was given"
    return f"{type(failure).__name__}: {text}"[:300]
