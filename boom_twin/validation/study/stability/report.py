"""The stability study as text: matrix, symptoms, round-off."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from .report import provenance, table
from .stability_limit import Limit
from .stability_roundoff import Loss
from .stability_run import Cell, Row
from .stability_step import digits
from .stability_turnup import TARGET, TurnUp
from .stability_verdict import BOUNDS

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
    rows: Sequence[Row], long_rows: Sequence[Row], limits: dict[str, Limit], losses: Sequence[Loss], turned: TurnUp,
    move: str,
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


def _matrix(rows: Sequence[Row]) -> str:
    methods = list(rows[0].cells)
    lines: list[list[object]] = [[_title(row), *(SYMBOLS[mark(cell)] for cell in row.cells.values())] for row in rows]
    counted: list[list[object]] = [
        [f"**{word}**", *(sum(mark(row.cells[method]) == key for row in rows) for method in methods)]
        for key, word in SYMBOLS.items()
    ]
    return table(["case", *methods], lines + counted)


def _title(row: Row) -> str:
    return f"{row.case.group}: {row.case.name}"


def _bounds() -> str:
    lines = [[symptom.format(".."), low, "-" if math.isinf(high) else high] for low, high, symptom in BOUNDS.values()]
    return table(["symptom", "degrades above", "fails above"], lines)


def _silent(rows: Sequence[Row]) -> str:
    found: dict[str, list[str]] = {}
    for row in rows:
        for method, cell in row.cells.items():
            if cell.verdict.silent:
                found.setdefault(method, []).append(_title(row))
    lines = [f"- {method}: {'; '.join(cases)}.\n" for method, cases in found.items()]
    default = "" if "default" in found else "- default: none.\n"
    return default + "".join(lines) if found else "None: no method, in no case.\n"


def _symptoms(rows: Sequence[Row]) -> Iterator[str]:
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


def _long(rows: Sequence[Row]) -> str:
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
