"""Description of a kind of file: its outermost block, and the meaning, home and inner blocks of all keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from pydantic import BaseModel

from .glossary import BLOCKS, HOME, MEANING
from .schema import Scene
from .yaml_reader import Place

Root = TypeVar("Root", bound=BaseModel)


@dataclass(frozen=True)
class Format(Generic[Root]):
    """A kind of file.

    Attributes
    ----------
    root : type of BaseModel
        The block that is the whole file.
    meaning : mapping
        Meaning and unit of every key, by block.
    home : mapping
        Where a block stands, in words.
    blocks : mapping
        The blocks inside a block, by key.
    """

    root: type[Root]
    meaning: Mapping[type[BaseModel], Mapping[str, str]]
    home: Mapping[type[BaseModel], str]
    blocks: Mapping[type[BaseModel], Mapping[str, type[BaseModel]]]

    def meaning_at(self, place: Place) -> str:
        """Words and unit of the key at or around a place, empty if there are none."""
        model: type[BaseModel] = self.root
        meaning = ""
        for step in place:
            if isinstance(step, int):
                meaning = self._items.get(meaning, meaning)
            else:
                meaning = self.meaning[model].get(step, meaning)
                model = self.blocks.get(model, {}).get(step, model)
        return "section angles to the horizontal, degrees" if place[:1] == ("postures",) and len(place) > 1 else meaning

    @property
    def _items(self) -> dict[str, str]:
        return {self.meaning[self.root][key]: "a block of keys, as in the default scene" for key in ("sections", "joints")}


SCENE = Format(Scene, MEANING, HOME, BLOCKS)
