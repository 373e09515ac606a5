"""Default choice explained: sentences made from the rows of the error study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ....scene.schema import Scene
from .cases import DEFAULT_STEP, Own, with_modes
from .pareto_tables import NOISE, SAME, acceleration, better, fastest, front, name, of, run_time, tip
from .runner import Row

GOALS = ((1.0, 0.03), (0.1, 0.01))  # mm, relative: what a user may want, for the advice on steps


def find(rows: Sequence[Row], case: Own) -> Row | None:
    """The row of an own case, if it went through."""
    return next((row for row in rows if row.case == case and row.good), None)


def paragraph(rows: Sequence[Row], scene: Scene) -> str:
    """Return a list in Markdown: the default against the front, and the effect of its step, rho, passes and modes."""
    row = find(rows, Own())
    if row is None:
        return "The default failed on this motion; see below.\n"
    parts = (_standing(rows, row), _step(rows, row), _rho(rows), _passes(rows), _modes(rows, row, scene))
    return "\n".join(f"- {part}" for part in parts if part) + "\n"


def _standing(rows: Sequence[Row], row: Row) -> str:
    says = f"The default ({name(row.case)}): {_errors(row)}, {run_time(row):.3g} ms per simulated second."
    other = better(rows, row)
    if other is not None:
        beside = f"{name(other.case)} errs no more ({_errors(other)})"
        return f"{says} It is not on the front: {beside} in {100 * other.seconds / row.seconds:.0f} % of its time."
    exactly = row in front(rows, tip) or row in front(rows, acceleration)
    place = "on the front" if exactly else "at the front, within timing noise"
    return f"{says} It is {place}: nothing that errs no more in both takes less than {100 * NOISE:.0f} % of its time."


def _errors(row: Row) -> str:
    return f"{row.tip_mm:.2g} mm at the tip, {100 * row.acceleration:.2g} % in its acceleration"


def _step(rows: Sequence[Row], row: Row) -> str:
    """The longest steps of the default method, and what is the fastest, for some goals."""
    found = []
    for most in GOALS:
        kept = [r for r in of(rows, Own) if r.good and r.tip_mm <= most[0] and r.acceleration <= most[1]]
        plain = [_own(r).step for r in kept if r.case == Own(_own(r).step)]
        best = fastest(kept, most[0])
        if best is None or not plain:
            continue
        found.append(
            f"{most[0]:g} mm and {100 * most[1]:g} % hold up to {1e3 * max(plain):g} ms, and the fastest that holds them is "
            f"{name(best.case)}, in {100 * best.seconds / row.seconds:.0f} % of the default's time"
        )
    return f"Step: {'; '.join(found)}." if found else ""


def _rho(rows: Sequence[Row]) -> str:
    """Return a sentence on the error that damping costs, and on methods that get worse when the step gets smaller."""
    usual = Own().method
    told = []
    for row in of(rows, Own):
        method = _own(row).method
        if row.good and row.case == Own(method=replace(usual, parameter=method.parameter)):
            told.append((method.parameter, f"{method.parameter:g} gives {1e3 * row.own_mm:.2g} um"))
    if len(told) < 2:
        return ""
    worse = sorted({row.case.label for row in _rising(of(rows, Own))})
    end = f" With too little damping the acceleration gets worse as the step gets smaller: {'; '.join(worse)}." if worse else ""
    return f"rho, at the default step, against the own reference: {', '.join(text for _, text in sorted(told))}.{end}"


def _rising(rows: Sequence[Row]) -> list[Row]:
    """Rows whose acceleration is more than three times as wrong as with the next longer step."""
    found = []
    for row in rows:
        longer = [r for r in rows if r.case.label == row.case.label and r.good and _own(r).step > _own(row).step]
        nearest = min(longer, key=lambda r: _own(r).step, default=None)
        if row.good and nearest is not None and row.own_acceleration > 3.0 * nearest.own_acceleration + 1e-4:
            found.append(row)
    return found


def _passes(rows: Sequence[Row]) -> str:
    """Newton against the single pass, step by step."""
    usual, single = Own().method, replace(Own().method, passes=1)
    pairs = []
    for row in of(rows, Own):
        newton = find(rows, Own(_own(row).step, usual))
        if row.case == Own(_own(row).step, single) and row.good and newton is not None:
            pairs.append((newton, row))
    if not pairs:
        return ""
    pairs.sort(key=lambda pair: _own(pair[0]).step)
    alike = [newton for newton, row in pairs if row.tip_mm < SAME * newton.tip_mm]
    counted = ", ".join(f"{newton.passes or 0.0:.2f} at {1e3 * _own(newton).step:g} ms" for newton, _ in pairs)
    end, last = "a single one errs more throughout", pairs[-1]
    if alike:
        end = f"a single one errs the same up to {1e3 * _own(alike[-1]).step:g} ms"
    return (
        f"Passes: Newton makes {counted}; {end}, and takes {100 * last[1].seconds / last[0].seconds:.0f} % of the time at "
        f"{1e3 * _own(last[0]).step:g} ms. Newton is the default because it costs nothing where one pass suffices, and notices "
        "where it does not."
    )


def _modes(rows: Sequence[Row], row: Row, scene: Scene) -> str:
    """Return a sentence on the error and run time of each number of modes, at the default step."""
    told, listed = [], []
    for modes in range(1, 7):
        shapes, cantilever = (find(rows, Own(modes=modes, basis=basis)) for basis in ("end-shapes", "cantilever"))
        shapes = row if with_modes(scene, modes) == scene else shapes
        if shapes is not None:
            beside = f" (cantilever modes: {cantilever.tip_mm:.2g} mm)" if cantilever is not None else ""
            told.append(f"{modes}: {_errors(shapes)}, {run_time(shapes):.3g} ms{beside}")
            listed.append(shapes)
    if not told:
        return ""
    fewest = min((r for r in listed if r.tip_mm < SAME * row.tip_mm), key=lambda r: r.seconds, default=None)
    end = "" if fewest is None else f" The fastest that errs as little as the default: {_own(fewest).modes or scene.modes}."
    return f"Modes a part at {1e3 * DEFAULT_STEP:g} ms (the scene has {scene.modes}): {'; '.join(told)}.{end}"


def _own(row: Row) -> Own:
    assert isinstance(row.case, Own)
    return row.case
