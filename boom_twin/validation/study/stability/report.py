"""Report of the stability study, `boom_twin study stability`."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....plots.stability import MatrixRow, matrix_picture, roundoff_picture
from ....scene.kinematics import section_angles
from ....scene.schema import Scene
from ....system.atomic_files import write_atomic
from ..report import machine, provenance, table, write_json
from .cases import Case, cases, long_holds
from .exact_step import digits
from .roundoff import TARGET, TURN_UP_STEPS, Limit, Loss, TurnUp, limit_of, losses, turn_up
from .runner import METHODS, CaseResult, Cell, run
from .setups import move_in_words
from .verdict import BOUNDS

SYMBOLS = {
    "holds": "● holds",
    "degrades": "◐ degrades",
    "fails": "✕ fails",
    "silent": "‼ fails silently",
    "refuses": "○ refuses",
}

INTRODUCTION = """# Stability on stiff and extreme cases

Every case is marched by every method and judged against what is right there: the default method at an eighth of the step with
a Newton tolerance of 1e-10 rad (not below 5e-6 s, where round-off takes over), or the equilibrium. For 50 ms after a jump of
speed, accelerations and forces are impulses without a value of their own and are not compared; how long they disturb the
forces is.

- ● holds: every bound below is kept.
- ◐ degrades: usable, with the symptom listed below.
- ✕ fails: no usable numbers, and the status or a warning says so.
- ‼ fails silently: wrong numbers, and neither says so.
- ○ refuses: there is no solution, and the status says so.

"""


def mark(cell: Cell) -> str:
    """Key of a verdict's mark: its word, or "silent"."""
    return "silent" if cell.verdict.silent else cell.verdict.word


def text(
    rows: Sequence[CaseResult], long_rows: Sequence[CaseResult], limits: dict[str, Limit], losses: Sequence[Loss],
    turned: TurnUp, move: str,
) -> str:  # fmt: skip
    """The whole report; `long_rows` are holds of a day, `move` tells of the scene's motion."""
    parts = [INTRODUCTION, f"The move: {move}. Cases take it, or a share of it, in 1 s unless they say otherwise.\n\n"]
    parts += [provenance(), "\n## Matrix\n\n", _matrix(rows), "\n## Bounds\n\n", _bounds()]
    parts += ["\n## Silent failures\n\n", _silent(rows), "\n## Symptoms\n\n", "".join(_symptoms(rows))]
    if long_rows:
        parts += ["\n## Holds of 24 simulated hours\n\n", _long(long_rows)]
    if limits:
        parts += ["\n## Where there is no equilibrium\n\n", "".join(_limits(limits))]
    parts += ["\n## Digits lost in one Newton pass\n\n", _losses(losses)]
    parts += ["\n## Error of the tip over the step\n\n", _turned(turned)]
    return "".join(parts)


def _matrix(rows: Sequence[CaseResult]) -> str:
    methods = list(rows[0].cells)
    lines: list[list[object]] = [[_title(row), *(SYMBOLS[mark(cell)] for cell in row.cells.values())] for row in rows]
    counted: list[list[object]] = [
        [f"**{word}**", *(sum(mark(row.cells[method]) == key for row in rows) for method in methods)]
        for key, word in SYMBOLS.items()
    ]
    return table(["case", *methods], lines + counted)


def _title(row: CaseResult) -> str:
    return f"{row.case.group}: {row.case.name}"


def _bounds() -> str:
    lines = [[symptom.format(".."), low, "-" if math.isinf(high) else high] for low, high, symptom in BOUNDS.values()]
    return table(["symptom", "degrades above", "fails above"], lines)


def _silent(rows: Sequence[CaseResult]) -> str:
    found: dict[str, list[str]] = {}
    for row in rows:
        for method, cell in row.cells.items():
            if cell.verdict.silent:
                found.setdefault(method, []).append(_title(row))
    lines = [f"- {method}: {'; '.join(cases)}.\n" for method, cases in found.items()]
    default = "" if "default" in found else "- default: none.\n"
    return default + "".join(lines) if found else "None: no method, in no case.\n"


