"""``boom_twin study stability``: where each method holds, degrades or fails, and with which symptom."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..io.atomic import write_atomic
from ..scene.kinematics import posture_angles
from ..scene.parts import Scene
from ..view.stability_matrix import Line, matrix_picture
from ..view.stability_roundoff import roundoff_picture
from .report import machine, write_json
from .stability_case import Case
from .stability_cases import cases, days
from .stability_limit import Limit, limit_of
from .stability_motions import move_in_words
from .stability_report import mark, text
from .stability_roundoff import Loss, losses
from .stability_run import METHODS, Row, run
from .stability_step import digits
from .stability_turnup import TARGET, TURN_UP_STEPS, TurnUp, turn_up
from .stability_verdict import BOUNDS

QUICK_STEPS = tuple(step for step in TURN_UP_STEPS if step >= 1e-5)
NO_EQUILIBRIUM = "no equilibrium"


def _progress(line: str) -> None:
    print(line, file=sys.stderr)


def write(
    scene: Scene, out: Path, quick: bool = False, posture: str | None = None, soak: bool = False,
    tell: Callable[[str], None] = _progress,
) -> list[Path]:  # fmt: skip
    """Run the study; write stability.json, stability.md, stability.png and stability_roundoff.png into `out`.

    Parameters
    ----------
    quick : bool
        A subset of the cases, and no steps below 1e-5 s.
    posture : str, optional
        Where motions of the scene start.
    soak : bool
        The holds of 24 simulated hours as well, by the default method.
    tell : callable
        Hears a line about each case.

    Returns
    -------
    list of Path
        What was written.
    """
    out.mkdir(parents=True, exist_ok=True)
    scene = scene if posture is None else _only(scene, posture)
    chosen = [case for case in cases(scene) if case.quick or not quick]
    rows = run(chosen, METHODS, tell)
    long_rows = run(days(scene) if soak else (), {"default": METHODS["default"]}, tell)
    limits = {f"{case.group}: {case.name}": limit_of(case.make()) for case in chosen if _stuck(rows, case)}
    tell("round-off in one step")
    lost = losses(scene, quick)
    tell("error over the step")
    turned = turn_up(scene, QUICK_STEPS if quick else TURN_UP_STEPS)
    return write_files(out, rows, long_rows, limits, lost, turned, move_in_words(scene))


def _only(scene: Scene, posture: str) -> Scene:
    """With no posture but this one; UsageError if it is not there."""
    posture_angles(scene, posture)
    return scene.model_copy(update={"postures": {posture: scene.postures[posture]}})


def _stuck(rows: Sequence[Row], case: Case) -> bool:
    """Whether a case did not start for want of an equilibrium."""
    return any(row.case is case and NO_EQUILIBRIUM in row.cells["default"].facts.status for row in rows)


def write_files(
    out: Path, rows: list[Row], long_rows: list[Row], limits: dict[str, Limit], lost: list[Loss], turned: TurnUp, move: str
) -> list[Path]:
    """Write all files from what was found; `long_rows` are holds of a day, `move` tells of the scene's motion."""
    names = ("stability.json", "stability.md", "stability.png", "stability_roundoff.png")
    numbers, report, matrix, roundoff = (out / name for name in names)
    write_atomic(report, text(rows, long_rows, limits, lost, turned, move))
    write_json(numbers, _as_json(rows + long_rows, limits, lost, turned))
    lines = [Line(row.case.group, row.case.name, [mark(cell) for cell in row.cells.values()]) for row in rows]
    matrix_picture(matrix, "Where each method holds", list(rows[0].cells), lines)
    chain = [loss for loss in lost if loss.group == "sections"]
    shown = {"Riccati": "riccati", "plain product": "plain", "LU of the whole system": "dense"}
    roundoff_picture(
        roundoff, "Round-off", turned.steps, turned.errors, TARGET,
        np.array([loss.value for loss in chain]),
        {name: np.array([digits(getattr(loss.step, key)) for loss in chain]) for name, key in shown.items()},
    )  # fmt: skip
    return [numbers, report, matrix, roundoff]


def _as_json(rows: list[Row], limits: dict[str, Limit], lost: list[Loss], turned: TurnUp) -> dict[str, Any]:
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


def _case(row: Row) -> dict[str, Any]:
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
