"""Report and pictures of the study of error against run time (`boom_twin study error`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ....analysis.methods import DURATION, motion_of
from ....offline.progress import progress_of
from ....plots.study import Curve, Panel, work_precision_picture
from ....plots.style import BLUE, ORANGE, SKY, TONES
from ....scene.schema import Scene
from ....system.atomic_files import write_atomic
from ..report import page, table, write_json
from .cases import PAPERS, Case, Own, Peer, own_cases, peer_cases
from .problem import Problem, build, pose
from .runner import EQUAL, ROUNDS, Measure, Row, Runner, acceleration, fastest, front, of, order, same_step, tip

NOTE = "surrogate parameters; computed, not measured on a rig"
OWN: dict[str, Any] = {"color": SKY, "linewidth": 0, "marker": ".", "markersize": 6}
DEFAULT: dict[str, Any] = {"color": BLUE, "linewidth": 2.4, "marker": "o", "zorder": 5}
EXUDYN: dict[str, Any] = {"color": ORANGE, "linewidth": 1.6, "marker": "s"}


def programs_picture(path: Path, problem: Problem, rows: Sequence[Row]) -> None:
    """Write errors of the tip and of its acceleration over run time; of each model of Exudyn, the front of its ways to step."""
    apart = problem.apart or (None, None)
    percent = None if apart[1] is None else 100.0 * apart[1]
    panels = (
        _programs("Tip", "error of the tip, mm rms", rows, tip, apart[0]),
        _programs(
            "Tip acceleration",
            "error of the tip's acceleration, % of its rms",
            rows,
            lambda row: 100.0 * acceleration(row),
            percent,
        ),
    )
    work_precision_picture(path, "Error against run time", NOTE, panels, (16.0, 10.4))


def _programs(title: str, label: str, rows: Sequence[Row], error: Measure, floor: float | None) -> Panel:
    def points(chosen: Sequence[Row], name: str, look: dict[str, Any], notes: tuple[str, ...] = ()) -> Curve:
        return Curve(name, tuple(row.seconds for row in chosen), tuple(error(row) for row in chosen), look, notes)

    own = _by_label(rows)
    default = own.pop(Own().label, [])
    others = [row for group in own.values() for row in group]
    curves = [points(others, "boom_twin, all other methods", OWN)]
    steps = tuple(f"{1e3 * row.case.step:g} ms" for row in default)
    curves.append(points(default, "boom_twin, default method", DEFAULT, steps))
    models: dict[str, list[Row]] = {}
    for row in of(rows, Peer):
        if isinstance(row.case, Peer):
            models.setdefault(f"{row.case.elements}{' l' if row.case.lumped else ''}", []).append(row)
    for model, group in models.items():
        best = front(group, error)  # fastest first: its last row is the slow end, where the model is named
        notes = (*[""] * (len(best) - 1), model)
        curves.append(points(best, "Exudyn, by elements a section (l: lumped)", EXUDYN, notes))
    best_of_all = tuple((row.seconds, error(row)) for row in front(rows, error))
    return Panel(title, label, tuple(curves), best_of_all, _default(rows, error), floor)


def methods_picture(path: Path, scene: Scene, rows: Sequence[Row]) -> None:
    """Write own methods by what they vary, against the own reference."""
    groups = {"Integrators": _varies_integrator, "Shapes a part": _varies_shapes, "Passes, product, beams": _varies_rest}
    label = "error of the tip against the own reference, mm rms"
    chosen = _default(rows, lambda row: row.own_mm)
    panels = [Panel(title, label, _method_curves(scene, rows, choose), (), chosen) for title, choose in groups.items()]
    work_precision_picture(path, "Methods of boom_twin: error against run time", NOTE, panels, (19.0, 10.0))


def _method_curves(scene: Scene, rows: Sequence[Row], choose: Callable[[Own], bool]) -> tuple[Curve, ...]:
    default, curves = Own().label, list[Curve]()
    listed = [row for row in of(rows, Own) if isinstance(row.case, Own) and (choose(row.case) or row.case.label == default)]
    for number, (label, group) in enumerate(_by_label(listed).items()):
        case = group[0].case
        assert isinstance(case, Own)
        tone, dashed = number, number >= len(TONES)
        if choose is _varies_shapes:
            modes = case.modes or scene.modes
            tone, dashed = modes - 1, case.basis == "cantilever"
            label = f"{modes}, {'cantilever' if dashed else 'end shapes'}"
        text = "as in the papers" if case == replace(PAPERS, step=case.step) else label.removeprefix(f"{default}, ")
        look = _look(tone % len(TONES), dashed, case.label == default)
        curves.append(Curve(text, tuple(row.seconds for row in group), tuple(row.own_mm for row in group), look))
    return tuple(curves)


def _look(tone: int, dashed: bool, bold: bool) -> dict[str, Any]:
    colour, marker = TONES[tone]
    return {
        "color": colour, "marker": marker, "markersize": 7 if bold else 5.5, "linewidth": 2.6 if bold else 1.2,
        "linestyle": (0, (4, 2)) if dashed else "-", "markerfacecolor": "white" if dashed else colour,
        "zorder": 5 if bold else 3,
    }  # fmt: skip


def _varies_integrator(case: Own) -> bool:
    return case == Own(case.step, case.method) and case.method.passes > 1 and case.method.product == "riccati"


def _varies_shapes(case: Own) -> bool:
    return case.modes is not None and case == Own(case.step, modes=case.modes, basis=case.basis)


def _varies_rest(case: Own) -> bool:
    lean = case.method.passes == 1 or case.method.product == "plain"
    return lean or not (case.axial and case.geometric)


def _by_label(rows: Sequence[Row]) -> dict[str, list[Row]]:
    groups: dict[str, list[Row]] = {}
    for row in of(rows, Own):
        if row.good:
            groups.setdefault(row.case.label, []).append(row)
    return groups


def _default(rows: Sequence[Row], error: Measure) -> tuple[float, float] | None:
    return next(((row.seconds, error(row)) for row in rows if row.case == Own() and row.good), None)


QUICK_DURATION = 0.6  # s
TURNS, QUICK_TURNS = 5, 2  # runs of each program at the same step


def write(scene: Scene, out: Path, quick: bool = False, posture: str | None = None) -> list[Path]:
    """Run all cases on a motion of `scene` from `posture`; write error.json, error.md and pictures; return the paths."""
    problem = pose(scene, motion_of(scene, posture, QUICK_DURATION if quick else DURATION), quick)
    cases: list[Case] = [*own_cases(scene, quick), *(peer_cases(quick) if problem.exudyn else ())]
    runner, rounds = Runner(problem), 1 if quick else ROUNDS
    bar = progress_of(rounds * len(cases), "cases", "study error")
    rows = runner.rows(cases, rounds, lambda: bar.update(1))
    bar.close()
    duel = same_step(runner, rows, QUICK_TURNS if quick else TURNS)
    paths = [out / name for name in ("error.json", "error.md", "error.png", "error_methods.png")]
    write_json(paths[0], _content(problem, rows, duel))
    write_atomic(paths[1], report(problem, rows, duel))
    programs_picture(paths[2], problem, rows)
    methods_picture(paths[3], scene, rows)
    return paths


def report(problem: Problem, rows: Sequence[Row], duel: dict[str, Any] | None) -> str:
    """Return the report in Markdown."""
    parts = [
        "# Error against run time", _setting(problem), "![Error against run time](error.png)",
        "## The default by step",
        "Order: slope of the error from the row above. The scheme has order 2, until errors reach those of the references.",
        _by_step(rows),
        "## At equal error of the tip",
        "Rows: the fastest case of each program within this error. Ratio: Exudyn's time over boom_twin's.",
        _equal(problem, rows), _at_same_step(duel),
        f"## Methods at a step of {1e3 * Own().step:g} ms",
        "The first row is the default. Other rows name the difference. Other steps: picture below, `error.json`.",
        _methods(rows), "![Methods of boom_twin](error_methods.png)",
    ]  # fmt: skip
    if failed := _failed(rows):
        parts += ["## What failed", failed]
    parts += [
        "## Limits",
        "One motion of one boom. Other work may share the machine, so only ratios within this page count. Exudyn's models and "
        "schemes are the fastest of those tried. Another setting may be faster.",
    ]
    return page(parts)


def _setting(problem: Problem) -> str:
    own, other = problem.own, problem.exudyn
    second = f"There is no independent reference: {problem.missing}"
    if other is not None and problem.apart is not None:
        apart = problem.apart
        second = (
            f"The independent one is {other.what} (remaining error: {_errors(other.tip_mm, other.acceleration)}). They "
            f"differ by {_errors(*apart)}. A single error is the larger of both."
        )
    return (
        f"Motion: {problem.motion.label}. Errors are rms over the motion. The error of acceleration is relative to the "
        f"acceleration's rms. The own reference is {own.what} (remaining error: {_errors(own.tip_mm, own.acceleration)}). "
        f"{second}\n\n"
        "Run time is CPU time of compiled stepping on one core, in ms per simulated second (ms/s): the least of several runs, "
        "alternating with the other program."
    )


def _errors(tip_mm: float, relative: float) -> str:
    return f"{tip_mm:.2g} mm, {100 * relative:.2g} %"


def _by_step(rows: Sequence[Row]) -> str:
    listed = [row for row in of(rows, Own) if row.case.label == Own().label]
    head = ("step, ms", "tip, mm, own reference", "order", "tip, mm, independent", "acceleration, %", "ms/s", "passes")
    lines = [
        (f"{1e3 * row.case.step:g}", row.own_mm, slope, row.independent_mm, 100.0 * row.acceleration, _ms(row), row.passes)
        for row, slope in order(listed)
    ]
    return table(head, lines)


def _equal(problem: Problem, rows: Sequence[Row]) -> str:
    if problem.exudyn is None:
        return problem.missing
    lines = []
    for most in EQUAL:
        own, peer = fastest(of(rows, Own), most), fastest(of(rows, Peer), most)
        ratio = peer.seconds / own.seconds if own and peer else math.nan
        told = None if math.isnan(ratio) else f"{ratio:.{0 if ratio > 10.0 else 1}f}"
        lines.append((f"{most:g}", own and _name(own), own and _ms(own), peer and _name(peer), peer and _ms(peer), told))
    return table(("tip error, mm", "boom_twin", "ms/s", "Exudyn", "ms/s", "ratio"), lines)


def _at_same_step(duel: dict[str, Any] | None) -> str:
    if duel is None:
        return ""
    return (
        f"At the same step of {1e3 * duel['step_s']:g} ms, in alternating runs, the default is "
        f"{duel['ratio_of_medians']:.3g} times as fast as Exudyn's fastest case within "
        f"{duel['exudyn_error_at_most_mm']:g} mm: {duel['exudyn_method']}.\n\n"
        f"Exudyn: build {build()}, sparse solver, one thread, generalised-alpha 0.8, beams exact at their nodes. Lumped (l in "
        "the picture): masses of cylinders and two-force links act at their pins. A kept tangent is renewed in a step that "
        "needs more passes than named. Exudyn's time includes the Python function that sets the lengths of its drives."
    )


def _methods(rows: Sequence[Row]) -> str:
    """Return a table of the methods at the default step. Other mode numbers appear only if nothing else differs."""
    default = Own().label
    lines = []
    for row in of(rows, Own):
        case = row.case
        plain = isinstance(case, Own) and (case.modes in (None, PAPERS.modes) or case == Own(modes=case.modes))
        if plain and case.step == Own().step:
            numbers = (_ms(row), row.tip_mm, 100.0 * row.acceleration) if row.good else ("failed", None, None)
            lines.append((case.label.removeprefix(f"{default}, "), *numbers))
    return table(("method", "ms/s", "tip, mm", "acceleration, %"), lines)


def _failed(rows: Sequence[Row]) -> str:
    cases: dict[str, list[str]] = {}
    for row in rows:
        if not row.good:
            why = row.status if row.status != "ok" else "the numbers are not finite"
            cases.setdefault(why, []).append(_name(row))
    return "".join(f"- {why}: {'; '.join(names)}.\n" for why, names in cases.items())


def _ms(row: Row) -> float:
    return 1e3 * row.seconds


def _name(row: Row) -> str:
    return f"{row.case.label.removeprefix('Exudyn, ')}, step {1e3 * row.case.step:g} ms"


def _content(problem: Problem, rows: Sequence[Row], duel: dict[str, Any] | None) -> dict[str, Any]:
    fronts = {name: {id(row) for row in front(rows, error)} for name, error in (("tip", tip), ("acceleration", acceleration))}
    return {
        "motion": problem.motion.label,
        "references": {
            reference.what: {"tip_mm": reference.tip_mm, "acceleration": reference.acceleration}
            for reference in (problem.own, problem.exudyn)
            if reference is not None
        },
        "references_differ": problem.apart and dict(zip(("tip_mm", "acceleration"), problem.apart, strict=True)),
        "exudyn_missing": problem.missing or None,
        "same_step": duel,
        "rows": [_flat(row) | {f"on_front_{name}": id(row) in chosen for name, chosen in fronts.items()} for row in rows],
    }


def _flat(row: Row) -> dict[str, Any]:
    settings = asdict(row.case)
    settings |= settings.pop("method", {})
    numbers = {key: value for key, value in vars(row).items() if key not in ("case", "status")}
    return {
        "program": "boom_twin" if isinstance(row.case, Own) else "exudyn", "method": row.case.label, **settings, **numbers,
        "tip_mm": row.tip_mm, "acceleration": row.acceleration, "status": row.status,
    }  # fmt: skip
