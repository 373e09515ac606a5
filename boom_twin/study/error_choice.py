"""Why the default is where it is: sentences made from the rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..scene.parts import Scene
from .error_cases import DEFAULT_STEP, Own
from .error_front import NOISE, acceleration, better, fastest, front, of, tip
from .error_run import Row
from .error_text import name, run_time

LOOSE = 1.1  # errors that differ by less than a tenth count as equal
ENOUGH = (1.0, 0.03)  # mm, relative: what a rig's sensors can tell, for the advice on larger steps


def find(rows: Sequence[Row], case: Own) -> Row | None:
    """The row of an own case."""
    return next((row for row in rows if row.case == case), None)


def paragraph(rows: Sequence[Row], scene: Scene) -> str:
    """Is the default on the front, and what do its step, rho, passes and modes buy?"""
    case = Own()
    row = find(rows, case)
    if row is None or not row.good:
        return f"The default failed: {row.status if row else 'it was not run'}.\n"
    parts = [_standing(rows, row), _step(rows, row), _rho(rows, row), _passes(rows, row), _modes(rows, row, scene)]
    return " ".join(part for part in parts if part) + "\n"


def _standing(rows: Sequence[Row], row: Row) -> str:
    says = (
        f"The default ({name(row.case)}) errs by {row.tip_mm:.2g} mm at the tip and {100 * row.acceleration:.2g} % in its "
        f"acceleration, at {run_time(row):.3g} ms per simulated second."
    )
    other = better(rows, row)
    if other is None:
        place = "on" if row in front(rows, tip) or row in front(rows, acceleration) else "within timing noise of"
        return f"{says} It is {place} the front: nothing that errs no more in either takes less than {100 * NOISE:.0f} % of its time."
    return (
        f"{says} It is not on the front: {name(other.case)} errs no more ({other.tip_mm:.2g} mm, "
        f"{100 * other.acceleration:.2g} %) and takes {100 * other.seconds / row.seconds:.0f} % of its time."
    )


def _step(rows: Sequence[Row], row: Row) -> str:
    """What a longer and a shorter step would do."""
    own = of(rows, Own)
    found = [f"Step: {_steps(rows)}."]
    lean = [r for r in own if r.good and r.tip_mm <= ENOUGH[0] and r.acceleration <= ENOUGH[1]]
    cheapest = min(lean, key=lambda r: r.seconds, default=None)
    if cheapest is not None and cheapest.seconds < NOISE * row.seconds:
        found.append(
            f"Where {ENOUGH[0]:g} mm and {100 * ENOUGH[1]:g} % are enough, {name(cheapest.case)} takes "
            f"{100 * cheapest.seconds / row.seconds:.0f} % of the default's time; the default's millisecond is for what a tip's "
            f"acceleration and sensors at 1 kHz need, not for the tip's place."
        )
    return " ".join(found)


def _steps(rows: Sequence[Row]) -> str:
    listed = [r for r in of(rows, Own) if r.good and isinstance(r.case, Own) and r.case == Own(step=r.case.step)]
    told = [f"{1e3 * _step_of(r):g} ms gives {r.tip_mm:.2g} mm and {100 * r.acceleration:.2g} %" for r in listed]
    return ", ".join(told)


def _step_of(row: Row) -> float:
    assert isinstance(row.case, Own)
    return row.case.step


def _rho(rows: Sequence[Row], row: Row) -> str:
    """How much the damping costs in error, and which methods get worse when the step gets smaller."""
    listed = [
        (r.case.method.parameter, r)
        for r in of(rows, Own)
        if isinstance(r.case, Own) and r.case == replace(Own(), method=r.case.method)
        and r.case.method == replace(Own().method, parameter=r.case.method.parameter)
    ]  # fmt: skip
    told = [f"{rho:g}: {r.own_mm:.2g} mm" if r.good else f"{rho:g}: fails" for rho, r in sorted(listed, key=lambda pair: pair[0])]
    if len(told) < 2:
        return ""
    worse = sorted({r.case.label for r in _rising(of(rows, Own))})
    end = f" The acceleration of {'; '.join(worse)} gets worse when the step gets smaller: not damped enough." if worse else ""
    return f"rho, at the default step, against the own reference: {', '.join(told)}.{end}"


def _rising(rows: Sequence[Row]) -> list[Row]:
    """Rows whose acceleration is more than three times as wrong as with the next longer step."""
    found = []
    for row in rows:
        longer = [r for r in rows if r.case.label == row.case.label and r.good and _step_of(r) > _step_of(row)]
        nearest = min(longer, key=_step_of, default=None)
        if row.good and nearest is not None and row.own_acceleration > 3.0 * nearest.own_acceleration + 1e-6:
            found.append(row)
    return found


def _passes(rows: Sequence[Row], row: Row) -> str:
    """Newton against the single pass, step by step."""
    told = []
    for one in of(rows, Own):
        if not isinstance(one.case, Own) or one.case.method != replace(Own().method, passes=1) or not one.good:
            continue
        newton = find(rows, replace(one.case, method=Own().method))
        if one.case == replace(Own(step=one.case.step), method=one.case.method) and newton is not None and newton.good:
            told.append((one.case.step, newton.passes or 0.0, one.own_mm / newton.own_mm, one.seconds / newton.seconds))
    if not told:
        return ""
    equal = [step for step, _, ratio, _ in told if ratio < LOOSE]
    most = max(told, key=lambda item: item[0])
    here = next((item for item in told if item[0] == DEFAULT_STEP), told[0])
    return (
        f"Passes: Newton made {here[1]:.2f} passes a step at {1e3 * here[0]:g} ms and {most[1]:.2f} at {1e3 * most[0]:g} ms; a "
        f"single pass errs the same to a tenth up to {1e3 * max(equal, default=0.0):g} ms, where it takes {100 * most[3]:.0f} % of "
        f"the time at {1e3 * most[0]:g} ms. Newton is the default because it says so when one pass is not enough."
    )


def _modes(rows: Sequence[Row], row: Row, scene: Scene) -> str:
    """What each further shape buys, at the default step."""
    told = []
    for modes in range(1, 7):
        found = find(rows, Own(modes=modes))
        cantilever = find(rows, Own(modes=modes, basis="cantilever"))
        if found is not None and found.good:
            beside = f" (cantilever modes {cantilever.tip_mm:.2g} mm)" if cantilever is not None and cantilever.good else ""
            told.append(f"{modes}: {found.tip_mm:.2g} mm, {100 * found.acceleration:.2g} %{beside}")
    here = fastest([r for r in of(rows, Own) if r.case in {Own(modes=m) for m in range(1, 7)}], LOOSE * row.tip_mm, tip)
    enough = "" if here is None else f" The fewest that err as little as the default: {name(here.case)}."
    return f"Modes a part (the scene has {scene.modes}): {'; '.join(told)}.{enough}" if told else ""
