"""The virtual rig: an independent model of the boom in Exudyn, its sensors and its sessions.

Nothing here is part of the twin, and nothing of the twin's equations is used here. Scene parameters are surrogates and
every session is synthetic. Needs the extra ``peers``.
"""

from .motion import Move, Programme
from .programmes import BUNDLED_DURATION, bundled, random_programme
from .sensors import Sensors, noise_free
from .session import Session, observe, record
from .solve import at_rest, move, simulate, statics
from .stepping import Effort, Scheme

__all__ = [
    "BUNDLED_DURATION",
    "Effort",
    "Move",
    "Programme",
    "Scheme",
    "Sensors",
    "Session",
    "at_rest",
    "bundled",
    "move",
    "noise_free",
    "observe",
    "random_programme",
    "record",
    "simulate",
    "statics",
]
