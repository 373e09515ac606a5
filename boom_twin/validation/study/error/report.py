"""Report of the error study: error against run time, `boom_twin study error`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ....analysis.motions import DURATION, motion_of
from ....offline.progress import progress_of
from ....plots.study import methods_picture, work_precision_picture
from ....scene.schema import Scene
from ....system.atomic_files import write_atomic
from ..report import machine, provenance, write_json
from .cases import Case, Own, Peer, Stiff, own_cases, peer_cases, stiff_cases
from .default_choice import paragraph
from .panels import main_panels, method_panels
from .pareto_tables import (
    EQUAL,
    PairedTiming,
    acceleration,
    cheapest_table,
    equal_error_table,
    failures_table,
    fastest_at_step,
    feeding_share,
    front,
    front_table,
    matches,
    matrices,
    of,
    order_table,
    tip,
)
from .problem import Problem, build, pose
from .runner import ROUNDS, Row, Runner, in_turn

EXUDYN_BOOM = (
    "sparse solver, one thread, generalised-alpha 0.8. Its beams are exact at their nodes (what an element of constant "
    "curvature lacks in bending is given back as shear; GA = 160 EA); they are cut at brackets, with rigid roots and heads on "
    "their end nodes and no joints between. A lumped boom (l in the picture) has no bodies for cylinders and two-force links: "
    "weights act at their pins by the law of the lever, barrels turn with the sections that carry them, rods are masses at "
    "their pins; of the default boom in its arch that is 0.08 mm and 0.4 %, and leaves 10 pins and rods of 29 pins and "
    "guides. A tangent is kept over the steps and made anew in the first that needs more passes with it than the tables say. "
    "No faster at equal error were: stiff springs for pins and links, dense solvers, the beams' weight at their nodes, "
    "tangents kept for more passes, looser tolerances."
)


def report(problem: Problem, rows: Sequence[Row], duel: PairedTiming | None) -> str:
    """The whole report in Markdown."""
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
    """Return a paragraph on the motion, the errors and the times."""
    own, other = problem.own, problem.exudyn
    if other is None or problem.apart is None:
        second = f"There is no independent reference: {problem.missing}"
    else:
        tip, acceleration = problem.apart
        second = (
            f"The independent one is {other.what}; about {other.tip_mm:.2g} mm and {100 * other.acceleration:.2g} % are left "
            f"in it. Both differ by {tip:.2g} mm and {100 * acceleration:.2g} %. Where one error is given, it is the larger of "
            "both, so that no program is judged by itself alone."
        )
    return (
        f"Motion: {problem.motion.label}. Errors are root mean squares over the motion of the tip's place, and of its "
        f"acceleration over that acceleration's own. The own reference is {own.what}; about {own.tip_mm:.2g} mm and "
        f"{100 * own.acceleration:.2g} % are left in it. {second}\n\nRun time is the CPU time of the stepping alone, compiled, "
        "without assembly and equilibrium, in milliseconds per simulated second; every program on one core, in turn with the "
        "others, the fastest of several runs. Other work may share the machine, so only ratios of one run count."
    )


def _equal(problem: Problem, rows: Sequence[Row], duel: PairedTiming | None) -> str:
    """Tables against the other programs, and how these were run."""
    parts = [equal_error_table(matches(rows), "Exudyn")] if problem.exudyn else [problem.missing + "\n"]
    parts.append(equal_error_table(matches(rows, Stiff), "SciPy"))
    if duel is not None:
        own, peer = (1e6 * seconds * duel.case.step for seconds in duel.medians)
        share = feeding_share(rows)
        parts.append(
            f"At the same step of {1e3 * duel.case.step:g} ms, in turn: boom_twin {own:.3g} us a step; {duel.case.label}, "
            f"{peer:.4g} us, {peer / own:.3g} times as long (of the fastest runs: {duel.ratio_of_minima:.3g}). It is Exudyn's "
            f"fastest at this step that errs at most {EQUAL[0]:g} mm."
        )
        parts.append(
            f"Exudyn: build {build()}, {EXUDYN_BOOM} The drives get their lengths from a Python function before every step, "
            + (f"which takes {100 * share:.2g} % of the time." if share else "whose time was not measured.")
        )
    parts.append(
        "SciPy: `solve_ivp` on finite segments with all kinematics closed, vectorised in numpy, with the Jacobian of the stiff "
        "forces; steps are its own. Cutting into segments errs by the square of their length whatever the tolerance"
        f"{_segments(rows)}."
    )
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def _segments(rows: Sequence[Row]) -> str:
    """Return the error of cutting into segments alone, by the rows of Radau at the least tolerance."""
    listed = [row for row in of(rows, Stiff) if isinstance(row.case, Stiff) and row.case.solver == "Radau" and row.good]
    least = min((row.case.tolerance for row in listed if isinstance(row.case, Stiff)), default=0.0)
    told = [
        f"{row.tip_mm:.2g} mm with {4 * row.case.fineness} a section"
        for row in listed
        if isinstance(row.case, Stiff) and row.case.tolerance == least
    ]
    return f": {', '.join(told)}" if told else ""


QUICK_DURATION = 0.6  # s
TURNS, QUICK_TURNS = 5, 2  # of both programs at the same step
SAME_STEP = 1e-3
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
    bar = progress_of(rounds * len(cases), "cases", "study error")
    found = Runner(problem).rows(cases, rounds, lambda: bar.update(1))
    bar.close()
    return found


def _duel(problem: Problem, rows: list[Row], turns: int) -> PairedTiming | None:
    """The default against Exudyn's fastest at the same step that is exact enough, in turn."""
    best = fastest_at_step(rows, SAME_STEP) or fastest_at_step(rows, SAME_STEP, EQUAL[-1])
    if best is None or not isinstance(best.case, Peer):
        return None
    own, peer = in_turn(problem, Own(SAME_STEP), best.case, turns)
    return PairedTiming(best.case, tuple(own), tuple(peer))


def _content(problem: Problem, rows: list[Row], duel: PairedTiming | None) -> dict[str, Any]:
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
