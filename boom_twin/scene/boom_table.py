"""The table of a boom's drawing: boxes, bores and rods, pins, kinds of joints; read from YAML or CSV."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

from pydantic import Field

from ..config.yaml_text import Document, Place
from ..errors import ABSENT, Fault, SceneError
from .block_reader import NUMBER, meaning_of, validated
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


PAIRS = {"x": 0, "y": 1, "start": 0, "end": 1, "low": 0, "high": 1, "along": 0, "left": 1}
"""Ending of the name of a column that holds one of two numbers, as in C_x, beam_end, range_deg_low."""
TABLES = (".csv", ".tsv", ".txt")
"""Names of files with a row for every section end so; the cells lie apart by commas, semicolons or tabs."""
TABLE_FILE = Kind("table", "boom_twin init --example-table")
_HEADER = re.compile(r"(\w+?)(?:_(x|y|start|end|low|high|along|left))?\s*(?:[\[(]\s*(.+?)\s*[\])])?")


def read_table(path: Path) -> tuple[BoomTable, Document]:
    """Return the table in a file (.csv, .tsv, .txt, else YAML), and the document with the lines of its values.

    SceneError with every fault that was found: place, value, bound, remedy.
    """
    text = read_text(path, TABLE_FILE)
    document = csv_document(text, str(path)) if path.suffix.lower() in TABLES else parse(text, str(path), TABLE_FILE)
    return checked_table(document, str(path)), document


def checked_table(document: Document, source: str) -> BoomTable:
    """Return the table that a document holds; SceneError with all its faults."""
    if isinstance(document.values, dict) and "gravity" in document.values:
        bound, remedy = "only a scene has it, and this is to be a table of dimensions", "`boom_twin check` takes a scene."
        raise SceneError(source, (document.fault(("gravity",), document.values["gravity"], bound, remedy),))
    read = validated(document, BoomTable)
    faults = [*read.faults, *document.faults]
    if read.block is not None:
        faults += _faults(document, read.block)
    if faults or read.block is None:
        raise SceneError(source, tuple(sorted(faults, key=lambda fault: fault.line or 0)))
    return read.block


def _faults(document: Document, table: BoomTable) -> list[Fault]:
    """Return faults: walls that fill their box, rods as thick as the bore, no density, not a joint for every section."""
    found = []
    for i, section in enumerate(table.sections):
        if 2.0 * section.wall >= min(section.height, section.width):
            bound = f"two walls fill the box of {section.height:g} by {section.width:g} m"
            found.append(document.fault(("sections", i, "wall"), section.wall, bound, "Give the thickness of one wall."))
    for i, joint in enumerate(table.joints):
        if joint.rod >= joint.bore:
            bound = f"the rod must be thinner than the bore, {joint.bore:g} m"
            found.append(document.fault(("joints", i, "rod"), joint.rod, bound, "Give both as diameters."))
    if table.material.rho is None:
        remedy = f"Give {meaning_of(Material, 'rho')}."
        found.append(document.fault(("material", "rho"), ABSENT, "masses are worked out with it", remedy))
    if len(table.joints) != len(table.sections):
        bound = f"there are {len(table.sections)} sections, and every section has one joint"
        found.append(document.fault(("joints",), len(table.joints), bound, "Add or remove joints or sections."))
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
    remedy = f"Give its unit: {value:g} deg or {value:g} rad (in a CSV table in the heading: `inclination [deg]`)."
    return [document.fault(("base", "inclination"), value, "rad or degrees?", remedy)]


SLIMMEST = 0.3  # width of a box over its height


def odd_boxes(table: BoomTable, document: Document) -> list[Fault]:
    """Return a warning of every box that is wider than high, or much too slim."""
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
        elif b < SLIMMEST * h:
            bound = f"expected at least {SLIMMEST * h:.3g} m for a box {h:g} m high"
            found.append(document.fault((*place, "width"), b, bound, "Give the outer width, and check its unit.", "warning"))
    return found


def second_moment(height: float, width: float, wall: float) -> float:
    """Return I (m^4) of a box about the axis across the plane of the boom."""
    return (width * height**3 - (width - 2 * wall) * (height - 2 * wall) ** 3) / 12


def csv_document(text: str, source: str) -> Document:
    """Return a CSV text as the values of a table: a header, then a row for every section with its joint.

    A column is named as the key in the YAML table, with ``_x``, ``_y`` and the like (`PAIRS`) for one of two numbers, and may
    name a unit: ``length [mm]``. Columns of the base and of the whole boom have one value, in the first row or the same in all;
    a pipe in the first row alone is that of the whole boom. Without columns of the pivot, the pin of section 1 is the origin.
    """
    document = Document({"sections": [], "joints": [], "base": {}})
    try:
        header = text.partition("\n")[0]
        rows = list(csv.reader(text.splitlines(), delimiter=next((mark for mark in ";\t" if mark in header), ",")))
    except csv.Error as error:
        raise SceneError(source, (Fault("table", source, f"not a readable CSV file ({error})", "Export it again."),)) from None
    if len(rows) < 2:
        raise SceneError(source, (Fault("table", source, "no row under the header", "Give a row for every section."),))
    used = min(len(rows[0]), max(map(len, rows[1:])))  # a header may end with an empty cell
    columns = [_column(rows[0], number, source) for number in range(used)]
    filled = [(line, row) for line, row in enumerate(rows[1:], 2) if any(cell.strip() for cell in row)]
    for i, (line, row) in enumerate(filled):
        document.values["sections"].append({})
        document.values["joints"].append({})
        for number, ((key, end, unit), cell) in enumerate(zip(columns, map(str.strip, row), strict=False)):
            others = [other[number].strip() for _, other in filled if number < len(other)]
            home = "" if key == "pipe" and not any(others[1:]) else HOMES[key]
            if home in ("", "base") and i > 0:
                if cell not in ("", others[0]):
                    where, bound = f"{rows[0][number]}, {_letters(number)}{line}", f"the first row has {others[0] or 'none'}"
                    remedy = "It belongs to the whole boom: give it in the first row only, or the same in all."
                    raise SceneError(source, (Fault(where, cell, bound, remedy, line),))
            elif cell:
                place: Place = () if not home else ("base",) if home == "base" else (home, i)
                place = (*place, key) if end is None else (*place, key, PAIRS[end])
                _put(document, place, _value(cell, unit), line)
                document.cells[place] = f"{_letters(number)}{line}"
    document.values["base"].setdefault("pivot", [0.0, 0.0])  # without such columns, the origin is there
    document.values = frozen(document.values)
    return document


HOMES = {
    **dict.fromkeys(Base.model_fields, "base"),
    **dict.fromkeys(DrawnJoint.model_fields, "joints"),
    **dict.fromkeys(BoxSection.model_fields, "sections"),
    **dict.fromkeys(("description", "bulk_modulus", "damping_ratio", "payload", "line_fill"), ""),
}
"""Keys that a column may be named after, with the block that has them."""


def _column(names: list[str], number: int, source: str) -> tuple[str, str | None, str | None]:
    """Return key, ending and unit of a column. Raise SceneError if there is no such key, or an earlier column has the name."""
    columns = [_HEADER.fullmatch(name.strip()) for name in names[: number + 1]]
    column, name = columns[-1], names[number].strip()
    if column is None or column[1] not in HOMES:
        known = f"Known are {', '.join(sorted(HOMES))}."
        raise SceneError(source, (Fault("header", name, "no such column", known, 1),))
    before = next(i for i, other in enumerate(columns) if other and other.group(1, 2) == column.group(1, 2))
    if before < number:
        bound = f"columns {_letters(before)} and {_letters(number)} have the same name"
        raise SceneError(source, (Fault("header", name, bound, "Correct one, or remove it.", 1),))
    return column[1], column[2], column[3]


def _letters(column: int) -> str:
    """Return the spreadsheet name of a column, counted from 0: A to Z, AA, .."""
    return (_letters(column // 26 - 1) if column > 25 else "") + chr(ord("A") + column % 26)


def _value(cell: str, unit: str | None) -> Any:
    if NUMBER.fullmatch(cell):
        return float(cell) if unit is None else f"{cell} {unit}"
    return cell


def _put(document: Document, place: Place, value: Any, line: int) -> None:
    block: Any = document.values
    is_half = isinstance(place[-1], int)
    for step in place[:-2] if is_half else place[:-1]:
        block = block[step]
    if is_half:
        if not isinstance(block.get(place[-2]), list):
            block[place[-2]] = [None, None]
        block = block[place[-2]]
    block[place[-1]] = value
    for depth in range(1, len(place) + 1):
        document.lines.setdefault(place[:depth], line)


def frozen(value: Any) -> Any:
    """Return a value with tuples for its lists, as the reader of YAML gives them."""
    if isinstance(value, dict):
        return {key: frozen(item) for key, item in value.items()}
    return tuple(map(frozen, value)) if isinstance(value, list) else value
