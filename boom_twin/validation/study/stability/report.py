"""Report of the stability study, `boom_twin study stability`."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ....scene.kinematics import section_angles
from ....scene.schema import Scene
from ....system.atomic_files import write_atomic
from ..report import page, table, write_json
from .cases import Case, cases, long_holds, move_in_words
from .runner import METHODS, CaseResult, Limit, limit_of, run
from .verdict import BOUNDS

NO_EQUILIBRIUM = "no equilibrium"
MEANINGS = {
    "holds": "every bound below is kept",
    "degrades": "usable, with a symptom listed below",
    "fails": "no usable numbers, and the status or a warning says so",
    "silent": "wrong numbers without a warning",
    "refuses": "there is no solution, and the status says so",
}


def write(scene: Scene, out: Path, quick: bool = False, posture: str | None = None, soak: bool = False) -> list[Path]:
    """Run the study on motions from `posture`; write stability.json and stability.md; return their paths.

    `quick`: a subset of the cases. `soak`: the holds of 24 simulated hours as well, by the default method.
    """
    if posture is not None:
        scene = scene.model_copy(update={"postures": {posture: section_angles(scene, posture)}})
    chosen = [case for case in cases(scene) if case.quick or not quick]
    rows = run(chosen, METHODS, _progress)
    long_rows = run(long_holds(scene) if soak else (), {"default": METHODS["default"]}, _progress)
    limits = {_title(row.case): limit_of(row.case.make()) for row in rows if NO_EQUILIBRIUM in row.cells["default"].status}
    return write_files(out, rows, long_rows, limits, move_in_words(scene))


def _progress(line: str) -> None:
    print(line, file=sys.stderr)


def _title(case: Case) -> str:
    return f"{case.group}: {case.name}"


def write_files(
    out: Path, rows: list[CaseResult], long_rows: list[CaseResult], limits: dict[str, Limit], move: str
) -> list[Path]:
    """Write all files; `long_rows` are holds of a day, `move` tells of the scene's motion."""
    paths = [out / f"stability.{kind}" for kind in ("json", "md")]
    write_json(paths[0], _content(rows + long_rows, limits))
    write_atomic(paths[1], text(rows, long_rows, limits, move))
    return paths


def text(rows: Sequence[CaseResult], long_rows: Sequence[CaseResult], limits: dict[str, Limit], move: str) -> str:
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
    ]  # fmt: skip
    if limits:
        parts += ["## Where there is no equilibrium", "The lowest natural frequency falls to zero."]
        parts += ["".join(_limit(name, limit) for name, limit in limits.items())]
    if long_rows:
        parts += ["## Holds of 24 simulated hours", _long(long_rows)]
    parts += ["Limits: one move. Cases with another geometry use invented booms."]
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
        f"- {_title(case)} ({case.varied}): {own.mark}; {own.symptom.partition('. ')[0]}.\n"
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


def _limit(name: str, limit: Limit) -> str:
    return (
        f"- {name}: equilibrium up to {limit.share:.3g} of its weight. Lowest frequency there {limit.frequency:.2g} Hz, "
        f"unloaded {limit.unloaded:.2g} Hz.\n"
    )


def _long(rows: Sequence[CaseResult]) -> str:
    head = ("case", "compared with", "verdict", "drift / path of the tip", "vibration, last quarter / first", "passes")
    lines = []
    for row in rows:
        facts = row.cells["default"]
        lines.append((row.case.name, row.reference, facts.verdict.mark, facts.drift, facts.growth, facts.passes))
    return table(head, lines)


def _content(rows: list[CaseResult], limits: dict[str, Limit]) -> dict[str, Any]:
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
        "limits": limits,
    }
