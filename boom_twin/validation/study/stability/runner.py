"""Run the stability study: every case by every method, judged against what is right there."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from ....analysis.equilibrium import rest_at
from ....analysis.methods import Method, MethodRun, integrate_with
from ....errors import SolverError
from ....scene.kinematics import joint_angles_of_strokes
from ....types import Array
from .cases import Case
from .setups import Setup
from .verdict import CaseVerdict, Facts, against_motion, against_rest, verdict

METHODS: dict[str, Method] = {
    "default": Method(),
    "rho 1": Method(parameter=1.0),
    "rho 0.5": Method(parameter=0.5),
    "rho 0": Method(parameter=0.0),
    "Newmark 0.5": Method("newmark", 0.5),
    "Newmark 0.6": Method("newmark", 0.6),
    "Wilson 1.4": Method("wilson", 1.4),
    "Houbolt": Method("houbolt"),
    "Park": Method("park"),
    "single pass": Method(passes=1),
    "plain product": Method(product="plain"),
}
RIGHT = Method(tolerance=1e-10)
NOTHING = "there is no solution"
FINER, FINEST = 8, 5e-6  # steps of what is right: an eighth, but not below this (s), where round-off takes over


@dataclass(frozen=True)
class Cell:
    """Result of one method in one case."""

    facts: Facts
    verdict: CaseVerdict


@dataclass(frozen=True)
class CaseResult:
    """A case with a cell for each method, and what the reference was."""

    case: Case
    reference: str
    cells: dict[str, Cell]


def run(
    found: Iterable[Case], methods: dict[str, Method] | None = None, progress: Callable[[str], None] = lambda line: None
) -> list[CaseResult]:
    """March all cases by all methods; `progress` is told of each case as it is done."""
    rows = []
    for case in found:
        rows.append(one(case, METHODS if methods is None else methods))
        progress(f"{case.group}: {case.name}: " + ", ".join(cell.verdict.word for cell in rows[-1].cells.values()))
    return rows


def one(case: Case, methods: dict[str, Method]) -> CaseResult:
    """March one case by `methods`."""
    try:
        setup = case.make()
        judge, told = _judge(case, setup)
    except SolverError as error:
        refused = _cell(Facts(str(error), solvable=False))
        return CaseResult(case, NOTHING, dict.fromkeys(methods, refused))
    return CaseResult(case, told, {name: _cell(_facts(case, setup, method, judge)) for name, method in methods.items()})


def _cell(facts: Facts) -> Cell:
    return Cell(facts, verdict(facts))


def _facts(case: Case, setup: Setup, method: Method, judge: Callable[[MethodRun], Facts]) -> Facts:
    try:
        return judge(_marched(setup, method))
    except SolverError as error:
        return Facts(str(error), solvable=case.truth != "none")


def _judge(case: Case, setup: Setup) -> tuple[Callable[[MethodRun], Facts], str]:
    """Return the function that judges a motion of the case, and its reference in words.

    Raises
    ------
    SolverError
        No equilibrium to start from.
    """
    if case.truth == "none":
        return _none, NOTHING
    if case.truth == "fine steps":
        right, stride = _right(setup)
        if right.status != "ok":
            return _none, f"{NOTHING}: the reference ended, {right.status}"
        return lambda found: _against(found, right, stride, setup), f"default method at {_fine(setup):.3g} s"
    rest = _equilibrium(setup) if case.truth == "equilibrium" else None
    told = "equilibrium of the last strokes" if rest is not None else "a vibration that does not grow about a mean that stays"
    return lambda found: _ended(found) or against_rest(found, rest, setup.still, setup.every), told


def _none(found: MethodRun) -> Facts:
    return Facts(found.status, solvable=False, doubt=found.doubt, passes=found.passes)


def _against(found: MethodRun, right: MethodRun, stride: int, setup: Setup) -> Facts:
    return _ended(found) or against_motion(_thinned(found, stride), right, setup.still, setup.jump)


def _ended(found: MethodRun) -> Facts | None:
    """Facts of a motion that did not reach its end; None if it did."""
    return None if found.status == "ok" else Facts(found.status, passes=found.passes)


def _marched(setup: Setup, method: Method) -> MethodRun:
    return integrate_with(setup.scene, setup.drive, setup.duration, setup.step, setup.every, method, angles=setup.angles)


def _fine(setup: Setup) -> float:
    return max(setup.step / FINER, FINEST)


def _right(setup: Setup) -> tuple[MethodRun, int]:
    """Return the reference motion, and how many rows of the case's motion there are to one of its rows."""
    step = _fine(setup)
    every, stride = max(round(setup.step / step), 1), max(round(step / setup.step), 1)
    return integrate_with(setup.scene, setup.drive, setup.duration, step, every, RIGHT, angles=setup.angles), stride


def _thinned(motion: MethodRun, stride: int) -> MethodRun:
    """Every `stride`-th row."""
    names = ("times", "tip", "tip_acceleration", "joints", "cylinder_forces")
    return replace(motion, **{name: getattr(motion, name)[::stride] for name in names})


def _equilibrium(setup: Setup) -> Array:
    """Tip (m), shape (2,), at rest at the last strokes."""
    strokes = setup.drive(np.array([setup.duration]))[0][0]
    _, state, _ = rest_at(setup.scene, strokes, joint_angles_of_strokes(setup.scene, strokes, near=setup.angles))
    return state.frames[-1, :2].copy()
