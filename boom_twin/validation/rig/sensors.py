"""Sensor model of the virtual rig: noise, resolution, jitter.

A surrogate: no sensor was measured for it. The instant of sampling is the stamp itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import UsageError
from ...types import SECOND, Array

RATE = 200.0  # Hz
RATES = 50.0, 1000.0  # Hz: jitter reaches half the time between two samples at 2500 Hz, and a motion is recorded at 1000 Hz


@dataclass(frozen=True, slots=True)
class Sensors:
    """Sampling and noise: Hz, s, m, rad, m/s^2, rad/s, N, N m, Pa; a resolution of zero means no rounding.

    Standard deviations are those before rounding. Forces are as of load pins, or of pressures in both chambers: 100 N is a
    thousandth of what the largest cylinder of the default scene bears. UsageError unless the rate is within `RATES`.
    """

    rate: float = RATE
    jitter: float = 2e-4
    stroke_sigma: float = 2e-5
    stroke_resolution: float = 5e-6
    angle_sigma: float = math.radians(0.01)
    angle_resolution: float = math.radians(0.005)
    imu_sigma: float = 0.05
    rate_sigma: float = 2e-3
    force_sigma: float = 100.0
    force_resolution: float = 20.0
    moment_sigma: float = 50.0
    point_sigma: float = 2e-3
    pressure_sigma: float = 1e4

    def __post_init__(self) -> None:
        low, high = RATES
        if not low <= self.rate <= high:
            raise UsageError(f"rate = {self.rate:g}, must be from {low:g} to {high:g} Hz, at which the sensors are sampled.")


def noise_free(rate: float = RATE) -> Sensors:
    """Return sensors that read the true values at the same sampling instants."""
    exact = dict.fromkeys((field.name for field in fields(Sensors) if field.name.endswith(("_sigma", "_resolution"))), 0.0)
    return replace(Sensors(rate), **exact)


def sampling_stamps(sensors: Sensors, duration: float, start: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Draw stamps (ns, int64) within `duration` (s) after `start` (ns), uniformly jittered about the grid.

    The grid begins half a period after the start, so that no jitter reaches beyond either end.
    """
    count = round(duration * sensors.rate)
    instants = (np.arange(count) + 0.5) / sensors.rate + rng.uniform(-sensors.jitter, sensors.jitter, count)
    return start + np.rint(instants * SECOND).astype(np.int64)


def read(true: Array, sigma: float, resolution: float, rng: np.random.Generator) -> Array:
    """Return values with normal noise of `sigma`, rounded to `resolution`; all in one unit, any shape."""
    noisy = true + sigma * rng.standard_normal(true.shape)
    return noisy if resolution == 0.0 else np.asarray(np.rint(noisy / resolution) * resolution)


def specific_force(acceleration: Array, angle: Array, gravity: Array) -> Array:
    """Return the reading of an ideal accelerometer: acceleration minus gravity in its own axes, (m, 2) m/s^2.

    `acceleration` (m, 2), without gravity, and `gravity` (2,) are in the base's axes, `angle` (m,) is that of the x axis
    there, rad.
    """
    fx, fy = acceleration[:, 0] - gravity[0], acceleration[:, 1] - gravity[1]
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * fx + s * fy, -s * fx + c * fy])
