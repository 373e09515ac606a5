"""Error against run time: `boom_twin study error`."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tqdm import tqdm

from ..scene.parts import Scene
from ..view.work_precision import methods_picture, work_precision_picture
from .error_cases import Case, Own, Peer, Stiff, own_cases, peer_cases, stiff_cases
from .error_choice import paragraph
from .error_front import acceleration, front, matches, of, tip
from .error_panels import main_panels, method_panels
from .error_problem import Problem, pose
from .error_run import ROUNDS, Row, Runner, in_turn
from .error_text import (
    cheapest_table,
    equal_error_table,
    failures_table,
    feeding_share,
    front_table,
    matrices,
    order_table,
)
from .exudyn import build
from .motion import DURATION, motion_of
from .report import machine, provenance, write_json

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
    duel = _duel(problem, QUICK_TURNS if quick else TURNS)
    paths = [out / name for name in ("error.json", "error.md", "error.png", "error_methods.png")]
    write_json(paths[0], _content(problem, rows, duel))
    paths[1].write_text(_report(problem, rows, duel), encoding="utf-8")
    work_precision_picture(paths[2], "Error against run time", NOTE, main_panels(problem, rows))
    methods_picture(paths[3], "Methods of boom_twin: error against run time", NOTE, method_panels(rows))
    return paths


def _rows(problem: Problem, quick: bool) -> list[Row]:
    cases: list[Case] = [*own_cases(quick), *(peer_cases(quick) if problem.exudyn else ()), *stiff_cases(quick)]
    rounds = 1 if quick else ROUNDS
    with tqdm(total=rounds * len(cases), desc="study error", file=sys.stderr, unit="case") as bar:
        return Runner(problem).rows(cases, rounds, bar.update)


def _duel(problem: Problem, turns: int) -> dict[str, Any] | None:
    """The default against Exudyn with few elements at the same step, in turn."""
    if problem.exudyn is None:
        return None
    own, peer = in_turn(problem, Own(SAME_STEP), Peer(SAME_STEP, SAME_ELEMENTS, True, 1e-6), turns)
    middle = [sorted(values)[len(values) // 2] for values in (own, peer)]
    return {
        "step_s": SAME_STEP, "elements": SAME_ELEMENTS, "boom_twin_s": own, "exudyn_s": peer,
        "ratio_of_medians": middle[1] / middle[0], "ratio_of_minima": min(peer) / min(own),
    }  # fmt: skip


def _content(problem: Problem, rows: list[Row], duel: dict[str, Any] | None) -> dict[str, Any]:
    fronts = {"tip": {id(row) for row in front(rows, tip)}, "acceleration": {id(row) for row in front(rows, acceleration)}}
    return {
        "machine": machine(),
        "motion": problem.motion.label,
        "references": {
            reference.what: {"tip_mm": reference.tip_mm, "acceleration": reference.acceleration}
            for reference in (problem.own, problem.exudyn)
            if reference is not None
        },
        "references_differ": _apart(problem),
        "exudyn_missing": problem.missing or None,
        "same_step": duel,
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


def _apart(problem: Problem) -> dict[str, float] | None:
    if problem.exudyn is None:
        return None
    return dict(zip(("tip_mm", "acceleration"), problem.own.path.away(problem.exudyn.path), strict=True))


def _report(problem: Problem, rows: list[Row], duel: dict[str, Any] | None) -> str:
    parts = [
        "# Error against run time", provenance(), _setting(problem), "![Error against run time](error.png)",
        "## The default", paragraph(rows, problem.scene), order_table(rows, Own().label),
        "## At equal error of the tip", _equal(problem, rows, duel),
        "## The fastest of boom_twin at an error", cheapest_table(rows),
        "## The Pareto front", front_table(rows),
        "## All methods", "![Methods of boom_twin](error_methods.png)", "### boom_twin", matrices(rows, Own),
    ]  # fmt: skip
    for title, kind in (("Exudyn", Peer), ("SciPy", Stiff)):
        if of(rows, kind):
            parts += [f"### {title}", matrices(rows, kind)]
    if any(not row.good for row in rows):
        parts += ["## What failed", failures_table(rows)]
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def _setting(problem: Problem) -> str:
    """What was moved, what the errors are, and what the times are."""
    own, other = problem.own, problem.exudyn
    apart = _apart(problem)
    if other is None or apart is None:
        second = f"There is no independent reference: {problem.missing}"
    else:
        second = (
            f"The independent one is {other.what}; about {other.tip_mm:.2g} mm and {100 * other.acceleration:.2g} % are left "
            f"in it. Both differ by {apart['tip_mm']:.2g} mm and {100 * apart['acceleration']:.2g} %. Where one error is "
            "given, it is the larger of both, so that no program is judged by itself alone. Exudyn's rows have GA = 10 EA as "
            "the rig has; of the default boom's tip, 0.016 mm are that."
        )
    return (
        f"Motion: {problem.motion.label}. Errors are root mean squares over the motion of the tip's place, and of its "
        f"acceleration over that acceleration's own. The own reference is {own.what}; about {own.tip_mm:.2g} mm and "
        f"{100 * own.acceleration:.2g} % are left in it. {second}\n\nRun time is that of the stepping alone, compiled, without "
        "assembly and equilibrium, median of runs that lie apart, in milliseconds per simulated second; every program on one "
        "core."
    )


def _equal(problem: Problem, rows: list[Row], duel: dict[str, Any] | None) -> str:
    parts = [equal_error_table(matches(rows), "Exudyn")] if problem.exudyn else [problem.missing + "\n"]
    parts.append(equal_error_table(matches(rows, Stiff), "SciPy"))
    if duel is not None:
        own, peer = (sorted(duel[key])[len(duel[key]) // 2] for key in ("boom_twin_s", "exudyn_s"))
        share = feeding_share(rows)
        parts.append(
            f"At the same step of {1e3 * SAME_STEP:g} ms, in turn: boom_twin {1e6 * own * SAME_STEP:.3g} us a step, Exudyn "
            f"with {SAME_ELEMENTS} elements a section {1e6 * peer * SAME_STEP:.3g} us, {duel['ratio_of_medians']:.3g} times "
            f"as long (of the fastest runs: {duel['ratio_of_minima']:.3g})."
        )
        parts.append(
            f"Exudyn: build {build()}, sparse solver, one thread, generalised-alpha 0.8, all ways of Newton's method that the "
            "tables below name; its drives get their lengths from a Python function before every step, "
            + (f"which takes up to {100 * share:.2g} % of its time." if share else "whose time was not measured.")
        )
    parts.append(
        "SciPy: `solve_ivp` on finite segments with all kinematics closed, vectorised in numpy, with the Jacobian of the stiff "
        "forces; steps are its own. A boom cut into finite segments errs by the square of their length whatever the tolerance."
    )
    return "\n".join(parts)
