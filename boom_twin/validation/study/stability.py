"""Study of stability (`boom_twin study stability`): every case by every method, measured deviations, the report."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...analysis.equilibrium import rest_at
from ...analysis.methods import Method, MethodRun
from ...errors import SolverError
from ...scene.kinematics import joint_angles_of_strokes, section_angles
from ...scene.schema import Scene
from ...system.files import write_atomic
from ...types import Array
from .report import page, table, write_json
from .stability_cases import BOUNDS, METHODS, Case, Facts, Setup, cases, move_in_words

Mask = NDArray[np.bool_]
IMPULSE = 0.05  # s after a speed jump in which accelerations and forces are not compared
TINY = 1e-12  # m/s^2 or N, least divisor


def against_motion(found: MethodRun, right: MethodRun, still: float, jump: float = math.nan) -> Facts:
    """Return the deviations from the reference motion `right` at the same rows; the drives hold from `still` (s) on.

    Accelerations and forces are not compared just after a speed jump at time `jump` (s), because they are impulses there.
    """
    smooth = ~(np.abs(right.times - jump - 0.5 * IMPULSE) <= 0.5 * IMPULSE + 1e-9)
    acceleration, force = right.tip_acceleration[smooth], right.cylinder_forces[smooth]
    ringing = _rings(found, right, (right.times > still) & smooth)
    return Facts(
        found.status,
        doubt=found.doubt,
        error=_largest(found.tip - right.tip) / _path(right),
        acceleration=_rms(found.tip_acceleration[smooth] - acceleration) / max(_rms(acceleration), TINY),
        force=_rms(found.cylinder_forces[smooth] - force) / max(_largest(force), TINY),
        ringing=ringing[0],
        force_ringing=ringing[1],
        growth=growth(found, still) / max(growth(right, still), 1e-3),
        lasting=_lasting(found, right, jump, _largest(force)),
        passes=found.passes,
    )


def _lasting(found: MethodRun, right: MethodRun, jump: float, largest: float) -> float:
    """Return the rows from a speed jump to the last cylinder force wrong by 5 % of the largest; NaN without a jump."""
    if math.isnan(jump):
        return math.nan
    wrong = np.linalg.norm(found.cylinder_forces - right.cylinder_forces, axis=1) > 0.05 * largest
    late = right.times[wrong & (right.times >= jump - 1e-9)]
    return float((late.max() - jump) / right.times[1]) if late.size else 0.0


def against_rest(found: MethodRun, equilibrium: Array | None, still: float) -> Facts:
    """Return the deviations at the end of a long hold from the tip's `equilibrium` (m), shape (2,).

    If that is None, drift is the shift of the mean over the hold.
    """
    late = np.flatnonzero(found.times > still)
    first, last = late[: len(late) // 4], late[-(len(late) // 4) :]
    away = found.tip[-1] - equilibrium if equilibrium is not None else found.tip[last].mean(0) - found.tip[first].mean(0)
    ringing = _rings(found, None, found.times > still)
    return Facts(
        found.status,
        doubt=found.doubt,
        drift=float(np.linalg.norm(away)) / _path(found),
        ringing=ringing[0],
        force_ringing=ringing[1],
        growth=growth(found, still),
        passes=found.passes,
    )


def growth(motion: MethodRun, still: float) -> float:
    """Return the ratio of tip acceleration vibration in the last quarter of the hold to the first.

    It is 1 for a boom that is still: below a thousandth of the largest acceleration.
    """
    late = np.flatnonzero(motion.times > still)
    quarter = max(len(late) // 4, 1)
    first, last = (motion.tip_acceleration[rows] for rows in (late[:quarter], late[-quarter:]))
    before, after = (_rms(values - values.mean(0)) for values in (first, last))
    if after <= 1e-3 * _largest(motion.tip_acceleration):
        return 1.0
    return after / before if before > 0.0 else math.inf


def alternating(values: Array) -> Array:
    """Return the row-to-row alternating part of `values` (m, c), shape (m - 2, c); nearly zero for a smooth curve."""
    return np.asarray(0.25 * (2.0 * values[1:-1] - values[2:] - values[:-2]))


def _rings(found: MethodRun, right: MethodRun | None, late: Mask) -> tuple[float, float]:
    """Return the ringing of tip acceleration and cylinder forces in rows `late`, after subtraction of the reference."""

    def ring(own: Array, other: Array | None) -> float:
        more = own if other is None else own - other
        return _rms(alternating(more[late])) / max(_largest(own if other is None else other), TINY)

    return (
        ring(found.tip_acceleration, None if right is None else right.tip_acceleration),
        ring(found.cylinder_forces, None if right is None else right.cylinder_forces),
    )


def _rms(values: Array) -> float:
    """Return the rms norm of the rows (m, c); infinite if any value is not finite, 0 without rows."""
    if not values.size:
        return 0.0
    return float(np.sqrt(np.mean(np.sum(values**2, axis=-1)))) if np.isfinite(values).all() else math.inf


def _path(motion: MethodRun) -> float:
    """Return the largest distance of the tip from its start, m."""
    return max(_largest(motion.tip - motion.tip[0]), 1e-9)


def _largest(values: Array) -> float:
    """Return the largest norm of the rows; infinite if any value is not finite."""
    sizes = np.linalg.norm(values, axis=-1)
    return float(sizes.max()) if np.isfinite(sizes).all() else math.inf


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
            return judge(setup.march(setup.step, 1, method))
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
        right = setup.march(step, every, Method(tolerance=1e-10))
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
