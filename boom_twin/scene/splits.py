"""Where the beam of a section is split: at pins of cylinders that sit on its flexible part."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from .parts import Scene

SAME_PLACE = 1e-9


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
    return tuple(pairwise(ends))
