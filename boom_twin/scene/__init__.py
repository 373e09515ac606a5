"""Validated parts of a scene and the boom that they make, with their keys, units and bounds."""

from __future__ import annotations

from .load import load_scene
from .schema import Scene

__all__ = ["Scene", "load_scene"]
