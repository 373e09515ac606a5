"""Load of a concrete pump on the tip: rectangular pulses with eased flanks, on for half of each period.

A piston pump turns its valve over at the end of every stroke, within about 0.1 s. Form and magnitudes are surrogates.
"""

from __future__ import annotations

import math

import numpy as np

from ..types import Array

CHANGE_OVER = 0.1  # s from no force to the full one, and back


def ease(x: Array) -> Array:
    """Ease from 0 to 1 over x in [0, 1] by a quintic with zero rate and acceleration at both ends."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x**3 * (10.0 - 15.0 * x + 6.0 * x**2))


def pump_pulses(times: Array, frequency: float, change_over: float = CHANGE_OVER) -> Array:
    """Return share of the full force at `times` (m,), in s from the first pulse: pulses of `frequency` (Hz), none before."""
    into = np.maximum(times, 0.0) % (1.0 / frequency)
    return np.asarray(ease(into / change_over) - ease((into - 0.5 / frequency) / change_over))


def upward(inclination: float) -> Array:
    """Return the unit vector (2,) of the vertical in the axes of a base that is inclined so (rad)."""
    return np.array([math.sin(inclination), math.cos(inclination)])
