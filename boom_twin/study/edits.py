"""Edits of a scene file as data: a key, and its new value or none; what a user would do in an editor."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from ..retouch import yaml_text
from ..scene.parts import Scene
from ..scene.read import Place, words

Value = bool | int


@dataclass(frozen=True)
class Edit:
    """One key of a scene, its place as in messages about scenes, and what it becomes; None takes it out of the file."""

    place: Place
    value: Value | None

    def __str__(self) -> str:
        if self.value is None:
            return f"remove {words(self.place)}"
        return f"{words(self.place)}: {yaml_text(self.value)}"


def edited(scene: Scene, edits: Iterable[Edit]) -> Scene:
    """The scene that the file describes after all `edits`."""
    for edit in edits:
        scene = _with(scene, edit.place, edit.value)
    return scene


def merged(edits: Iterable[Edit]) -> tuple[Edit, ...]:
    """The same result with one edit a key, the last one, in the order of the places."""
    last = {edit.place: edit for edit in edits}
    return tuple(last[place] for place in sorted(last, key=lambda place: [str(step) for step in place]))


def _with(part: Any, place: Sequence[str | int], value: Value | None) -> Any:
    """`part` (a block, a list, or a value if `place` is empty) with the value at `place` exchanged."""
    if not place:
        return value
    step, rest = place[0], place[1:]
    if isinstance(step, int):
        return tuple(_with(item, rest, value) if i == step else item for i, item in enumerate(part))
    assert isinstance(part, BaseModel)
    return part.model_copy(update={step: _with(getattr(part, step, None), rest, value)})
