"""Frozen values of the model at one stamp: prediction, its outline, the estimate from all sensors, clocks of streams."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # commands that only look at a bag start without NumPy
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Outline:
    """Outline of one prediction: ``shape``, ``undeflected`` and ``pins``, see `Prediction`, m."""

    shape: Array
    undeflected: Array
    pins: Array


@dataclass(frozen=True, slots=True)
class Clock:
    """Clock of a stream against that of the strokes, as estimated."""

    lag: float
    lag_sigma: float
    """By which its stamps are late, and the standard deviation, s."""
    drift: float
    drift_sigma: float
    """Rate at which the lag grows, and the standard deviation; 1e-6 is 1 ppm."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """Prediction of the model at the stamp of one stroke sample (model frame: x forward, y up).

    Attributes
    ----------
    stamp : int
        Nanoseconds.
    tip_position, tip_displacement, tip_velocity, tip_acceleration : ndarray, shape (2,)
        m, m, m/s, m/s^2. Displacement is against rigid sections on incompressible cylinders at the same strokes.
    tip_angle, tip_angular_velocity, tip_angular_acceleration : float
        Of the last section's head; rad, rad/s, rad/s^2.
    joints, strokes, cylinder_forces : ndarray, shape (n,)
        rad; m (as estimated); N (positive in tension).
    shape : ndarray, shape (k, 2), or None
        Points of the deflected centre line from the base pivot to the tip, m; at the first stamp of every 100 ms.
    undeflected : ndarray, shape (k, 2), or None
        The same points of rigid sections on incompressible cylinders at the same strokes, m; when `shape` is there.
    pins : ndarray, shape (n, 4), or None
        Barrel pin (x, y) and rod pin (x, y) of every cylinder of the deflected boom, m; when `shape` is there.
    clearances : ndarray, shape (k, 4), or None
        Of every pin with clearance the journal's offset x, y (m), contact force (N), and 1 where it touches.
    moments : ndarray, shape (k,), or None
        Bending moment (N m) at the stations of `boom_twin.analysis.bending_stress`, positive where it bends the outer end up.
    """

    stamp: int
    tip_position: Array
    tip_displacement: Array
    tip_velocity: Array
    tip_acceleration: Array
    tip_angle: float
    tip_angular_velocity: float
    tip_angular_acceleration: float
    joints: Array
    strokes: Array
    cylinder_forces: Array
    shape: Array | None = None
    undeflected: Array | None = None
    pins: Array | None = None
    clearances: Array | None = None
    moments: Array | None = None


@dataclass(frozen=True, slots=True)
class Estimate:
    """Estimate of the tip from all sensors at the stamp of one stroke sample (model frame: x forward, y up).

    Attributes
    ----------
    stamp : int
        Nanoseconds.
    tip, velocity, acceleration : ndarray, shape (3,)
        x, y (m) and angle (rad) of the last head at the tip; their first and second derivatives.
    load : ndarray, shape (2,)
        Force at the tip that the model does not know, N.
    modes, mode_rates : ndarray, shape (6,)
        Coordinates (m) of the natural modes at a modal mass of 1 kg, lowest first, and their rates (m/s). They are about the
        static equilibrium of the deflected boom; a positive one lifted the tip where the model began. NaN beyond its last mode.
    tip_covariance, velocity_covariance, acceleration_covariance : ndarray, shape (6,)
        Upper triangles by rows of the covariance of `tip`, `velocity` and `acceleration`.
    load_variance : ndarray, shape (2,)
        N^2.
    """

    stamp: int
    tip: Array
    velocity: Array
    acceleration: Array
    load: Array
    modes: Array
    mode_rates: Array
    tip_covariance: Array
    velocity_covariance: Array
    acceleration_covariance: Array
    load_variance: Array
