"""Checks of a scene beyond single values: the scene with the document that it was read from, and what the checks find."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ...config.yaml_text import Document, Place
from ...errors import Fault
from ..schema import Scene

Findings = Iterator[Fault]  # faults and warnings, as a check yields them


@dataclass(frozen=True)
class Draft:
    """A scene whose values are good one by one, and its document, which gives lines."""

    document: Document
    scene: Scene

    def fault(self, place: Place, value: Any, bound: str, remedy: str) -> Fault:
        """Return a fault: the scene cannot be used."""
        return self.document.fault(place, value, bound, remedy)

    def warning(self, place: Place, value: Any, bound: str, remedy: str) -> Fault:
        """Return a warning: the scene can be used, but this is probably not meant."""
        return self.document.fault(place, value, bound, remedy, "warning")

    def expect(
        self,
        place: Place,
        value: float,
        limits: tuple[float, float],
        unit: float,
        where: str,
        remedy: str,
        *,
        measured: float | None = None,
        says: str = "",
    ) -> Findings:
        """Yield a warning if a value is not within `limits` times `unit`, with the words `says` and `where` around the range.

        `measured` is judged instead of the value, if it is given.
        """
        low, high = (limit * unit for limit in limits)
        if not low <= (value if measured is None else measured) <= high:
            range_words = f"{low:.3g} to {high:.3g}"
            if low <= 0.0 or math.isinf(high):
                range_words = f"at most {high:.3g}" if low <= 0.0 else f"at least {low:.3g}"
            yield self.warning(place, value, f"{says}expected {range_words}{where}", remedy)
