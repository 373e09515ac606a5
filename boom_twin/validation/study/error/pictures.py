"""Pictures of the error study: all programs, and own methods among themselves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ....plots.study import Curve, Panel, work_precision_picture
from ....plots.style import BLUE, ORANGE, SKY, TONES
from ....scene.schema import Scene
from .cases import PAPERS, Own, Peer
from .problem import Problem
from .runner import Measure, Row, acceleration, front, of, tip

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
    panels = [Panel(title, label, _methods(scene, rows, choose), (), chosen) for title, choose in groups.items()]
    work_precision_picture(path, "Methods of boom_twin: error against run time", NOTE, panels, (19.0, 10.0))


def _methods(scene: Scene, rows: Sequence[Row], choose: Callable[[Own], bool]) -> tuple[Curve, ...]:
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
    """Return own rows that went through, by method."""
    groups: dict[str, list[Row]] = {}
    for row in of(rows, Own):
        if row.good:
            groups.setdefault(row.case.label, []).append(row)
    return groups


def _default(rows: Sequence[Row], error: Measure) -> tuple[float, float] | None:
    return next(((row.seconds, error(row)) for row in rows if row.case == Own() and row.good), None)
