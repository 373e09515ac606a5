"""Report of the study of round-off: digits lost over chain length, stiffness and step; error of the tip over the step."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from default_boom import motion_of

from boom_twin import Scene
from boom_twin.analysis.methods import integrate_with
from boom_twin.analysis.simulate import RHO
from boom_twin.system.atomic_files import write_atomic
from boom_twin.validation.study import scenes as made
from boom_twin.validation.study.report import page, table
from boom_twin.validation.study.stability_cases import short, smooth

from .exact_step import StepRoundoff, digits, one_step
from .pictures import roundoff_picture

COUNTS, QUICK_COUNTS = (2, 3, 5, 10, 20, 50, 100, 200), (2, 5, 20)
STEPS, QUICK_STEPS = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 5e-2), (1e-5, 1e-3)  # s
USUAL = 1e-3  # s


@dataclass(frozen=True)
class Loss:
    """Digits lost in one step: `group` is what is varied, `value` its amount."""

    group: str
    name: str
    value: float
    step: StepRoundoff


def losses(scene: Scene, quick: bool = False) -> list[Loss]:
    """All measurements; `quick` leaves out the long ones."""
    found = [*_by_count(QUICK_COUNTS if quick else COUNTS), *_by_step(scene, QUICK_STEPS if quick else STEPS)]
    return found if quick else [*found, *_by_stiffness(scene)]


def _by_count(counts: tuple[int, ...]) -> Iterator[Loss]:
    for count in counts:
        boom = made.long_boom(count)
        yield Loss("sections", f"20 m in {count} sections", count, one_step(boom, _angles(boom), USUAL, RHO))


def _by_step(scene: Scene, steps: tuple[float, ...]) -> Iterator[Loss]:
    for step in steps:
        yield Loss("time step", f"dt {short(step)} s", step, one_step(scene, _angles(scene), step, RHO))


def _by_stiffness(scene: Scene) -> Iterator[Loss]:
    changes: list[tuple[str, Callable[[Scene], Scene]]] = [
        ("k 1e5 N/m", lambda s: made.cylinders(s, 1e5)),
        ("k 1e13 N/m", lambda s: made.cylinders(s, 1e13)),
        ("incompressible", lambda s: made.cylinders(s, None)),
        ("EI x 1e-3", lambda s: made.bending(s, 1e-3)),
        ("EI x 1e4", lambda s: made.bending(s, 1e4)),
        ("links, barrels, rods x 1e-6", lambda s: made.cylinder_parts(made.links(s, 1e-6), ("barrel", "rod"), 1e-6)),
        ("payload 10 x boom", lambda s: made.loaded(s, 10.0)),
        ("10 modes", lambda s: made.with_modes(s, 10)),
        ("101 m in 7 sections", lambda s: made.seven_sections()),
    ]
    for name, change in changes:
        boom = change(scene)
        yield Loss("extremes", name, float("nan"), one_step(boom, _angles(boom), USUAL, RHO))


def _angles(scene: Scene) -> np.ndarray:
    return motion_of(scene).angles


SPAN, RISE, SHARE, ROWS = 0.2, 0.16, 0.1, 10  # s, s, of the study's move, rows compared
TURN_UP_STEPS = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6)  # s
COARSE, FINE = 2e-5, 1e-5  # s, steps that the reference is extrapolated from
FITTED = 1e-4  # s, the order is fitted down to this step
TARGET = 1e-8  # of the boom's length: above it the error may not turn up


@dataclass(frozen=True)
class TurnUp:
    """Errors of the tip. k steps."""

    steps: np.ndarray  # (k,), s, falling
    errors: np.ndarray  # (k,), largest error of the tip over `length`
    accelerations: np.ndarray  # (k,), m/s^2, error of the tip's acceleration, rms
    length: float  # m, of the boom
    order: float  # fitted where the scheme's error prevails

    @property
    def floor(self) -> tuple[float, float]:
        """Step (s) with the smallest error, and that error."""
        best = int(np.argmin(self.errors))
        return float(self.steps[best]), float(self.errors[best])

    @property
    def turned_up_above_target(self) -> bool:
        """Return True if the error rises again before it has been below `TARGET`."""
        rises = np.flatnonzero(np.diff(self.errors) > 0.0)
        return bool(rises.size and self.errors[rises[0]] > TARGET)


def turn_up(scene: Scene, steps: tuple[float, ...] = TURN_UP_STEPS) -> TurnUp:
    """March a short smooth move by all `steps` (s), among them `COARSE` and `FINE`."""
    found = {step: _rows(scene, step) for step in steps}
    weight = FINE**2 / (COARSE**2 - FINE**2)
    right = [fine + weight * (fine - coarse) for fine, coarse in zip(found[FINE], found[COARSE], strict=True)]
    length = sum(section.length for section in scene.sections)
    errors = np.array([np.linalg.norm(found[step][0] - right[0], axis=1).max() for step in steps]) / length
    rough = np.array([np.sqrt(np.mean((found[step][1] - right[1]) ** 2)) for step in steps])
    taken = np.array(steps) >= FITTED
    order = np.polyfit(np.log(np.array(steps)[taken]), np.log(errors[taken]), 1)[0]
    return TurnUp(np.array(steps), errors, rough, length, float(order))


def _rows(scene: Scene, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Tip and its acceleration, both (ROWS + 1, 2), m and m/s^2."""
    own = smooth(scene, None, SHARE, RISE, SPAN, step)
    found = integrate_with(scene, own.drive, SPAN, step, round(SPAN / ROWS / step), angles=own.angles)
    return found.tip, found.tip_acceleration


