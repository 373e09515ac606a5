"""Twin of a boom whose sessions have drives for strokes: what tests of the models of drives feed it with."""

from __future__ import annotations

from typing import Any

from boom_twin import Twin
from boom_twin.types import StrokeReading


def drive_twin(*arguments: Any, **options: Any) -> Twin:
    """Return a twin that takes its stroke samples for drives."""
    return Twin(*arguments, reads=StrokeReading.DRIVE, **options)
