"""The virtual rig: an independent model of the boom in Exudyn, its sensors and its sessions.

Nothing here is part of the twin, and nothing of the twin's equations is used here. Scene parameters are surrogates and
every session is synthetic. Needs the extra ``peers``: Exudyn is imported here alone.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from ...errors import BoomTwinError

try:
    exudyn: Any = import_module("exudyn")
    items: Any = import_module("exudyn.itemInterface")
except ImportError as missing:
    raise BoomTwinError(
        "boom_twin.validation.rig needs the package exudyn, which is not installed (the twin itself does without it). "
        'Remedy: pip install "boom_twin[peers]"'
    ) from missing

from .motion import BUNDLED_DURATION, Move, Programme, bundled, random_programme, through_postures
from .session import RigSession, Sensors, observe, record
from .solve import at_rest, move, simulate, statics
from .stepping import Effort, Scheme

__all__ = [
    "BUNDLED_DURATION",
    "Effort",
    "Move",
    "Programme",
    "RigSession",
    "Scheme",
    "Sensors",
    "at_rest",
    "bundled",
    "move",
    "observe",
    "random_programme",
    "record",
    "simulate",
    "statics",
    "through_postures",
]
