"""Masses of the Exudyn boom: rigid parts merged about a reference point of their section."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...scene.schema import Point, RigidPart, Scene, Section


@dataclass(frozen=True, slots=True)
class Lump:
    """Rigid mass (kg) with centre (m) and inertia about that centre (kg m^2)."""

    mass: float
    com: Point
    inertia: float


@dataclass(frozen=True, slots=True)
class Gathered:
    """Merged mass (kg) with centre from, and inertia about, the REFERENCE POINT (m, kg m^2)."""

    mass: float
    com: Point
    inertia: float


@dataclass(slots=True)
class Lumps:
    """Lumps of neighbours on one body: `inertia` resists acceleration, `weight` has weight."""

    inertia: list[Lump] = field(default_factory=list)
    weight: list[Lump] = field(default_factory=list)

    def both(self, lump: Lump) -> None:
        """Add a lump with inertia and weight."""
        self.inertia.append(lump)
        self.weight.append(lump)


@dataclass(frozen=True, slots=True)
class LumpedMasses:
    """Lumps that replace cylinders and links without a body of their own."""

    sections: list[dict[float, Lumps]]  # lumps of every section by the pin's x (m), in the section's axes
    links: list[Lumps]  # lumps on the bearing link of every joint, in its axes

    @classmethod
    def none(cls, count: int) -> LumpedMasses:
        """Return lists without lumps for `count` sections."""
        return cls([{} for _ in range(count)], [Lumps() for _ in range(count)])

    def on_section(self, index: int, x: float) -> Lumps:
        """Return the lumps that section `index` (0-based) bears at `x` (m)."""
        return self.sections[index].setdefault(x, Lumps())


def gather(lumps: list[Lump], reference_x: float) -> Gathered:
    """Return all lumps as one rigid mass about the point (`reference_x`, 0) of the section's axes."""
    mass = sum(lump.mass for lump in lumps)
    if mass == 0.0:
        return Gathered(0.0, (0.0, 0.0), sum(lump.inertia for lump in lumps))
    x = sum(lump.mass * (lump.com[0] - reference_x) for lump in lumps) / mass
    y = sum(lump.mass * lump.com[1] for lump in lumps) / mass
    inertia = sum(lump.inertia + lump.mass * ((lump.com[0] - reference_x) ** 2 + lump.com[1] ** 2) for lump in lumps)
    return Gathered(mass, (x, y), inertia)


def rod(start: float, end: float, per_length: float, rotary: float = 0.0) -> Lump:
    """Return a uniform rod on the section's axis: kg/m, and rotary inertia per length (kg m)."""
    length = end - start
    mass = per_length * length
    return Lump(mass, ((start + end) / 2, 0.0), mass * length**2 / 12 + rotary * length)


def _part(part: RigidPart | None) -> list[Lump]:
    return [] if part is None else [Lump(part.mass, part.com, part.inertia)]


def _tip(scene: Scene, index: int) -> list[Lump]:
    if scene.tip is None or not scene.tip.payload or index != len(scene.sections) - 1:
        return []
    return [Lump(scene.tip.payload, (scene.sections[index].length, 0.0), 0.0)]


def rigid_section(scene: Scene, index: int) -> list[Lump]:
    """Return all lumps of a rigid section, including its beam."""
    section = scene.sections[index]
    beam = [] if section.beam is None else [rod(*section.beam, section.rho_A or 0.0, section.rho_I or 0.0)]
    fill = rod(0.0, section.length, scene.line_fill or 0.0)
    return [*_part(section.root), *_part(section.head), *beam, fill, *_tip(scene, index)]


def flexible_root(scene: Scene, section: Section) -> list[Lump]:
    """Return the lumps inboard of the beam: root and concrete."""
    return [*_part(section.root), rod(0.0, _beam(section)[0], scene.line_fill or 0.0)]


def flexible_head(scene: Scene, index: int) -> list[Lump]:
    """Return the lumps outboard of the beam: head, concrete and payload."""
    section = scene.sections[index]
    fill = rod(_beam(section)[1], section.length, scene.line_fill or 0.0)
    return [*_part(section.head), fill, *_tip(scene, index)]


def _beam(section: Section) -> Point:
    assert section.beam is not None
    return section.beam
