"""What is there: validated parts and the boom, their words, units and bounds."""

from .load import load_scene
from .parts import Scene

__all__ = ["Scene", "load_scene"]
