"""What a check returns: a fault that stops, or an oddity that only warns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..errors import Fault
from .draft import Draft
from .read import Place


@dataclass(frozen=True)
class Finding:
    """A `Fault` and whether the scene can be used all the same (`odd`)."""

    fault: Fault
    odd: bool


def wrong(draft: Draft, place: Place, value: Any, bound: str, remedy: str) -> Finding:
    """The scene cannot be used."""
    return Finding(draft.document.fault(place, value, bound, remedy), odd=False)


def odd(draft: Draft, place: Place, value: Any, bound: str, remedy: str) -> Finding:
    """The scene can be used, but this is probably not meant."""
    return Finding(draft.document.fault(place, value, bound, remedy), odd=True)