def _symptoms(rows: Sequence[CaseResult]) -> Iterator[str]:
    """One entry a case, methods with the same symptom together."""
    for row in rows:
        by_symptom: dict[str, list[str]] = {}
        for method, cell in row.cells.items():
            if cell.verdict.symptom:
                by_symptom.setdefault(f"{SYMBOLS[mark(cell)]}: {cell.verdict.symptom}", []).append(method)
        if by_symptom:
            yield f"- **{_title(row)}** ({row.case.varied}; right is: {row.reference})\n"
            yield from (f"    - {', '.join(methods)}: {symptom}\n" for symptom, methods in by_symptom.items())


def _limits(limits: dict[str, Limit]) -> Iterator[str]:
    yield "A boom that loses its last stiffness has no equilibrium near by: its slowest vibration then comes to rest.\n\n"
    for name, limit in limits.items():
        yield (
            f"- {name}: carries {limit.share:.3g} of its weight; there it vibrates at {limit.frequency:.2g} Hz, "
            f"without load at {limit.unloaded:.2g} Hz.\n"
        )


def _long(rows: Sequence[CaseResult]) -> str:
    head = ["case", "right is", "verdict", "drift / path of the tip", "vibration, last quarter / first", "passes"]
    lines = []
    for row in rows:
        cell = row.cells["default"]
        facts = cell.facts
        lines.append([row.case.name, row.reference, SYMBOLS[mark(cell)], facts.drift, facts.growth, facts.passes])
    return table(head, lines)


def _losses(losses: Sequence[Loss]) -> str:
    head = ["boom", "unknowns", "condition", "Riccati", "plain product", "LU of the whole"]
    lines = [
        [
            f"{loss.group}: {loss.name}" if loss.group != "sections" else loss.name,
            loss.step.unknowns,
            loss.step.condition,
            *(f"{digits(error):.1f} ({error:.0e})" for error in (loss.step.riccati, loss.step.plain, loss.step.dense)),
        ]
        for loss in losses
    ]
    before = (
        "Decimal digits of 16 (relative error) that the increment of the tip loses in one pass, against the whole system of "
        "all unknowns solved by LU and iterative refinement in extended precision. Step 1 ms unless named; condition in the "
        "1-norm after equilibration.\n\n"
    )
    return before + table(head, lines)


def _turned(turned: TurnUp) -> str:
    step, error = turned.floor
    verdict = "above" if turned.turned_up_above_target else "below"
    after = (
        f"\nOrder {turned.order:.2f}; smallest error {error:.1e} of the length at {step:.0e} s; the error turns up {verdict} "
        f"the target of {TARGET:.0e}. Below that step, differences of positions of some metres carry rounding, which a step of "
        "h turns into accelerations of its 1/h\N{SUPERSCRIPT TWO}.\n"
    )
    columns = (turned.steps, turned.errors, turned.errors * turned.length, turned.accelerations)
    lines = zip(*(column.tolist() for column in columns), strict=True)
    head = ["step, s", "largest error of the tip / length", "the same, m", "tip acceleration, rms error, m/s^2"]
    return table(head, lines) + after


QUICK_STEPS = tuple(step for step in TURN_UP_STEPS if step >= 1e-5)
NO_EQUILIBRIUM = "no equilibrium"


def _progress(line: str) -> None:
    print(line, file=sys.stderr)


