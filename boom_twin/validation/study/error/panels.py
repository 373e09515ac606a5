"""Panels of the error study's pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ....plots.study import Curve, Panel
from ....plots.style import TONES
from ....scene.schema import Scene
from .cases import PAPERS, Case, Own, Peer, Stiff
from .default_choice import find
from .pareto_tables import Measure, acceleration, front, of, tip
from .problem import Problem
from .runner import Row

PAPERS_NAME = "as in the papers"


def main_panels(problem: Problem, rows: Sequence[Row]) -> tuple[Panel, Panel]:
    """Tip and acceleration, all programs; of Exudyn's ways to solve a step, the front for each way to make the boom."""
    apart = problem.apart or (None, None)
    percent: Measure = lambda row: 100.0 * acceleration(row)  # noqa: E731
    return (
        _panel("Tip", "error of the tip, mm rms", rows, tip, apart[0]),
        _panel(
            "Tip acceleration", "error of the tip's acceleration, % of its rms", rows, percent,
            None if apart[1] is None else 100.0 * apart[1],
        ),
    )  # fmt: skip


def _panel(title: str, label: str, rows: Sequence[Row], error: Measure, floor: float | None) -> Panel:
    default = find(rows, Own())
    chosen = None if default is None or not default.good else (default.seconds, error(default))
    curves = [_curve(group, error) for group in _groups(rows, error)]
    return Panel(title, label, tuple(curves), tuple((r.seconds, error(r)) for r in front(rows, error)), chosen, floor)


def _groups(rows: Sequence[Row], error: Measure) -> list[list[Row]]:
    """Rows of one curve each."""
    own = list(_by_label(of(rows, Own)).values())
    stiff = [group for label, group in _by_label(of(rows, Stiff)).items() if "Radau" in label]
    return [*own, *_exudyn(of(rows, Peer), error), *stiff]


def _by_label(rows: Sequence[Row]) -> dict[str, list[Row]]:
    groups: dict[str, list[Row]] = {}
    for row in rows:
        if row.good:
            groups.setdefault(row.case.label, []).append(row)
    return groups


def _exudyn(rows: Sequence[Row], error: Measure) -> list[list[Row]]:
    """One curve per way to make the boom: the front of all ways to solve its steps."""
    models = dict.fromkeys(row.case.model for row in rows if isinstance(row.case, Peer))
    groups = [[row for row in rows if isinstance(row.case, Peer) and row.case.model == model] for model in models]
    return [curve for curve in (front(group, error) for group in groups) if curve]


def _curve(rows: list[Row], error: Measure) -> Curve:
    case = rows[0].case
    seconds, errors = tuple(row.seconds for row in rows), tuple(error(row) for row in rows)
    return Curve(case.label, _family(case), seconds, errors, _notes(rows))


def _family(case: Case) -> str:
    if isinstance(case, Own):
        return "default" if case.label == Own().label else "own"
    return "exudyn" if isinstance(case, Peer) else "scipy"


def _notes(rows: list[Row]) -> tuple[str, ...]:
    """Steps along the default's curve; elements or segments at the slow end of a peer's."""
    case = rows[0].case
    if _family(case) == "default":
        return tuple(f"{1e3 * row.case.step:g} ms" if isinstance(row.case, Own) else "" for row in rows)
    if isinstance(case, Own):
        return ()
    text = f"{case.elements}{' l' if case.lumped else ''}" if isinstance(case, Peer) else f"{4 * case.fineness}"
    slowest = max(range(len(rows)), key=lambda i: rows[i].seconds)
    return tuple(text if i == slowest else "" for i in range(len(rows)))


def method_panels(scene: Scene, rows: Sequence[Row]) -> tuple[Panel, ...]:
    """Own methods by what they vary, against the own reference."""
    groups = {"Integrators": _varies_integrator, "Shapes a part": _varies_shapes, "Passes, product, beams": _varies_rest}
    default = find(rows, Own())
    chosen = None if default is None else (default.seconds, default.own_mm)
    label = "error of the tip against the own reference, mm rms"
    return tuple(Panel(title, label, _method_curves(scene, rows, choose), (), chosen) for title, choose in groups.items())


def _method_curves(scene: Scene, rows: Sequence[Row], choose: Callable[[Own], bool]) -> tuple[Curve, ...]:
    default, curves, shapes = Own().label, list[Curve](), choose is _varies_shapes
    listed = [r for r in of(rows, Own) if isinstance(r.case, Own) and (choose(r.case) or r.case.label == default)]
    for number, (label, group) in enumerate(_by_label(listed).items()):
        case = group[0].case
        assert isinstance(case, Own)
        tone, dashed = number % len(TONES), number >= len(TONES)
        if shapes:
            tone, dashed = (case.modes or scene.modes) - 1, case.basis == "cantilever"
            label = f"{case.modes or scene.modes}, {'cantilever' if dashed else 'end shapes'}"
        text = PAPERS_NAME if case == replace(PAPERS, step=case.step) else label.removeprefix(f"{default}, ")
        seconds, errors = tuple(r.seconds for r in group), tuple(r.own_mm for r in group)
        curves.append(Curve(text, _family(case), seconds, errors, (), tone % len(TONES), dashed))
    return tuple(sorted(curves, key=lambda curve: (curve.dashed, curve.tone)) if shapes else curves)


def _varies_integrator(case: Own) -> bool:
    return case == Own(case.step, case.method) and case.method.passes > 1 and case.method.product == "riccati"


def _varies_shapes(case: Own) -> bool:
    return case.modes is not None and case == Own(case.step, modes=case.modes, basis=case.basis)


def _varies_rest(case: Own) -> bool:
    lean = case.method.passes == 1 or case.method.product == "plain"
    return lean or not (case.axial and case.geometric)
