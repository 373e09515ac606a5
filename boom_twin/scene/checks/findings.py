"""Findings of the scene checks: faults, warnings, the partly validated scene they look at, the words of a refused value."""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from ...errors import ABSENT, Fault
from ..format import Format
from ..schema import Base, Clearance, Joint, Material, Modes, Point, Section, Tip
from ..units import misfit, unit_of
from ..yaml_reader import NUMBER, Document, Place, words


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


BOUNDS = {
    "finite_number": "it must be a finite number",
    "greater_than": "it must be greater than {gt:g}",
    "greater_than_equal": "it must not be less than {ge:g}",
    "less_than": "it must be less than {lt:g}",
    "less_than_equal": "it must not be more than {le:g}",
    "literal_error": "it must be {expected}",
    "string_type": "text is needed, not {what}",
    "tuple_type": "a list is needed, not {what}",
    "bool_type": "true or false is needed, not {what}",
    "dict_type": "a block of keys is needed, not {what}",
    "model_type": "a block of keys is needed, not {what}",
}

LONGEST = 40  # characters of a text that is taken for a number


def unknown_key(document: Document, form: Format[Any], place: Place, value: Any, model: type[BaseModel]) -> Fault:
    """A key that `model` does not have: the nearest one, and where the key belongs if it is known elsewhere."""
    key = str(place[-1])
    if key.isdigit() and value is None:
        bound = "a number stands where a key is expected"
        return document.fault(place, value, bound, "Decimals take a point, not a comma.")
    here = {name.lower(): name for name in reversed(model.model_fields)}
    near = difflib.get_close_matches(key.lower(), here, n=1, cutoff=0.0)
    remedy = f"The nearest known key here is `{here[near[0]]}`."
    homes = [form.home[other] for other in form.meaning if other is not model and key in other.model_fields]
    if homes:
        remedy = f"`{key}` is a key of {' or '.join(homes)}. " + remedy
    elif not difflib.get_close_matches(key.lower(), here, n=1):
        remedy += f" All of them: {', '.join(model.model_fields)}."
    where = f"in {words(place[:-1])}" if len(place) > 1 else "at the top level"
    return document.fault(place, value, f"unknown key {where}", remedy)


def value_fault(document: Document, form: Format[Any], detail: ErrorDetails, place: Place) -> Fault:
    """A pydantic error in the words of the file."""
    kind, value, limits = detail["type"], detail["input"], detail.get("ctx", {})
    meaning = form.meaning_at(place)
    give = f"Give {meaning}." if meaning else "Give such a value."
    if kind == "missing" and not isinstance(place[-1], int):
        return document.fault(place, ABSENT, "it is needed", give)
    if kind == "missing" or kind in ("too_long", "too_short"):
        return _length_fault(document, detail, place, give)
    if kind in ("float_type", "int_type", "int_from_float", "float_parsing", "int_parsing"):
        whole = "a whole number" if kind.startswith("int") else "a number"
        unfit = misfit(value, unit_of(meaning)) if isinstance(value, str) else None
        if unfit is not None:
            return document.fault(place, value, unfit, give)
        bound = f"{whole} is needed, not {_what(value)}"
        return document.fault(place, value, bound, _number_remedy(value, give))
    if kind == "string_type":
        give = "Put it in quotes."
    bound = BOUNDS[kind].format(what=_what(value), **limits) if kind in BOUNDS else detail["msg"]
    return document.fault(place, value, bound, give)


def _length_fault(document: Document, detail: ErrorDetails, place: Place, give: str) -> Fault:
    """A list with too few or too many entries."""
    if detail["type"] == "missing":
        place = place[:-1]
    value = detail["input"]
    found = len(value) if isinstance(value, tuple) else 0
    if place in (("sections",), ("joints",)):
        return document.fault(place, value, "at least one entry is needed", give)
    bound = f"a list of 2 numbers is needed, it has {found}"
    if found > 2:
        give += " Decimals take a point, not a comma."
    return document.fault(place, value, bound, give)


def _what(value: Any) -> str:
    """Return the kind of a value, in a newcomer's words."""
    if isinstance(value, bool):
        return "true or false"
    if isinstance(value, str):
        return "text"
    if isinstance(value, int | float):
        return "a whole number" if isinstance(value, int) else "a decimal number"
    if value is None:
        return "nothing"
    return "a list" if isinstance(value, tuple) else "a block"


def _number_remedy(value: Any, give: str) -> str:
    """Return the remedy for a value that should be a number."""
    if not isinstance(value, str):
        return give
    text = value.strip()
    if len(text) > LONGEST:
        return give
    pointed = text.replace(",", ".", 1)
    if NUMBER.fullmatch(text):
        return f"Write it without quotes: {text}."
    if NUMBER.fullmatch(pointed):
        return f"Write a decimal point: {pointed}."
    return give
