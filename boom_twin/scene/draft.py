"""A scene of which some parts may be unusable: what the checks look at."""

from __future__ import annotations

from dataclasses import dataclass, field

from .parts import Base, Clearance, Joint, Material, Modes, Point, Section, Tip
from .read import Document


@dataclass(frozen=True)
class Draft:
    """Parts that are well formed by themselves; ``None`` where one is not, or is not there.

    The fields are those of `boom_twin.scene.parts.Scene`; `document` gives lines.
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