def write(scene: Scene, out: Path, quick: bool = False) -> list[Path]:
    """Measure, and write ``roundoff.md`` and ``roundoff.png`` into `out`; returns their paths."""
    lost, turned = losses(scene, quick), turn_up(scene, tuple(step for step in TURN_UP_STEPS if step >= FINE or not quick))
    paths = [out / f"roundoff.{kind}" for kind in ("md", "png")]
    write_atomic(paths[0], text(lost, turned))
    chain = [loss for loss in lost if loss.group == "sections"]
    shown = {"Riccati": "riccati", "plain product": "plain", "LU of the whole system": "dense"}
    digits_lost = {name: np.array([digits(getattr(loss.step, key)) for loss in chain]) for name, key in shown.items()}
    counts = np.array([loss.value for loss in chain])
    roundoff_picture(paths[1], "Round-off", turned.steps, turned.errors, TARGET, counts, digits_lost)
    return paths


def text(lost: Sequence[Loss], turned: TurnUp) -> str:
    """Return the report."""
    step, error = turned.floor
    verdict = "above" if turned.turned_up_above_target else "below"
    rows = [
        (loss.name, loss.step.unknowns,
         *(f"{digits(error):.1f}" for error in (loss.step.riccati, loss.step.plain, loss.step.dense)))
        for loss in lost if loss.group != "sections"
    ]  # fmt: skip
    parts = [
        "# Round-off",
        "![Error over the step; digits lost over the length of the chain](roundoff.png)",
        "## Digits lost in one Newton pass",
        "The table lists the decimal digits, of 16, lost in the tip's increment. Solvers: Riccati form, plain product of "
        "transfer matrices, LU of the whole system. The reference solution of the whole system is refined in extended "
        "precision. Step 1 ms unless named. The Riccati form loses about as many as LU. The plain product loses digits with "
        "every section (right panel).",
        table(("boom", "unknowns", "Riccati", "plain product", "LU"), rows),
        "## Error of the tip over the step",
        f"The left panel shows one smooth move. Order {turned.order:.2f}; smallest error {error:.1e} of the length at "
        f"{step:.0e} s. The error rises again {verdict} {TARGET:.0e}: accelerations contain the rounding of positions "
        "over h\N{SUPERSCRIPT TWO}.",
        "Limits: one short smooth move of the default boom; long booms are invented.",
    ]
    return page(parts)
