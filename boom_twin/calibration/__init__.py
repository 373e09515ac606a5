"""Parameters of a boom from recorded sessions: nonlinear least squares on the twin's model, with intervals.

See docs/calibrate.md for what it does and what sessions it needs.
"""

from __future__ import annotations

from .run import Calibration, Estimate, calibrate
from .unknowns import Choice

__all__ = ["Calibration", "Choice", "Estimate", "calibrate"]
