"""What is there: validated parts and the boom, their words, units and bounds."""

from __future__ import annotations

from .load import load_scene
from .schema import Scene

__all__ = ["Scene", "load_scene"]
