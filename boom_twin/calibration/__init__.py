"""Parameters of a boom from recorded sessions, by maximum likelihood with the twin's filter, with intervals.

docs/calibrate.md explains the method and the sessions that it needs.
"""

from __future__ import annotations

from .run import Calibration, Estimate, calibrate
from .unknowns import Choice

__all__ = ["Calibration", "Choice", "Estimate", "calibrate"]
