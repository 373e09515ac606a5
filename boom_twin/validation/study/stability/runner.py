"""Runner of the stability study: every case by every method, compared with its reference."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from ....analysis.equilibrium import rest_at
from ....analysis.methods import Method, MethodRun, integrate_with
from ....analysis.modal import natural_modes
from ....errors import SolverError
from ....scene.kinematics import joint_angles_of_strokes
from ....types import Array
from ..scene_changes import lighter_gravity
from .cases import Case, Setup
from .verdict import Facts, against_motion, against_rest

METHODS: dict[str, Method] = {
    "default": Method(),
    "rho 1": Method(parameter=1.0),
    "rho 0.5": Method(parameter=0.5),
    "rho 0": Method(parameter=0.0),
    "Newmark 0.5": Method("newmark", 0.5),
    "Newmark 0.6": Method("newmark", 0.6),
    "Wilson 1.4": Method("wilson", 1.4),
    "Houbolt": Method("houbolt"),
    "Park": Method("park"),
    "single pass": Method(passes=1),
    "plain product": Method(product="plain"),
}
REFERENCE = Method(tolerance=1e-10)
NOTHING = "there is no solution"
FINER, FINEST = 8, 5e-6  # divisor of the step for the reference; its smallest step (s), below which round-off prevails
HALVINGS = 20  # bisections of the load limit
FREQUENCY_TOLERANCE = 1e-6  # relative tolerance of a frequency


@dataclass(frozen=True)
class CaseResult:
    """Case with its reference in words and what each method did."""

    case: Case
    reference: str
    cells: dict[str, Facts]


def run(
    found: Iterable[Case], methods: dict[str, Method] | None = None, progress: Callable[[str], None] = lambda line: None
) -> list[CaseResult]:
    """Integrate all cases by all methods. `progress` gets a line after each case."""
    rows = []
    for case in found:
        rows.append(one(case, METHODS if methods is None else methods))
        progress(f"{case.group}: {case.name}: " + ", ".join(cell.verdict.word for cell in rows[-1].cells.values()))
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
            return judge(_march(setup, setup.step, setup.every, method))
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
        step = max(setup.step / FINER, FINEST)
        every, stride = max(round(setup.step / step), 1), max(round(step / setup.step), 1)
        right = _march(setup, step, every, REFERENCE)
        if right.status != "ok":
            return unsolvable, f"{NOTHING}: the reference ended, {right.status}"
        told = f"default method at {step:.3g} s"
        return lambda found: ended(found) or against_motion(_thinned(found, stride), right, setup.still, setup.jump), told
    rest = None  # the tip (m) at rest at the last strokes
    if case.truth == "equilibrium":
        rest = rest_at(setup.scene, *_strokes(setup, setup.duration))[1].frames[-1, :2].copy()
    told = "equilibrium of the last strokes" if rest is not None else "a vibration that does not grow about a mean that stays"
    return lambda found: ended(found) or against_rest(found, rest, setup.still, setup.every), told


def _march(setup: Setup, step: float, every: int, method: Method) -> MethodRun:
    return integrate_with(setup.scene, setup.drive, setup.duration, step, every, method, angles=setup.angles)


def _thinned(motion: MethodRun, stride: int) -> MethodRun:
    names = ("times", "tip", "tip_acceleration", "joints", "cylinder_forces")
    return replace(motion, **{name: getattr(motion, name)[::stride] for name in names})


def _strokes(setup: Setup, time: float) -> tuple[Array, Array]:
    """Return strokes (m) at a time (s), and joint angles (rad) of the undeformed boom there."""
    strokes = setup.drive(np.array([time]))[0][0]
    return strokes, joint_angles_of_strokes(setup.scene, strokes, near=setup.angles)


@dataclass(frozen=True)
class Limit:
    """Largest `share` of gravity with an equilibrium; first natural `frequency` (Hz) there and `unloaded`."""

    share: float
    frequency: float
    unloaded: float


def limit_of(setup: Setup) -> Limit:
    """Return the largest share of gravity with a stable equilibrium, by bisection.

    At a true limit the first natural frequency goes to zero: the stiffness vanishes, and no equilibrium is near.
    """
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if np.isnan(_slowest(setup, middle)) else (middle, high)
    return Limit(low, _slowest(setup, low), _slowest(setup, 0.0))


def _slowest(setup: Setup, share: float) -> float:
    """Return the first natural frequency (Hz) at the first strokes under `share` of gravity; NaN without an equilibrium."""
    try:
        plan, state, work = rest_at(lighter_gravity(setup.scene, share), *_strokes(setup, 0.0))
    except SolverError:
        return float("nan")
    return natural_modes(plan, state, work, 1, FREQUENCY_TOLERANCE)[0].frequency
