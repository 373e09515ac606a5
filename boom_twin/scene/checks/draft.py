"""Findings of the scene checks: faults, warnings, the partly validated scene they look at."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ...config.yaml_text import Document, Place
from ...errors import Fault
from ..schema import Base, Clearance, Joint, Material, Modes, Point, Section, Tip


@dataclass(frozen=True)
class Draft:
    """Parts that are well formed by themselves; ``None`` where one is not, or is not there.

    The fields are those of `boom_twin.scene.schema.Scene`; `document` gives lines.
    """

    document: Document = field(default_factory=Document)
    gravity: Point | None = None
    material: Material | None = None
    base: Base | None = None
    modes: Modes = 3
    axial: bool = True
    geometric: bool = True
    sections: tuple[Section | None, ...] = ()
    joints: tuple[Joint | None, ...] = ()
    tip: Tip | None = None
    line_fill: float | None = None
    clearance: Clearance | None = None
    postures: dict[str, tuple[float, ...]] = field(default_factory=dict)

    def section(self, index: int) -> Section | None:
        """Section `index` (0-based), None where there is no usable one."""
        return self.sections[index] if 0 <= index < len(self.sections) else None

    def modes_of(self, section: Section) -> int:
        """Bending coordinates per flexible part of a section of this draft."""
        return self.modes if section.modes is None else section.modes


@dataclass(frozen=True)
class Finding:
    """A `Fault` and whether the scene can be used all the same (`odd`)."""

    fault: Fault
    odd: bool


def fault(draft: Draft, place: Place, value: Any, bound: str, remedy: str) -> Finding:
    """The scene cannot be used."""
    return Finding(draft.document.fault(place, value, bound, remedy), odd=False)


def warning(draft: Draft, place: Place, value: Any, bound: str, remedy: str) -> Finding:
    """The scene can be used, but this is probably not meant."""
    return Finding(draft.document.fault(place, value, bound, remedy), odd=True)
