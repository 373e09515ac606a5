"""Runs the cases of `study error`: one row per case, also for those that fail."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis.march import march
from ..peers.stiff import follow
from ..records import Array
from .error_cases import Case, Own, Peer, Stiff
from .error_problem import ROW, Path, Problem, every, path_of
from .exudyn import load_rig

OWN_REPEATS, PEER_REPEATS = 5, 3
LONG = 4000  # steps; a run of more is timed once in a program that takes seconds for it


@dataclass(frozen=True)
class Timed:
    """A path, wall seconds of the stepping alone, steps (or evaluations of an adaptive solver), passes per step, status."""

    path: Path
    seconds: float
    steps: int
    passes: float | None
    status: str = "ok"
    feeding: float | None = None


@dataclass(frozen=True)
class Row:
    """What one case gave; NaN where it failed.

    Attributes
    ----------
    own_mm, independent_mm : float
        rms of the tip against the own and the independent reference.
    own_acceleration, independent_acceleration : float
        The same of its acceleration, relative.
    seconds : float
        Of wall time per simulated second, stepping alone.
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
        """Whether the case went through to finite numbers."""
        return self.status == "ok" and math.isfinite(self.tip_mm) and math.isfinite(self.seconds)


class Runner:
    """Runs cases on one problem; booms of Exudyn that are at rest are kept and moved again."""

    def __init__(self, problem: Problem, own_repeats: int = OWN_REPEATS, peer_repeats: int = PEER_REPEATS) -> None:
        self.problem, self.own_repeats, self.peer_repeats = problem, own_repeats, peer_repeats
        self.resting: dict[int, Any] = {}

    def rows(self, cases: list[Case], tick: Callable[[], object]) -> Iterator[Row]:
        """A row for every case; `tick` is called after each."""
        for case in cases:
            yield self.row(case)
            tick()

    def row(self, case: Case) -> Row:
        """Run one case. Whatever it raises becomes its status."""
        try:
            timed = self._timed(case)
        except Exception as failure:  # a report on methods must survive every one of them
            return Row(case, status=_sentence(failure))
        return self._judged(case, timed)

    def _judged(self, case: Case, timed: Timed) -> Row:
        span = self.problem.motion.duration
        own, independent = self.problem.errors(timed.path)
        away = (math.nan, math.nan) if independent is None else independent
        feeding = None if timed.feeding is None else timed.feeding / span
        return Row(case, *own, *away, timed.seconds / span, timed.steps, timed.passes, feeding, timed.status)

    def _timed(self, case: Case) -> Timed:
        if isinstance(case, Own):
            return self._own(case)
        return self._exudyn(case) if isinstance(case, Peer) else self._scipy(case)

    def _own(self, case: Own) -> Timed:
        motion = self.problem.motion
        found = march(
            case.scene(self.problem.scene), motion, motion.duration, case.step, every(case.step), case.method, case.basis,
            motion.angles, self.own_repeats,
        )  # fmt: skip
        path = Path(found.tip, found.tip_acceleration)
        return Timed(path, found.seconds, found.steps, found.passes, found.status)

    def _exudyn(self, case: Peer) -> Timed:
        rig, missing = load_rig()
        if rig is None:
            raise RuntimeError(missing)
        motion = self.problem.motion
        if case.elements not in self.resting:
            self.resting[case.elements] = rig.at_rest(self.problem.scene, motion.first, case.elements)
        resting, scheme = self.resting[case.elements], rig.Scheme(modified=case.modified, tolerance=case.tolerance)
        count = round(motion.duration / case.step)
        runs = [
            rig.move(resting, motion, motion.duration, case.step, ROW, scheme)
            for _ in range(self.peer_repeats if count <= LONG else 1)
        ]
        effort = sorted((effort for _, effort in runs), key=lambda effort: effort.seconds)[len(runs) // 2]
        return Timed(path_of(runs[0][0]), effort.seconds, count, effort.passes / count, feeding=effort.feeding)

    def _scipy(self, case: Stiff) -> Timed:
        scene, motion = self.problem.scene, self.problem.motion
        closed = np.array([joint.cylinder.closed_length for joint in scene.joints])

        def drive(time: float) -> tuple[Any, Any, Any]:
            strokes, rates, accelerations = motion.at(time)
            return closed + strokes, rates, accelerations

        times: Array = ROW * np.arange(round(motion.duration / ROW) + 1, dtype=np.float64)
        found = follow(scene, drive, motion.angles, times, case.fineness, case.tolerance, case.solver, self.peer_repeats)
        return Timed(Path(found.tip, found.tip_acceleration), found.seconds, found.evaluations, None)


def in_turn(problem: Problem, own: Own, peer: Peer, repeats: int) -> tuple[list[float], list[float]]:
    """Both cases in turn, so that they meet the same machine: wall seconds per simulated second of every run."""
    runner = Runner(problem, 1, 1)
    rows = [(runner.row(own), runner.row(peer)) for _ in range(repeats)]
    return [row.seconds for row, _ in rows], [row.seconds for _, row in rows]


def _sentence(failure: Exception) -> str:
    text = " ".join(str(failure).split()) or "no reason was given"
    return f"{type(failure).__name__}: {text}"[:300]
