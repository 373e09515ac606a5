"""Validation of a file's plain values: unknown keys, quantities with units, pydantic errors in the file's terms.

A value with a unit of its own, such as ``8500 mm``, is turned into the unit that the description of its key states. With
decimal arithmetic ``3860 mm`` and ``3.86`` are the same number.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from decimal import Decimal
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError

from ..config.yaml_text import Document, Place, words
from ..errors import ABSENT, Fault, bound_of

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

Root = TypeVar("Root", bound=BaseModel)
EMPTY: tuple[Any, ...] = (None, {}, ())
ITEM = "a block of keys, as in the default scene"
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
LONGEST_NUMBER, LONGEST_WITH_UNIT = 40, 60  # characters of a text that may be a misspelt number, a number with its unit


def validated(document: Document, root: type[Root]) -> tuple[Root | None, list[Fault]]:
    """Return the document as a block of type `root`, and the faults of single values and unknown keys.

    The block is None if any single value is faulty; unknown keys are left out.
    """
    faults: list[Fault] = []
    known = _known(document, root, document.values, root, (), faults)
    try:
        return root.model_validate(known, strict=True), faults
    except ValidationError as error:
        details = [each for each in error.errors(include_url=False) if not _counts_faulty(each)]
    return None, faults + [_value_fault(document, root, detail) for detail in details]


def _counts_faulty(detail: ErrorDetails) -> bool:
    """Return True if pydantic reports a list as too short only because its entries are faulty. These have their own faults."""
    return detail["type"] == "too_short" and detail["loc"] in (("sections",), ("joints",)) and len(detail["input"]) > 0


def _known(
    document: Document, root: type[BaseModel], block: Any, model: type[BaseModel], place: Place, faults: list[Fault]
) -> Any:
    """Return a block without unknown and empty keys, quantities in the units of their keys. Add unknown keys to `faults`."""
    if not isinstance(block, dict):
        return block
    known: dict[str, Any] = {}
    for key, value in block.items():
        here, inner = (*place, key), inner_block(model, key)
        if key not in model.model_fields:
            faults.append(_unknown_key(document, root, here, value, model))
        elif value in EMPTY:
            continue
        elif inner is None:
            known[key] = converted(value, unit_of(meaning_of(model, key)))
        elif not _is_list(model, key):
            known[key] = _known(document, root, value, inner, here, faults)
        elif isinstance(value, tuple):
            known[key] = tuple(_known(document, root, item, inner, (*here, i), faults) for i, item in enumerate(value))
        else:
            known[key] = value
    return known


# -- meanings and blocks of keys --------------------------------------------------------------------------------------


def meaning_of(model: type[BaseModel], key: str) -> str:
    """Return meaning and unit of a key, for error messages."""
    return model.model_fields[key].description or ""


def inner_block(model: type[BaseModel], key: str) -> type[BaseModel] | None:
    """Return the block type of a key's value, or of its list items; None for plain values and unknown keys."""
    return _block(model.model_fields[key].annotation) if key in model.model_fields else None


def _block(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_block, get_args(annotation))), None)


def _is_list(model: type[BaseModel], key: str) -> bool:
    return get_origin(model.model_fields[key].annotation) is tuple


def _homes(model: type[BaseModel], place: str = "") -> Iterator[tuple[type[BaseModel], str]]:
    """Yield every block type of a file with its place, the top level first."""
    yield model, place or "the top level"
    for key in model.model_fields:
        if (inner := inner_block(model, key)) is not None:
            yield from _homes(inner, f"{place}.{key}".lstrip(".") + "[i]" * _is_list(model, key))


def meaning_at(root: type[BaseModel], place: Place) -> str:
    """Return meaning and unit of the nearest described key at or above `place`; empty if there is none."""
    if place[:1] == ("postures",) and len(place) > 1:
        return "section angles to the horizontal, degrees"
    model: type[BaseModel] = root
    meaning = ""
    for step in place:
        if isinstance(step, int):
            meaning = ITEM if meaning.startswith("a list with one block") else meaning
        elif step in model.model_fields:
            meaning, model = meaning_of(model, step), inner_block(model, step) or model
    return meaning


