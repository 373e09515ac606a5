"""Where the beam of a section is split: at pins of cylinders that sit on its flexible part, and evenly on short booms.

The fewer sections bend, the higher does each of them reach into the spectrum. With fewer than `LEAST` flexible sections every
part is cut evenly, so that the lowest six frequencies keep their accuracy with the default modes.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import ceil

from .parts import Scene

SAME_PLACE = 1e-9  # m
LEAST = 4  # flexible sections, or cuts of them, along a boom


@dataclass(frozen=True, slots=True)
class Split:
    """A pin on a flexible part: x from the inboard pivot (m), and whose pin it is."""

    x: float
    pin: str


def splits(scene: Scene, index: int) -> tuple[Split, ...]:
    """Splits of the beam of section `index` (0-based) from inboard to outboard; none for a rigid section."""
    section = scene.sections[index]
    if section.beam is None or not scene.is_flexible(index):
        return ()
    pins = []
    if index == 0 and section.rod_pin is not None:
        pins.append(Split(section.rod_pin[0], "rod pin of cylinder 1"))
    if index + 1 < len(scene.joints) and (c := scene.joints[index + 1].C) is not None:
        pins.append(Split(section.length + c[0], f"barrel pin C of cylinder {index + 2}"))
    x0, x1 = section.beam
    inside = [pin for pin in pins if x0 + SAME_PLACE < pin.x < x1 - SAME_PLACE]
    return tuple(sorted(inside, key=lambda pin: pin.x))


def flexible_parts(scene: Scene, index: int) -> tuple[tuple[float, float], ...]:
    """Ends (m from the inboard pivot) of the flexible parts of section `index` (0-based), none for a rigid section."""
    section = scene.sections[index]
    if section.beam is None or not scene.is_flexible(index):
        return ()
    ends = sorted({*section.beam, *(split.x for split in splits(scene, index))})
    cuts = cuts_of_parts(scene)
    places = [x0 + (x1 - x0) * k / cuts for x0, x1 in pairwise(ends) for k in range(cuts)]
    return tuple(pairwise([*places, ends[-1]]))


def cuts_of_parts(scene: Scene) -> int:
    """Number of equal pieces that every flexible part is cut into, 1 from `LEAST` flexible sections on."""
    return ceil(LEAST / max(1, sum(scene.is_flexible(i) for i in range(len(scene.sections)))))
