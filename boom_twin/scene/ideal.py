"""For models that know ideal pins only."""

from __future__ import annotations

from ..errors import UsageError
from .parts import Scene


def refuse_clearance(scene: Scene, model: str) -> None:
    """UsageError if `scene` has pins with clearance, which `model` (as a reader would call it) does not know."""
    pins = () if scene.clearance is None else scene.clearance.pins
    if pins:
        names = ", ".join(pin.at for pin in pins)
        raise UsageError(f"clearance.pins = {names}: {model} knows ideal pins only. Leave out the block `clearance`.")
