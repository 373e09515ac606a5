"""Plausibility of the beams: box and mass per metre by each other, by the length and by the section before."""

from __future__ import annotations

import math

from ...config.yaml_text import Place
from ..schema import Point, Scene, Section
from .draft import Draft, Findings

GYRATION_BY_HEIGHT = (0.28, 0.5)  # a solid block has 0.289, two thin flanges 0.5
GYRATION_BY_LENGTH = (0.004, 0.05)
COMPACTNESS = (0.12, 2.0)  # A^2 / I: a box with walls of about 1/170 and of a tenth of its height
MASS_BY_STEEL, SLACK = (1.0, 4.0), 1e-3  # of a value that was rounded
ROTARY_BY_STEEL = (0.3, 30.0)
TAPER = (1 / 40, 1.5)  # of EI against the section before
LEAST_BEAM = 0.6  # of the length
LONGEST_HEAD = 0.125  # of the length
DEEP, WALL = 2.4, 20.7  # a thin box is DEEP radii of gyration high, and its wall is A^2/(I WALL) of that
STEEL, STEEL_E = 7850.0, (1.9e11, 2.2e11)
STEEL_RHO, OF_STEEL = (7700.0, 8000.0), (1.7e11, 2.3e11)  # densities that only steel has, and its E with a wide margin
SPECIFIC_STIFFNESS = (8e6, 1.2e8)  # E / rho, m^2/s^2: glass fibre 1e7, metals 2.6e7, carbon fibre 9e7


def density(scene: Scene) -> float | None:
    """Return the density of the material, kg/m^3; None if it does not fit E.

    A density that is not given is that of steel if E is that of steel, else None.
    """
    known, stiffness = scene.material.rho, scene.material.E
    if known is None:
        return STEEL if _between(stiffness, STEEL_E, 1.0) else None
    return known if _between(stiffness, SPECIFIC_STIFFNESS, known) else None


def gyration(section: Section) -> float | None:
    """Return the radius of gyration, m; None for a rigid section."""
    return None if section.A is None or section.I is None else math.sqrt(section.I / section.A)


def material(draft: Draft, scene: Scene) -> Findings:
    """Check Young's modulus against the density."""
    rho = scene.material.rho
    if rho is not None and not _between(scene.material.E, SPECIFIC_STIFFNESS, rho):
        low, high = (limit * rho for limit in SPECIFIC_STIFFNESS)
        bound = f"expected from {low:.2g} to {high:.2g} Pa with a density of {rho:g} kg/m^3"
        yield draft.warning(("material", "E"), scene.material.E, bound, "Steel has 2.06e11 Pa and 7850 kg/m^3.")
    elif rho is not None and _between(rho, STEEL_RHO, 1.0) and not _between(scene.material.E, OF_STEEL, 1.0):
        bound = f"expected from {OF_STEEL[0]:.2g} to {OF_STEEL[1]:.2g} Pa with the density of steel, {rho:g} kg/m^3"
        yield draft.warning(("material", "E"), scene.material.E, bound, "Check E, or give the density of this material.")


def beams(draft: Draft, scene: Scene) -> Findings:
    """Check all sections that have a beam."""
    for i, section in enumerate(scene.sections):
        if section.beam is not None and section.A is not None and section.I is not None:
            yield from _box(draft, i, section, section.A, section.I)
            yield from _per_metre(draft, i, section, density(scene))
            yield from _ends(draft, i, section, section.beam)
            yield from _taper(draft, scene, i, section.I)


def _box(draft: Draft, i: int, section: Section, area: float, inertia: float) -> Findings:
    place, radius = ("sections", i), math.sqrt(inertia / area)
    says = f"its radius of gyration, sqrt(I/A), is {radius:.3g} m"
    if section.height is not None and not _between(radius, GYRATION_BY_HEIGHT, section.height):
        bound = f"{says}; expected {_range(GYRATION_BY_HEIGHT, section.height)} for a box {section.height:g} m high"
        yield draft.warning((*place, "I"), inertia, bound, "Check I (m^4), A (m^2) and height (m).")
    elif not _between(radius, GYRATION_BY_LENGTH, section.length):
        bound = f"{says}; expected {_range(GYRATION_BY_LENGTH, section.length)} for a section of {section.length:g} m"
        yield draft.warning((*place, "I"), inertia, bound, "Check I (m^4), A (m^2) and length (m), decimals and units.")
    elif not _between(area**2, COMPACTNESS, inertia):
        depth = DEEP * radius
        walls = [f"{1e3 * depth * share / WALL:.2g}" for share in (area**2 / inertia, *COMPACTNESS)]
        bound = (
            f"with A = {area:g} m^2 this is a box about {depth:.2g} m high with walls of {walls[0]} mm; "
            f"expected {walls[1]} to {walls[2]} mm"
        )
        yield draft.warning((*place, "I"), inertia, bound, "Check the decimals of I (m^4) and A (m^2).")


def _per_metre(draft: Draft, i: int, section: Section, rho: float | None) -> Findings:
    assert section.A is not None and section.I is not None and section.rho_A is not None
    if rho is None:
        return
    place, steel = ("sections", i), rho * section.A
    if not _between(section.rho_A * (1.0 + SLACK), MASS_BY_STEEL, steel):
        bound = f"expected {_range(MASS_BY_STEEL, steel)} kg/m: the box alone, rho A, has {steel:.3g}"
        remedy = "Give the mass of one metre of beam: box, pipe line, hoses, without concrete (line_fill)."
        yield draft.warning((*place, "rho_A"), section.rho_A, bound, remedy)
    rotary = rho * section.I
    if section.rho_I and not _between(section.rho_I, ROTARY_BY_STEEL, rotary):
        bound = f"expected {_range(ROTARY_BY_STEEL, rotary)} kg m: the box alone, rho I, has {rotary:.3g}"
        yield draft.warning((*place, "rho_I"), section.rho_I, bound, "Give rho I, or leave it out.")


def _ends(draft: Draft, i: int, section: Section, beam: Point) -> Findings:
    place: Place = ("sections", i, "beam")
    (x0, x1), length = beam, section.length
    head = length - x1
    if x0 > 0.0 and x0 + x1 <= length * (1.0 + 1e-6) and head > LONGEST_HEAD * length:
        bound = f"[x0, x1] leave a rigid head of {head:.3g} m; expected at most {LONGEST_HEAD * length:.3g} m"
        remedy = f"x1 is measured from the inboard pivot; if {x1:g} m is the length of the beam, then x1 = {x0 + x1:g}."
        yield draft.warning(place, beam, bound, remedy)
    elif x1 - x0 < LEAST_BEAM * length:
        bound = f"{x1 - x0:.3g} m bend of {length:g} m; expected at least {LEAST_BEAM * length:.3g} m"
        yield draft.warning(place, beam, bound, "Give [x0, x1] from the inboard pivot: where the box begins and ends.")


def _taper(draft: Draft, scene: Scene, i: int, inertia: float) -> Findings:
    before = scene.sections[i - 1].I if i > 0 else None
    if before is not None and not _between(inertia, TAPER, before):
        bound = f"expected {_range(TAPER, before)} m^4 after sections[{i - 1}] with I = {before:g}"
        yield draft.warning(("sections", i, "I"), inertia, bound, "Booms taper outwards: check the decimals of both.")


def _between(value: float, limits: tuple[float, float], unit: float) -> bool:
    return limits[0] * unit <= value <= limits[1] * unit


def _range(limits: tuple[float, float], unit: float) -> str:
    return f"{limits[0] * unit:.3g} to {limits[1] * unit:.3g}"
