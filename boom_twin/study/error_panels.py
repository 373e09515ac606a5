"""What the pictures of `study error` show."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..view.work_precision import Curve, Panel
from .error_cases import Case, Own, Peer, Stiff
from .error_choice import find
from .error_front import Measure, acceleration, fastest, front, of, tip
from .error_problem import Problem
from .error_run import Row


def main_panels(problem: Problem, rows: Sequence[Row]) -> tuple[Panel, Panel]:
    """Tip and acceleration, all programs; of Exudyn's ways to solve a step, the fastest at each number of elements."""
    apart = (None, None) if problem.exudyn is None else problem.own.path.away(problem.exudyn.path)
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
    curves = [_curve(group, error) for group in _groups(rows)]
    return Panel(title, label, tuple(curves), tuple((r.seconds, error(r)) for r in front(rows, error)), chosen, floor)


def _groups(rows: Sequence[Row]) -> list[list[Row]]:
    """Rows of one curve each."""
    own = list(_by_label(of(rows, Own)).values())
    stiff = [group for label, group in _by_label(of(rows, Stiff)).items() if "Radau" in label]
    return [*own, *_exudyn(of(rows, Peer)), *stiff]


def _by_label(rows: Sequence[Row]) -> dict[str, list[Row]]:
    groups: dict[str, list[Row]] = {}
    for row in rows:
        if row.good:
            groups.setdefault(row.case.label, []).append(row)
    return groups


def _exudyn(rows: Sequence[Row]) -> list[list[Row]]:
    """One curve per number of elements: at every step the fastest way that errs no more than a tenth above the best."""
    curves = []
    cases = [row.case for row in rows if isinstance(row.case, Peer)]
    for elements in sorted({case.elements for case in cases}):
        curve = []
        for step in sorted({case.step for case in cases}):
            here = [r for r in rows if isinstance(r.case, Peer) and (r.case.elements, r.case.step) == (elements, step)]
            best = fastest(here, 1.1 * min((r.tip_mm for r in here if r.good), default=0.0))
            curve += [best] if best is not None else []
        curves += [curve] if curve else []
    return curves


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
    text = f"{case.elements} el." if isinstance(case, Peer) else f"{4 * case.fineness} seg."
    slowest = max(range(len(rows)), key=lambda i: rows[i].seconds)
    return tuple(text if i == slowest else "" for i in range(len(rows)))


def method_panels(rows: Sequence[Row]) -> tuple[Panel, ...]:
    """Own methods by what they vary, against the own reference."""
    titles: tuple[tuple[str, Callable[[Own], bool]], ...] = (
        ("Integrators", _varies_integrator),
        ("Shapes", lambda case: case == Own(case.step, modes=case.modes, basis=case.basis) and case.modes is not None),
        ("Passes, product, what a beam has", _varies_rest),
    )
    return tuple(_method_panel(title, rows, choose) for title, choose in titles)


def _method_panel(title: str, rows: Sequence[Row], choose: Callable[[Own], bool]) -> Panel:
    default = find(rows, Own())
    listed = [r for r in of(rows, Own) if isinstance(r.case, Own) and (choose(r.case) or r.case == Own(r.case.step))]
    curves = [
        Curve(label, _family(group[0].case), tuple(r.seconds for r in group), tuple(r.own_mm for r in group))
        for label, group in _by_label(listed).items()
    ]
    chosen = None if default is None or not default.good else (default.seconds, default.own_mm)
    return Panel(title, "error of the tip against the own reference, mm rms", tuple(curves), (), chosen)


def _varies_integrator(case: Own) -> bool:
    return case == Own(case.step, case.method) and case.method.passes > 1 and case.method.product == "riccati"


def _varies_rest(case: Own) -> bool:
    lean = case.method.passes == 1 or case.method.product == "plain"
    return (lean or not (case.axial and case.geometric)) and (case.modes is None or lean)


