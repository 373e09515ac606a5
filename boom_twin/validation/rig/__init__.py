"""The virtual rig: an independent model of the boom in Exudyn, its sensors and its sessions.

Nothing here is part of the twin, and nothing of the twin's equations is used here. Scene parameters are surrogates and
every session is synthetic. Needs the extra ``peers``.
"""

from __future__ import annotations

from .exudyn.solve import at_rest, move, simulate, statics
from .exudyn.stepping import Effort, Scheme
from .motion import BUNDLED_DURATION, Move, Programme, bundled, random_programme, through_postures
from .sensors import Sensors, noise_free
from .session import RigSession, observe, record

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
    "noise_free",
    "observe",
    "random_programme",
    "record",
    "simulate",
    "statics",
    "through_postures",
]
