"""Every single value against `boom_twin.scene.parts`: keys, types, bounds."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ValidationError

from ..errors import Fault
from .draft import Draft
from .glossary import BLOCKS
from .messages import unknown_key, value_fault
from .parts import Scene
from .read import Document, Place

EMPTY: tuple[Any, ...] = (None, {}, ())
LISTS = ("sections", "joints", "pins")


def structure(document: Document) -> tuple[Scene | None, Draft, list[Fault]]:
    """The scene if every value is good by itself, else None; what is usable of it; and all faults of single values."""
    values, faults = _known(document, document.values, Scene, ())
    broken: set[Place] = set()
    scene: Scene | None = None
    try:
        scene = Scene.model_validate(values, strict=True)
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            place: Place = detail["loc"]
            faults.append(value_fault(document, detail, place))
            broken.add(place[:2] if place[:1] in (("sections",), ("joints",), ("postures",)) else place[:1])
    return scene, _draft(document, values, broken), faults


def _draft(document: Document, values: Any, broken: set[Place]) -> Draft:
    """The usable parts of `values`: everything that is neither in `broken` nor inside it."""
    if not isinstance(values, dict):
        return Draft(document)
    usable = {key: value for key, value in values.items() if (key,) not in broken}
    blocks: dict[str, Any] = {}
    for key, value in usable.items():
        model = BLOCKS[Scene].get(key)
        if key in ("sections", "joints") and model is not None:
            items = enumerate(value)
            blocks[key] = tuple(None if (key, i) in broken else model.model_validate(v, strict=True) for i, v in items)
        elif key == "postures":
            blocks[key] = {name: angles for name, angles in value.items() if (key, name) not in broken}
        elif key != "description":
            blocks[key] = value if model is None else model.model_validate(value, strict=True)
    return Draft(document, **blocks)


def _known(document: Document, values: Any, model: type[BaseModel], place: Place) -> tuple[Any, list[Fault]]:
    """`values` without unknown keys and without empty ones, and a fault for every unknown key."""
    if not isinstance(values, dict):
        return values, []
    known: dict[str, Any] = {}
    faults: list[Fault] = []
    for key, value in values.items():
        here = (*place, key)
        inner = BLOCKS.get(model, {}).get(key)
        if key not in model.model_fields:
            faults.append(unknown_key(document, here, value, model))
        elif value in EMPTY:
            continue
        elif key in LISTS and inner is not None:
            if not isinstance(value, tuple):
                known[key] = value
                continue
            pairs = [_known(document, item, inner, (*here, i)) for i, item in enumerate(value)]
            known[key] = tuple(item for item, _ in pairs)
            faults += [fault for _, found in pairs for fault in found]
        elif inner is not None:
            known[key], found = _known(document, value, inner, here)
            faults += found
        else:
            known[key] = value
    return known, faults
