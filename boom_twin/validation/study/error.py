"""Study of error against run time (`boom_twin study error`): runs of all cases, their report and its picture."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import asdict
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import Any

from ...analysis.methods import DURATION, motion_of
from ...offline.progress import ProgressLine
from ...plots.analysis import Curve, Panel, error_picture
from ...scene.schema import Scene
from ...system.files import write_atomic
from .error_runs import PAPERS, Case, Own, Peer, Problem, Row, Runner, build, own_cases, peer_cases, pose
from .report import page, table, write_json

EQUAL = (0.3, 1.0, 3.0, 10.0)  # mm
Measure = Callable[[Row], float]
TIP: Measure = attrgetter("tip_mm")
ACCELERATION: Measure = attrgetter("acceleration")


def of(rows: Sequence[Row], kind: type) -> list[Row]:
    """Return the rows of one program: `Own` or `Peer`."""
    return [row for row in rows if isinstance(row.case, kind)]


def front(rows: Sequence[Row], error: Measure = TIP) -> list[Row]:
    """Return the Pareto front, fastest first: no row is both faster and less wrong than one of these."""
    found: list[Row] = []
    for row in sorted((row for row in rows if row.good), key=lambda row: (row.seconds, error(row))):
        if not found or error(row) < error(found[-1]):
            found.append(row)
    return found


def fastest(rows: Sequence[Row], most: float) -> Row | None:
    """Return the fastest row whose tip is wrong by at most `most` (mm)."""
    return min((row for row in rows if row.good and row.tip_mm <= most), key=lambda row: row.seconds, default=None)


def order(rows: Sequence[Row]) -> list[tuple[Row, float | None]]:
    """Return rows of one method by falling step, each with the order of its own tip error from the step before."""
    found: list[tuple[Row, float | None]] = []
    for row in sorted(rows, key=lambda row: -row.case.step):
        last = found[-1][0] if found else None
        slope = None
        if last is not None and last.good and row.good:
            slope = math.log(last.own_mm / row.own_mm) / math.log(last.case.step / row.case.step)
        found.append((row, slope))
    return found


def same_step(runner: Runner, rows: Sequence[Row], turns: int) -> dict[str, Any] | None:
    """Run the default and Exudyn's fastest at its step that is exact enough in turn; None if none of its cases is.

    Both meet the same machine so. Times are CPU seconds per simulated second of every run.
    """
    own = Own()
    peers = [row for row in of(rows, Peer) if row.case.step == own.step]
    most, best = next(((most, row) for most in EQUAL if (row := fastest(peers, most)) is not None), (EQUAL[-1], None))
    if best is None or not isinstance(best.case, Peer):
        return None
    ours, theirs = zip(*((runner.row(own).seconds, runner.row(best.case).seconds) for _ in range(turns)), strict=True)
    return {
        "step_s": own.step, "elements": best.case.elements, "exudyn_method": best.case.label, "exudyn_error_at_most_mm": most,
        "boom_twin_s": ours, "exudyn_s": theirs,
        "ratio_of_medians": statistics.median(theirs) / statistics.median(ours),
        "ratio_of_minima": min(theirs) / min(ours),
    }  # fmt: skip


def _draw(path: Path, problem: Problem, rows: Sequence[Row]) -> None:
    """Write errors of the tip and of its acceleration over run time; of each model of Exudyn, the front of its ways to step."""
    tip, acceleration = problem.apart
    label = "error of the tip's acceleration, % of its rms"
    panels = (
        _panel("Tip", "error of the tip, mm rms", rows, TIP, tip),
        _panel("Tip acceleration", label, rows, lambda row: 100.0 * row.acceleration, 100.0 * acceleration),
    )
    error_picture(path, "surrogate parameters; computed, not measured on a rig", panels)


def _panel(title: str, label: str, rows: Sequence[Row], error: Measure, floor: float) -> Panel:
    def points(chosen: Sequence[Row], kind: str, notes: Sequence[str] = ()) -> Curve:
        return Curve(kind, [row.seconds for row in chosen], [error(row) for row in chosen], notes)

    own = [row for row in of(rows, Own) if row.good]
    default = [row for row in own if row.case.label == Own().label]
    curves = [
        points([row for row in own if row not in default], "other methods"),
        points(default, "default method", [f"{1e3 * row.case.step:g} ms" for row in default]),
    ]
    peers = [(row, row.case) for row in rows if isinstance(row.case, Peer)]
    for (elements, lumped), group in groupby(peers, lambda pair: (pair[1].elements, pair[1].lumped)):
        best = front([row for row, _ in group], error)  # its last row is the slow end, where the model is named
        curves.append(points(best, "Exudyn", [*[""] * (len(best) - 1), f"{elements}{' l' * lumped}"]))
    chosen = next(((row.seconds, error(row)) for row in default if row.case == Own()), None)
    return Panel(title, label, curves, points(front(rows, error), "Pareto front"), chosen, floor)


def write(scene: Scene, out: Path, quick: bool = False, posture: str | None = None) -> list[Path]:
    """Run all cases on a motion of `scene` from `posture`; write error.json, error.md and error.png; return the paths."""
    problem = pose(scene, motion_of(scene, posture, 0.6 if quick else DURATION), quick)
    cases: list[Case] = [*own_cases(scene, quick), *peer_cases(quick)]
    runner, rounds = Runner(problem), 1 if quick else 5  # a case runs in every round; its time is that of the fastest run
    bar = ProgressLine(rounds * len(cases), "cases", "study error")
    rows = runner.rows(cases, rounds, lambda: bar.update(1))
    bar.close()
    duel = same_step(runner, rows, 2 if quick else 5)
    paths = [out / f"error.{kind}" for kind in ("json", "md", "png")]
    write_json(paths[0], _content(problem, rows, duel))
    write_atomic(paths[1], report(problem, rows, duel))
    _draw(paths[2], problem, rows)
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
        _equal(rows), _at_same_step(duel),
        f"## Methods at a step of {1e3 * Own().step:g} ms",
        "The first row is the default. Other rows name the difference. Other steps: `error.json`.",
        _methods(rows),
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
    return (
        f"Motion: {problem.motion.label}. Errors are rms over the motion. The error of acceleration is relative to the "
        f"acceleration's rms. The own reference is {own.what} (remaining error: {_errors(own.tip_mm, own.acceleration)}). "
        f"The independent one is {other.what} (remaining error: {_errors(other.tip_mm, other.acceleration)}). They "
        f"differ by {_errors(*problem.apart)}. A single error is the larger of both.\n\n"
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


def _equal(rows: Sequence[Row]) -> str:
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
    fronts = {name: {id(row) for row in front(rows, error)} for name, error in (("tip", TIP), ("acceleration", ACCELERATION))}
    return {
        "motion": problem.motion.label,
        "references": {
            reference.what: {"tip_mm": reference.tip_mm, "acceleration": reference.acceleration}
            for reference in (problem.own, problem.exudyn)
        },
        "references_differ": dict(zip(("tip_mm", "acceleration"), problem.apart, strict=True)),
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
