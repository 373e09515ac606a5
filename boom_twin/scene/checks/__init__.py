"""Checks of a scene beyond single values: the partly validated scene that they look at, and what they find."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from ...config.yaml_text import Document, Place
from ...errors import Fault
from ..schema import Base, Clearance, Joint, Material, Modes, Point, Section, Tip

Findings = Iterator[Fault]
"""Faults and warnings, as a check yields them."""


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
        """Return the section `index` (0-based), None where there is no usable one."""
        return self.sections[index] if 0 <= index < len(self.sections) else None

    def modes_of(self, section: Section) -> int:
        """Return the bending coordinates per flexible part of a section of this draft."""
        return self.modes if section.modes is None else section.modes

    def fault(self, place: Place, value: Any, bound: str, remedy: str) -> Fault:
        """Return a fault: the scene cannot be used."""
        return self.document.fault(place, value, bound, remedy)

    def warning(self, place: Place, value: Any, bound: str, remedy: str) -> Fault:
        """Return a warning: the scene can be used, but this is probably not meant."""
        return self.document.fault(place, value, bound, remedy, "warning")

    def expect(
        self,
        place: Place,
        value: float,
        limits: tuple[float, float],
        unit: float,
        where: str,
        remedy: str,
        *,
        measured: float | None = None,
        says: str = "",
    ) -> Findings:
        """Yield a warning if a value is not within `limits` times `unit`, with the words `says` and `where` around the range.

        `measured` is judged instead of the value, if it is given.
        """
        low, high = (limit * unit for limit in limits)
        if not low <= (value if measured is None else measured) <= high:
            range_words = f"{low:.3g} to {high:.3g}"
            if low <= 0.0 or math.isinf(high):
                range_words = f"at most {high:.3g}" if low <= 0.0 else f"at least {low:.3g}"
            yield self.warning(place, value, f"{says}expected {range_words}{where}", remedy)
