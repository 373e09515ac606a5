"""Where digits are lost: one Newton step of longer and longer chains, of stiff and soft booms, at large and small steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ..analysis.simulate import RHO
from ..records import Array
from ..scene.parts import Scene
from . import stability_scenes as made
from .long_booms import long_boom, seven_sections
from .motion import motion_of
from .stability_case import short
from .stability_step import Step, one_step

COUNTS, QUICK_COUNTS = (2, 3, 5, 10, 20, 50, 100, 200), (2, 5, 20)
STEPS, QUICK_STEPS = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 5e-2), (1e-5, 1e-3)  # s
USUAL = 1e-3  # s


@dataclass(frozen=True)
class Loss:
    """Digits lost in one step: `group` is what is varied, `value` its amount."""

    group: str
    name: str
    value: float
    step: Step


def losses(scene: Scene, quick: bool = False) -> list[Loss]:
    """All measurements; `quick` leaves out the long ones."""
    found = [*_by_count(QUICK_COUNTS if quick else COUNTS), *_by_step(scene, QUICK_STEPS if quick else STEPS)]
    return found if quick else [*found, *_by_stiffness(scene)]


def _by_count(counts: tuple[int, ...]) -> Iterator[Loss]:
    for count in counts:
        boom = long_boom(count)
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
        ("101 m in 7 sections", lambda s: seven_sections()),
    ]
    for name, change in changes:
        boom = change(scene)
        yield Loss("extremes", name, float("nan"), one_step(boom, _angles(boom), USUAL, RHO))


def _angles(scene: Scene) -> Array:
    return motion_of(scene).angles