# -- units -----------------------------------------------------------------------------------------------------------


_DEGREE, _RADIAN = "0.01745329251994329576923690768", "57.29577951308232087679815481"
UNITS: dict[str, dict[str, str]] = {
    "m": {"mm": "1e-3", "cm": "1e-2", "dm": "0.1", "km": "1e3", "in": "0.0254", "ft": "0.3048"},
    "m^2": {"mm2": "1e-6", "cm2": "1e-4"},
    "m^3": {"mm3": "1e-9", "cm3": "1e-6", "dm3": "1e-3", "l": "1e-3", "L": "1e-3", "ml": "1e-6"},
    "m^4": {"mm4": "1e-12", "cm4": "1e-8"},
    "kg": {"g": "1e-3", "t": "1e3", "lb": "0.45359237"},
    "kg/m": {"kg/mm": "1e3", "g/mm": "1", "t/m": "1e3"},
    "kg/m^3": {"g/cm3": "1e3", "kg/dm3": "1e3", "kg/l": "1e3", "t/m3": "1e3"},
    "kg m": {"kg cm": "1e-2", "kg mm": "1e-3", "t m": "1e3"},
    "kg m^2": {"kg cm2": "1e-4", "kg mm2": "1e-6", "t m2": "1e3"},
    "N/m": {"kN/m": "1e3", "MN/m": "1e6", "N/mm": "1e3", "kN/mm": "1e6", "kN/cm": "1e5", "daN/mm": "1e4"},
    "N s/m": {"kN s/m": "1e3", "N s/mm": "1e3", "kN s/mm": "1e6"},
    "N m/rad": {"kN m/rad": "1e3", "MN m/rad": "1e6", "N m/deg": _RADIAN, "kN m/deg": f"{_RADIAN}e3"},
    "N m s/rad": {"kN m s/rad": "1e3", "MN m s/rad": "1e6"},
    "Pa": {"kPa": "1e3", "MPa": "1e6", "GPa": "1e9", "N/mm2": "1e6", "bar": "1e5", "psi": "6894.757293168361336722673"},
    "m/s^2": {"mm/s2": "1e-3", "cm/s2": "1e-2"},
    "s": {"us": "1e-6", "ms": "1e-3", "min": "60"},
    "rad": {"mrad": "1e-3", "deg": _DEGREE, "degrees": _DEGREE, "°": _DEGREE},
    "degrees": {"deg": "1", "degree": "1", "°": "1", "rad": _RADIAN},
}
"""Units that a value may have instead of the stated one, and their sizes in that."""
_STATED = re.compile(rf"(?:,| in) ({'|'.join(map(re.escape, sorted(UNITS, key=len, reverse=True)))})(?![\w^/])")
_QUANTITY = re.compile(rf"(?P<number>{NUMBER.pattern})\s*(?P<unit>[A-Za-zµ°][\w\s/*^·²³⁴°]*)")


def unit_of(meaning: str) -> str | None:
    """Return the unit that the meaning of a key states, for example ``kg m^2``; None for a pure number."""
    found = _STATED.search(meaning)
    return None if found is None else found[1]


def converted(value: Any, unit: str | None) -> Any:
    """Return `value` with texts such as ``8500 mm`` converted to numbers in `unit`; everything else unchanged."""
    if isinstance(value, tuple):
        return tuple(converted(item, unit) for item in value)
    if isinstance(value, dict):
        return {key: converted(item, unit) for key, item in value.items()}
    found = quantity(value, unit) if isinstance(value, str) else None
    return found if isinstance(found, float) else value