def write(scene: Scene, out: Path, quick: bool = False, posture: str | None = None, soak: bool = False) -> list[Path]:
    """Run the study; write stability.json, stability.md, stability.png and stability_roundoff.png into `out`.

    Parameters
    ----------
    quick : bool
        A subset of the cases, and no steps below 1e-5 s.
    posture : str, optional
        Where motions of the scene start.
    soak : bool
        The holds of 24 simulated hours as well, by the default method.

    Returns
    -------
    list of Path
        What was written.
    """
    out.mkdir(parents=True, exist_ok=True)
    scene = scene if posture is None else _only(scene, posture)
    chosen = [case for case in cases(scene) if case.quick or not quick]
    rows = run(chosen, METHODS, _progress)
    long_rows = run(long_holds(scene) if soak else (), {"default": METHODS["default"]}, _progress)
    limits = {f"{case.group}: {case.name}": limit_of(case.make()) for case in chosen if _stuck(rows, case)}
    _progress("round-off in one step")
    lost = losses(scene, quick)
    _progress("error over the step")
    turned = turn_up(scene, QUICK_STEPS if quick else TURN_UP_STEPS)
    return write_files(out, rows, long_rows, limits, lost, turned, move_in_words(scene))


def _only(scene: Scene, posture: str) -> Scene:
    """Return the scene with no posture but this one; UsageError if there is no such posture."""
    return scene.model_copy(update={"postures": {posture: section_angles(scene, posture)}})


def _stuck(rows: Sequence[CaseResult], case: Case) -> bool:
    """Return True if a case did not start for want of an equilibrium."""
    return any(row.case is case and NO_EQUILIBRIUM in row.cells["default"].facts.status for row in rows)


def write_files(
    out: Path,
    rows: list[CaseResult],
    long_rows: list[CaseResult],
    limits: dict[str, Limit],
    lost: list[Loss],
    turned: TurnUp,
    move: str,
) -> list[Path]:
    """Write all files from what was found; `long_rows` are holds of a day, `move` tells of the scene's motion."""
    names = ("stability.json", "stability.md", "stability.png", "stability_roundoff.png")
    numbers, report, matrix, roundoff = (out / name for name in names)
    write_atomic(report, text(rows, long_rows, limits, lost, turned, move))
    write_json(numbers, _as_json(rows + long_rows, limits, lost, turned))
    lines = [MatrixRow(row.case.group, row.case.name, [mark(cell) for cell in row.cells.values()]) for row in rows]
    matrix_picture(matrix, "Where each method holds", list(rows[0].cells), lines)
    chain = [loss for loss in lost if loss.group == "sections"]
    shown = {"Riccati": "riccati", "plain product": "plain", "LU of the whole system": "dense"}
    roundoff_picture(
        roundoff, "Round-off", turned.steps, turned.errors, TARGET,
        np.array([loss.value for loss in chain]),
        {name: np.array([digits(getattr(loss.step, key)) for loss in chain]) for name, key in shown.items()},
    )  # fmt: skip
    return [numbers, report, matrix, roundoff]


def _as_json(rows: list[CaseResult], limits: dict[str, Limit], lost: list[Loss], turned: TurnUp) -> dict[str, Any]:
    """Everything that was found."""
    return {
        "machine": machine(),
        "methods": {name: dataclasses.asdict(method) for name, method in METHODS.items()},
        "bounds": {name: {"degrades": low, "fails": high} for name, (low, high, _) in BOUNDS.items()},
        "cases": [_case(row) for row in rows],
        "silent": [
            {"group": row.case.group, "name": row.case.name, "method": method}
            for row in rows
            for method, cell in row.cells.items()
            if cell.verdict.silent
        ],
        "limits": {name: dataclasses.asdict(limit) for name, limit in limits.items()},
        "roundoff": [dataclasses.asdict(loss) for loss in lost],
        "turn_up": dataclasses.asdict(turned) | {"floor": turned.floor, "above_target": turned.turned_up_above_target},
    }


def _case(row: CaseResult) -> dict[str, Any]:
    case = row.case
    return {
        "group": case.group,
        "name": case.name,
        "varied": case.varied,
        "right": row.reference,
        "methods": {
            name: dataclasses.asdict(cell.verdict) | dataclasses.asdict(cell.facts) for name, cell in row.cells.items()
        },
    }
