"""Study of stability (`boom_twin study stability`): every case by every method, and the report."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.equilibrium import rest_at
from ...analysis.methods import Method, MethodRun, integrate_with
from ...errors import SolverError
from ...scene.kinematics import joint_angles_of_strokes, section_angles
from ...scene.schema import Scene
from ...system.atomic_files import write_atomic
from .report import page, table, write_json
from .stability_cases import Case, Setup, cases, move_in_words
from .stability_verdict import BOUNDS, Facts, against_motion, against_rest

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
NOTHING = "there is no solution"


@dataclass(frozen=True)
class CaseResult:
    """Case with its reference in words and what each method did."""

    case: Case
    reference: str
    cells: dict[str, Facts]


def run(found: Iterable[Case], methods: dict[str, Method]) -> list[CaseResult]:
    """Integrate all cases by `methods`, and print a line to stderr after each case."""
    rows = []
    for case in found:
        rows.append(one(case, methods))
        words = ", ".join(cell.verdict.word for cell in rows[-1].cells.values())
        print(f"{case.group}: {case.name}: {words}", file=sys.stderr)
    return rows


def one(case: Case, methods: dict[str, Method]) -> CaseResult:
    """Integrate one case by `methods`."""
    try:
        setup = case.make()
        judge, reference = _judge(case, setup)
    except SolverError as error:
        return CaseResult(case, NOTHING, dict.fromkeys(methods, Facts(str(error), solvable=False)))

    def cell(method: Method) -> Facts:
        try:
            return judge(_march(setup, setup.step, 1, method))
        except SolverError as error:
            return Facts(str(error), solvable=case.truth != "none")

    return CaseResult(case, reference, {name: cell(method) for name, method in methods.items()})


def _judge(case: Case, setup: Setup) -> tuple[Callable[[MethodRun], Facts], str]:
    """Return the function that judges a motion of the case, and its reference in words; SolverError without equilibrium."""

    def unsolvable(found: MethodRun) -> Facts:
        return Facts(found.status, solvable=False, doubt=found.doubt, passes=found.passes)

    def ended(found: MethodRun) -> Facts | None:
        return None if found.status == "ok" else Facts(found.status, passes=found.passes)

    if case.truth == "none":
        return unsolvable, NOTHING
    if case.truth == "fine steps":
        step = max(setup.step / 8, 5e-6)  # s; in shorter steps round-off prevails
        every, stride = max(round(setup.step / step), 1), max(round(step / setup.step), 1)
        right = _march(setup, step, every, Method(tolerance=1e-10))
        if right.status != "ok":
            return unsolvable, f"{NOTHING}: the reference ended, {right.status}"
        told = f"default method at {step:.3g} s"
        return lambda found: ended(found) or against_motion(_thinned(found, stride), right, setup.still, setup.jump), told
    rest = None  # the tip (m) at rest at the last strokes
    if case.truth == "equilibrium":
        last = setup.drive(np.array([setup.duration]))[0][0]
        angles = joint_angles_of_strokes(setup.scene, last, near=setup.angles)
        rest = rest_at(setup.scene, last, angles)[1].frames[-1, :2].copy()
    told = "equilibrium of the last strokes" if rest is not None else "a vibration that does not grow about a mean that stays"
    return lambda found: ended(found) or against_rest(found, rest, setup.still), told


def _march(setup: Setup, step: float, every: int, method: Method) -> MethodRun:
    return integrate_with(setup.scene, setup.drive, setup.duration, step, every, method, angles=setup.angles)


def _thinned(motion: MethodRun, stride: int) -> MethodRun:
    names = ("times", "tip", "tip_acceleration", "joints", "cylinder_forces")
    return replace(motion, **{name: getattr(motion, name)[::stride] for name in names})


MEANINGS = {
    "holds": "every bound below is kept",
    "degrades": "usable, with a symptom listed below",
    "fails": "no usable numbers, and the status or a warning says so",
    "silent": "wrong numbers without a warning",
    "refuses": "there is no solution, and the status says so",
}


def write(scene: Scene, out: Path, quick: bool = False, posture: str | None = None) -> list[Path]:
    """Run the study on motions from `posture`; write stability.json and stability.md; return their paths.

    `quick`: a subset of the cases.
    """
    if posture is not None:
        scene = scene.model_copy(update={"postures": {posture: section_angles(scene, posture)}})
    chosen = [case for case in cases(scene) if case.quick or not quick]
    rows, paths = run(chosen, METHODS), [out / f"stability.{kind}" for kind in ("json", "md")]
    write_json(paths[0], _content(rows))
    write_atomic(paths[1], text(rows, move_in_words(scene)))
    return paths


def text(rows: Sequence[CaseResult], move: str) -> str:
    """Return the whole report in Markdown."""
    bounds = [
        f"- {symptom.format('..')}: {low:g}, {high if math.isfinite(high) else 'never'}.\n"
        for low, high, symptom in BOUNDS.values()
    ]
    parts = [
        "# Stability on stiff and extreme cases",
        "Every method integrates every case. The reference is the default method at an eighth of the step (Newton tolerance "
        f"1e-10 rad), or the equilibrium. The move: {move}. Cases make all or part of it, in 1 s unless stated otherwise. "
        "Accelerations and forces within 50 ms after a speed jump are impulses and are ignored.",
        "## Verdicts by method", "".join(f"- {mark}: {meaning}.\n" for mark, meaning in MEANINGS.items()), _counts(rows),
        "## The default",
        "All cases hold except:", _default(rows),
        "## Other methods",
        "Cases worse than with the default (symptoms: `stability.json`):", _others(rows),
        "## Bounds", "A case degrades above the first number and fails above the second:", "".join(bounds),
        "Limits: one move. Cases with another geometry use invented booms.",
    ]  # fmt: skip
    return page(parts)


def _counts(rows: Sequence[CaseResult]) -> str:
    lines = [
        (method, *(sum(row.cells[method].verdict.mark == mark for row in rows) for mark in MEANINGS))
        for method in rows[0].cells
    ]
    return table(("method", *MEANINGS), lines)


def _default(rows: Sequence[CaseResult]) -> str:
    found = [(row.case, row.cells["default"].verdict) for row in rows]
    return "".join(
        f"- {case.group}: {case.name} ({case.varied}): {own.mark}; {own.symptom.partition('. ')[0]}.\n"
        for case, own in found
        if own.word != "holds"
    )


def _others(rows: Sequence[CaseResult]) -> str:
    ranks = {mark: rank for rank, mark in enumerate(("holds", "refuses", "degrades", "fails", "silent"))}
    methods: dict[str, list[str]] = {}
    for method in rows[0].cells:
        worse: dict[str, dict[str, list[str]]] = {}
        for row in rows:
            mark = row.cells[method].verdict.mark
            if ranks[mark] > ranks[row.cells["default"].verdict.mark]:
                worse.setdefault(mark, {}).setdefault(row.case.group, []).append(row.case.name)
        told = "; ".join(f"{mark} in {_listed(groups)}" for mark, groups in worse.items())
        methods.setdefault(told, []).append(method)
    return "".join(f"- {', '.join(names)}: {told}.\n" for told, names in methods.items() if told) or "None.\n"


def _listed(groups: dict[str, list[str]]) -> str:
    return ", ".join(f"{group} ({'; '.join(names)})" for group, names in groups.items())


def _content(rows: list[CaseResult]) -> dict[str, Any]:
    silent = [(row.case, method) for row in rows for method, cell in row.cells.items() if cell.verdict.silent]
    return {
        "methods": METHODS,
        "bounds": {name: {"degrades": low, "fails": high} for name, (low, high, _) in BOUNDS.items()},
        "cases": [
            {
                "group": row.case.group,
                "name": row.case.name,
                "varied": row.case.varied,
                "right": row.reference,
                "methods": {
                    name: dataclasses.asdict(facts.verdict) | dataclasses.asdict(facts) for name, facts in row.cells.items()
                },
            }
            for row in rows
        ],
        "silent": [{"group": case.group, "name": case.name, "method": method} for case, method in silent],
    }