def quantity(text: str, unit: str | None) -> float | str | None:
    """Return a number with a unit as a number in `unit`, or why it cannot be one; None for any other text."""
    text = text.strip()
    found = None if len(text) > LONGEST_WITH_UNIT or NUMBER.fullmatch(text) else _QUANTITY.fullmatch(text)
    if found is None:
        return None
    number, name = found["number"], found["unit"]
    if unit is None:
        return f"a number without a unit is needed, and this one has `{name}`"
    known = UNITS[unit] | {_spelling(unit): "1"}
    if (factor := known.get(_spelling(name))) is None:
        return f"`{name}` is no unit of this key, which is in {unit}; known are {', '.join(known)}"
    try:
        return float(Decimal(number) * Decimal(factor))
    except (ArithmeticError, ValueError):
        return f"`{number}` is no number that can be had in {unit}"


def _spelling(unit: str) -> str:
    """Return a unit as `UNITS` spells it: ``kg cm2`` for ``kg·cm^2``."""
    plain = unit.translate(str.maketrans("²³⁴μ", "234µ")).replace("**", "").replace("^", "")
    return re.sub(r"\s*/\s*", "/", re.sub(r"[\s*·]+", " ", plain)).strip()


# -- messages about refused values ------------------------------------------------------------------------------------


NEEDED = {
    "string_type": "text",
    "tuple_type": "a list",
    "bool_type": "true or false",
    "dict_type": "a block of keys",
    "model_type": "a block of keys",
}
"""Kinds of values in the file's terms, by the type of pydantic's error."""


def _unknown_key(document: Document, root: type[BaseModel], place: Place, value: Any, model: type[BaseModel]) -> Fault:
    """Return the fault of a key that `model` lacks, with the nearest known key and the blocks that have this key."""
    key = str(place[-1])
    if key.isdigit() and value is None:
        bound = "a number stands where a key is expected"
        return document.fault(place, value, bound, "Decimals take a point, not a comma.")
    here = {name.lower(): name for name in reversed(model.model_fields)}
    near = difflib.get_close_matches(key.lower(), here, n=1, cutoff=0.0)
    remedy = f"The nearest known key here is `{here[near[0]]}`."
    homes = [home for other, home in _homes(root) if other is not model and key in other.model_fields]
    if homes:
        remedy = f"`{key}` is a key of {' or '.join(homes)}. " + remedy
    elif not difflib.get_close_matches(key.lower(), here, n=1):
        remedy += f" All of them: {', '.join(model.model_fields)}."
    where = f"in {words(place[:-1])}" if len(place) > 1 else "at the top level"
    return document.fault(place, value, f"unknown key {where}", remedy)


def _value_fault(document: Document, root: type[BaseModel], detail: ErrorDetails) -> Fault:
    """Return the fault for a pydantic error, in the file's terms."""
    place, kind, value = detail["loc"], detail["type"], detail["input"]
    meaning = meaning_at(root, place)
    give = f"Give {meaning}." if meaning else "Give such a value."
    if kind == "missing" and not isinstance(place[-1], int):
        return document.fault(place, ABSENT, "it is needed", give)
    if kind == "missing" or kind in ("too_long", "too_short"):
        return _length_fault(document, detail, place, give)
    if kind in ("float_type", "int_type", "int_from_float", "float_parsing", "int_parsing"):
        whole = "a whole number" if kind.startswith("int") else "a number"
        unfit = quantity(value, unit_of(meaning)) if isinstance(value, str) else None
        if isinstance(unfit, str):
            return document.fault(place, value, unfit, give)
        bound = f"{whole} is needed, not {_what(value)}"
        return document.fault(place, value, bound, _number_remedy(value, give))
    if kind == "string_type":
        give = "Put it in quotes."
    bound = f"{NEEDED[kind]} is needed, not {_what(value)}" if kind in NEEDED else bound_of(detail["msg"])
    return document.fault(place, value, bound, give)


def _length_fault(document: Document, detail: ErrorDetails, place: Place, give: str) -> Fault:
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
    if not isinstance(value, str):
        return give
    text = value.strip()
    if len(text) > LONGEST_NUMBER:
        return give
    pointed = text.replace(",", ".", 1)
    if NUMBER.fullmatch(text):
        return f"Write it without quotes: {text}."
    if NUMBER.fullmatch(pointed):
        return f"Write a decimal point: {pointed}."
    return give
