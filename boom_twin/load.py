"""A boom under another load than its scene has."""

from __future__ import annotations

from .scene.parts import Scene, Tip


def loaded(scene: Scene, payload: float, line_fill: float) -> Scene:
    """The scene with that payload (kg) and line fill (kg/m); below 0 its own."""
    changes: dict[str, object] = {}
    if payload >= 0.0:
        changes["tip"] = (scene.tip or Tip()).model_copy(update={"payload": payload})
    if line_fill >= 0.0:
        changes["line_fill"] = line_fill
    return scene.model_copy(update=changes)
