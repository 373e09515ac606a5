"""Error against run time: `boom_twin study error`."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tqdm import tqdm

from ..io.atomic import write_atomic
from ..scene.parts import Scene
from ..view.work_precision import methods_picture, work_precision_picture
from .error_cases import Case, Own, Peer, Stiff, own_cases, peer_cases, stiff_cases
from .error_front import Duel, acceleration, best_way, front, tip
from .error_panels import main_panels, method_panels
from .error_problem import Problem, pose
from .error_report import report
from .error_run import ROUNDS, Row, Runner, in_turn
from .motion import DURATION, motion_of
from .report import machine, write_json

QUICK_DURATION = 0.6  # s
TURNS, QUICK_TURNS = 5, 2  # of both programs at the same step
SAME_STEP, SAME_ELEMENTS = 1e-3, 4
NOTE = "surrogate parameters; computed, not measured on a rig"


def write(scene: Scene, out: Path, quick: bool = False, posture: str | None = None) -> list[Path]:
    """Run all cases on a motion of `scene`, write ``error.json``, ``error.md`` and pictures into `out`; returns their paths.

    Parameters
    ----------
    quick : bool
        Few cases on a short motion.
    posture : str, optional
        Where the motion starts, see `motion_of`.
    """
    out.mkdir(parents=True, exist_ok=True)
    problem = pose(scene, motion_of(scene, posture, QUICK_DURATION if quick else DURATION), quick)
    rows = _rows(problem, quick)
    duel = _duel(problem, rows, QUICK_TURNS if quick else TURNS)
    paths = [out / name for name in ("error.json", "error.md", "error.png", "error_methods.png")]
    write_json(paths[0], _content(problem, rows, duel))
    write_atomic(paths[1], report(problem, rows, duel))
    work_precision_picture(paths[2], "Error against run time", NOTE, main_panels(problem, rows))
    methods_picture(paths[3], "Methods of boom_twin: error against run time", NOTE, method_panels(scene, rows))
    return paths


def _rows(problem: Problem, quick: bool) -> list[Row]:
    cases: list[Case] = [*own_cases(problem.scene, quick), *(peer_cases(quick) if problem.exudyn else ()), *stiff_cases(quick)]
    rounds = 1 if quick else ROUNDS
    with tqdm(total=rounds * len(cases), desc="study error", file=sys.stderr, unit="case") as bar:
        return Runner(problem).rows(cases, rounds, bar.update)


def _duel(problem: Problem, rows: list[Row], turns: int) -> Duel | None:
    """The default against Exudyn's best way with few elements at the same step, in turn."""
    best = best_way(rows, SAME_ELEMENTS, SAME_STEP)
    if best is None or not isinstance(best.case, Peer):
        return None
    own, peer = in_turn(problem, Own(SAME_STEP), best.case, turns)
    return Duel(best.case, tuple(own), tuple(peer))


def _content(problem: Problem, rows: list[Row], duel: Duel | None) -> dict[str, Any]:
    fronts = {"tip": {id(row) for row in front(rows, tip)}, "acceleration": {id(row) for row in front(rows, acceleration)}}
    return {
        "machine": machine(),
        "motion": problem.motion.label,
        "references": {
            reference.what: {"tip_mm": reference.tip_mm, "acceleration": reference.acceleration}
            for reference in (problem.own, problem.exudyn)
            if reference is not None
        },
        "references_differ": problem.apart and dict(zip(("tip_mm", "acceleration"), problem.apart, strict=True)),
        "exudyn_missing": problem.missing or None,
        "same_step": None if duel is None else duel.told,
        "rows": [_flat(row) | {f"on_front_{name}": id(row) in chosen for name, chosen in fronts.items()} for row in rows],
    }


def _flat(row: Row) -> dict[str, Any]:
    """A row as one flat object; settings first."""
    program = {Own: "boom_twin", Peer: "exudyn", Stiff: "scipy"}[type(row.case)]
    settings = asdict(row.case)
    settings |= settings.pop("method", {})
    numbers = {key: value for key, value in vars(row).items() if key not in ("case", "status")}
    both = {"tip_mm": row.tip_mm, "acceleration": row.acceleration}
    return {"program": program, "method": row.case.label} | settings | numbers | both | {"status": row.status}
