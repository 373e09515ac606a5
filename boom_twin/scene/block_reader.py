"""Plain values of a file to a validated block: unknown keys, quantities with units, pydantic's errors in the file's words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from ..errors import Fault
from .checks.findings import unknown_key, value_fault
from .format import Format
from .units import converted, unit_of
from .yaml_reader import Document, Place

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

Root = TypeVar("Root", bound=BaseModel)
EMPTY: tuple[Any, ...] = (None, {}, ())
LISTS = ("sections", "joints", "pins")


@dataclass(frozen=True)
class Validated(Generic[Root]):
    """Content of a document, with the faults of its values.

    Attributes
    ----------
    block : BaseModel or None
        The whole, if every value is good by itself.
    known : object
        The plain values without unknown keys.
    broken : frozenset of Place
        Where values are not good.
    faults : tuple of Fault
        Of single values and unknown keys.
    """

    block: Root | None
    known: Any
    broken: frozenset[Place]
    faults: tuple[Fault, ...]


def validated(document: Document, form: Format[Root]) -> Validated[Root]:
    """The block that a document of this format holds, with all faults of single values."""
    known, faults = _known(document, form, document.values, form.root, ())
    try:
        return Validated(form.root.model_validate(known, strict=True), known, frozenset(), tuple(faults))
    except ValidationError as error:
        details = [each for each in error.errors(include_url=False) if not _counts_faulty(each)]
    faults += [value_fault(document, form, detail, detail["loc"]) for detail in details]
    return Validated(None, known, frozenset(detail["loc"] for detail in details), tuple(faults))


def _counts_faulty(detail: ErrorDetails) -> bool:
    """Return True if a list is called too short because its entries are faulty; each of them has a fault of its own."""
    return detail["type"] == "too_short" and detail["loc"] in (("sections",), ("joints",)) and len(detail["input"]) > 0


def _known(document: Document, form: Format[Any], block: Any, model: type[BaseModel], place: Place) -> tuple[Any, list[Fault]]:
    """A block without unknown keys and without empty ones, quantities in their keys' units; a fault for every unknown key."""
    if not isinstance(block, dict):
        return block, []
    known: dict[str, Any] = {}
    faults: list[Fault] = []
    for key, value in block.items():
        here = (*place, key)
        inner = form.blocks.get(model, {}).get(key)
        if key not in model.model_fields:
            faults.append(unknown_key(document, form, here, value, model))
        elif value in EMPTY:
            continue
        elif key in LISTS and inner is not None:
            if not isinstance(value, tuple):
                known[key] = value
                continue
            pairs = [_known(document, form, item, inner, (*here, i)) for i, item in enumerate(value)]
            known[key] = tuple(item for item, _ in pairs)
            faults += [fault for _, found in pairs for fault in found]
        elif inner is not None:
            known[key], found = _known(document, form, value, inner, here)
            faults += found
        else:
            known[key] = converted(value, unit_of(form.meaning[model].get(key, "")))
    return known, faults
