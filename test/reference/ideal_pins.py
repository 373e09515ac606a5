"""Refusal of scenes that a model with ideal pins, or with a rigid base, does not know."""

from __future__ import annotations

from boom_twin import Scene
from boom_twin.errors import UsageError


def refuse_clearance(scene: Scene, model: str) -> None:
    """Raise UsageError if `scene` has pins with clearance, which `model` (as a reader would call it) does not know."""
    pins = () if scene.clearance is None else scene.clearance.pins
    if pins:
        names = ", ".join(pin.at for pin in pins)
        raise UsageError(f"clearance.pins = {names}: {model} knows ideal pins only. Leave out the block `clearance`.")


def refuse_elastic_base(scene: Scene, model: str) -> None:
    """Raise UsageError if `scene` has an elastic base, which `model` does not know."""
    if scene.base.stiffness is not None:
        raise UsageError(f"base.stiffness = {scene.base.stiffness:g} N m/rad: {model} knows a rigid base only. Leave it out.")
