"""Resonance map: how far pump pulses swing the tip, over postures and pump rates; which rates to avoid where.

A pulse has many harmonics, so a boom swings most where one of them meets a natural frequency, not only at that frequency
itself: with a first mode at 1.06 Hz already at 0.35 Hz, by the third harmonic.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..errors import UsageError
from ..scene.kinematics import posture_angles, strokes_of_angles
from ..scene.schema import Scene
from ..types import Array
from .equilibrium import checked_strokes
from .frequency_response import LinearisedBoom
from .steady_state import PeriodicLoad, steady_state_of

TOO_MUCH = 1.5  # times the median swing of a posture: such rates are to be avoided
LEAST_SWING = 1e-5  # m; less is no swing, but rounding or a boom without compliance


@dataclass(frozen=True)
class RateToAvoid:
    """A band of rates at which one posture swings too much."""

    posture: str
    low: float  # Hz, lowest rate at which the swing is above `TOO_MUCH` times the posture's median
    high: float  # Hz, highest such rate
    rate: float  # Hz, of the largest swing
    swing: float  # m, the largest
    harmonic: int  # number of the harmonic of the load that moves the tip most there


@dataclass(frozen=True)
class ResonanceMap:
    """Swing of the tip, peak to peak, over p postures and r rates."""

    postures: tuple[str, ...]
    rates: Array  # (r,), rates of the load, Hz
    swing: Array  # (p, r), m
    harmonics: np.ndarray  # (p, r), number of the harmonic of the load that moves the tip most

    def to_avoid(self) -> tuple[RateToAvoid, ...]:
        """The bands to avoid, posture by posture, ascending in rate."""
        found = []
        for name, swing, harmonics in zip(self.postures, self.swing, self.harmonics, strict=True):
            above = np.concatenate([[False], swing > max(TOO_MUCH * float(np.median(swing)), LEAST_SWING), [False]])
            starts, stops = np.flatnonzero(above[1:] & ~above[:-1]), np.flatnonzero(above[:-1] & ~above[1:])
            for start, stop in zip(starts, stops, strict=True):
                peak = start + int(np.argmax(swing[start:stop]))
                found.append(
                    RateToAvoid(
                        name, float(self.rates[start]), float(self.rates[stop - 1]), float(self.rates[peak]),
                        float(swing[peak]), int(harmonics[peak]),
                    )
                )  # fmt: skip
        return tuple(found)


def resonance_map(
    scene: Scene, postures: Mapping[str, Array], rates: Array, load_at: Callable[[float], PeriodicLoad]
) -> ResonanceMap:
    """Return the swing of the tip in the steady state of every posture (joint angles, rad, by name) at every rate (Hz).

    UsageError for a posture out of the cylinders' travel, SolverError for one without a stable equilibrium.
    """
    loads = [load_at(float(rate)) for rate in rates]
    swing, harmonics = np.zeros((len(postures), len(rates))), np.zeros((len(postures), len(rates)), np.int64)
    for i, (name, angles) in enumerate(postures.items()):
        boom = LinearisedBoom(scene, _strokes(scene, name, angles), angles)
        for j, load in enumerate(loads):
            found = steady_state_of(boom, load)
            swing[i, j], harmonics[i, j] = found.swing, 1 + int(np.argmax(found.harmonics))
    return ResonanceMap(tuple(postures), np.asarray(rates, float), swing, harmonics)


def named_postures(scene: Scene) -> dict[str, Array]:
    """Joint angles (rad) of all postures of the scene."""
    return {name: posture_angles(scene, name) for name in scene.postures}


def postures_along(scene: Scene, names: list[str], steps: int) -> dict[str, Array]:
    """Joint angles (rad) along the way from posture to posture, in `steps` even steps of all joints from each to the next."""
    corners = [posture_angles(scene, name) for name in names]
    found = {names[0]: corners[0]}
    for k, (before, after) in enumerate(pairwise(corners)):
        for step in range(1, steps):
            share = step / steps
            found[f"{names[k]} to {names[k + 1]} {100.0 * share:.0f} %"] = before + share * (after - before)
        found[names[k + 1]] = after
    return found


def _strokes(scene: Scene, name: str, angles: Array) -> Array:
    try:
        return checked_strokes(scene, strokes_of_angles(scene, angles))
    except UsageError as error:
        raise UsageError(f"posture {name}: {error} Leave it out, or go another way.") from None
