"""The table of a boom's drawing: boxes, bores and rods, pins, kinds of joints."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from ..config.yaml_text import Document
from ..errors import ABSENT, Fault, SceneError
from .block_reader import meaning_of, validated
from .load import Kind, parse, read_text
from .schema import (
    CAP_LINE,
    ROD_LINE,
    Base,
    Bore,
    BulkModulus,
    Cylinder,
    Finite,
    JointGeometry,
    Material,
    NotNegative,
    Part,
    Point,
    Positive,
    Rod,
    Scene,
    Section,
)  # fmt: skip

STEEL = Material(E=2.1e11, rho=7850.0)


PIPE = "what rides on a metre of the box beside it: pipe line, hoses, clamps, kg/m"


class BoxSection(Part):
    """One section whose beam is a box."""

    length: Positive = Field(description=meaning_of(Section, "length"))
    beam: Point = Field(description=meaning_of(Section, "beam"))
    height: Positive = Field(description=meaning_of(Section, "height"))
    width: Positive = Field(description="the outer width of the box, m")
    wall: Positive = Field(description="the thickness of its walls, m")
    pipe: NotNegative | None = Field(default=None, description=PIPE)
    rod_pin: Point | None = Field(default=None, description=meaning_of(Section, "rod_pin"))


class DrawnJoint(JointGeometry):
    """One joint as in a scene, with bore and rod of its cylinder."""

    bore: Bore
    rod: Rod
    closed_length: Positive | None = Field(
        default=None, description=f"{meaning_of(Cylinder, 'closed_length')}; without it, worked out from the pins"
    )
    max_stroke: Positive | None = Field(
        default=None, description=f"{meaning_of(Cylinder, 'max_stroke')}; without it, worked out from the pins"
    )
    cap_line: NotNegative = Field(default=5e-4, description=CAP_LINE)
    rod_line: NotNegative = Field(default=5e-4, description=ROD_LINE)


class BoomTable(Part):
    """A boom as its drawing shows it; SI units, ranges and postures in degrees, the base's inclination with its unit."""

    description: str = Field(default="", description="text")
    material: Material = Field(default=STEEL, description="a block with E (Pa) and rho (kg/m^3); steel if it is not there")
    base: Base = Field(description=meaning_of(Scene, "base"))
    pipe: NotNegative = Field(default=0.0, description=PIPE)
    bulk_modulus: BulkModulus = 1.4e9
    damping_ratio: float = Field(default=0.01, gt=0, lt=1, description="the damping ratio of the first mode, 0.005 to 0.03")
    payload: NotNegative | None = Field(default=None, description="the point mass at the tip, for example an end hose, kg")
    line_fill: NotNegative | None = Field(default=None, description=meaning_of(Scene, "line_fill"))
    sections: tuple[BoxSection, ...] = Field(min_length=1, description=meaning_of(Scene, "sections"))
    joints: tuple[DrawnJoint, ...] = Field(min_length=1, description=meaning_of(Scene, "joints"))
    postures: dict[str, tuple[Finite, ...]] = Field(default={}, description=meaning_of(Scene, "postures"))


TABLE_FILE = Kind("table", "boom_twin init --example-table")


def read_table(path: Path) -> tuple[BoomTable, Document]:
    """Return the table in a YAML file, and the document with the lines of its values.

    SceneError with every fault that was found: place, value, bound, remedy.
    """
    source = str(path)
    document = parse(read_text(path, TABLE_FILE), source, TABLE_FILE)
    if isinstance(document.values, dict) and "gravity" in document.values:
        bound, remedy = "only a scene has it, and this is to be a table of dimensions", "`boom_twin check` takes a scene."
        raise SceneError(source, (document.fault(("gravity",), document.values["gravity"], bound, remedy),))
    table, faults = validated(document, BoomTable)
    faults += document.faults
    if table is not None:
        faults += _faults(document, table)
    if faults or table is None:
        raise SceneError(source, tuple(sorted(faults, key=lambda fault: fault.line or 0)))
    return table, document


def _faults(document: Document, table: BoomTable) -> list[Fault]:
    """Return faults that the scene does not show: walls that fill their box, no density, pipes or angles that say nothing."""
    found = []
    for i, section in enumerate(table.sections):
        if 2.0 * section.wall >= min(section.height, section.width):
            bound = f"two walls fill the box of {section.height:g} by {section.width:g} m"
            found.append(document.fault(("sections", i, "wall"), section.wall, bound, "Give the thickness of one wall."))
    if table.material.rho is None:
        remedy = f"Give {meaning_of(Material, 'rho')}."
        found.append(document.fault(("material", "rho"), ABSENT, "masses are computed from it", remedy))
    return [*found, *_pipes_of_some(document, table), *_angle_without_unit(document)]


def _pipes_of_some(document: Document, table: BoomTable) -> list[Fault]:
    """Return a fault for each section without `pipe`, if others have one and none is given for the whole boom."""
    without = [i for i, section in enumerate(table.sections) if section.pipe is None]
    if "pipe" in table.model_fields_set or not 0 < len(without) < len(table.sections):
        return []
    given = ", ".join(f"{section.pipe:g}" for section in table.sections if section.pipe is not None)
    bound = f"other sections have {given} kg/m, and this one says nothing"
    remedy = "Give pipe in every section, 0 where there is none, or once for the whole boom."
    return [document.fault(("sections", i, "pipe"), ABSENT, bound, remedy) for i in without]


def _angle_without_unit(document: Document) -> list[Fault]:
    """Return a fault of an inclination as a bare number: a scene takes it for rad, beside ranges in degrees."""
    base = document.values.get("base") if isinstance(document.values, dict) else None
    value = base.get("inclination") if isinstance(base, dict) else None
    if not isinstance(value, int | float) or value == 0:
        return []
    remedy = f"Give its unit: {value:g} deg or {value:g} rad ."
    return [document.fault(("base", "inclination"), value, "rad or degrees?", remedy)]


def odd_boxes(table: BoomTable, document: Document) -> list[Fault]:
    """Return a warning of every box that is wider than high, or much too slim."""
    slimmest = 0.3  # width of a box over its height
    found = []
    for i, section in enumerate(table.sections):
        h, b, place = section.height, section.width, ("sections", i)
        if b > h:
            softer = second_moment(b, h, section.wall) / second_moment(h, b, section.wall)
            bound = (
                f"it is less than width = {b:g} m; booms are higher than wide, and this box bends "
                f"{softer:.3g} times as much in the plane as one of {b:g} by {h:g} m"
            )
            remedy = f"Give height: {b:g} and width: {h:g}, if they are swapped."
            found.append(document.fault((*place, "height"), h, bound, remedy, "warning"))
        elif b < slimmest * h:
            bound = f"expected at least {slimmest * h:.3g} m for a box {h:g} m high"
            found.append(document.fault((*place, "width"), b, bound, "Give the outer width, and check its unit.", "warning"))
    return found


def second_moment(height: float, width: float, wall: float) -> float:
    """Return I (m^4) of a box about the axis across the plane of the boom."""
    return (width * height**3 - (width - 2 * wall) * (height - 2 * wall) ** 3) / 12
