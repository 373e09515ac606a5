"""Closed form of a boom that is shaken: three oscillators, exact for a force that is constant between samples."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter

from boom_twin.validation.rig.loads import PumpLoad, WindLoad

RATE, BEFORE, LONG = 200.0, 20.0, 10.0  # Hz; s, under load before the hold, and of it


def record(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Natural frequencies (3,), times (k,) and IMU (k, 2) of a hold under a pump (seed % 3 == 0), wind (1) or both (2)."""
    rng = np.random.default_rng([seed, 91])
    second = rng.uniform(2.2, 4.0)
    frequencies = np.array([rng.uniform(0.85, 1.1), second, second * rng.uniform(2.0, 2.4)])
    dampings, times = rng.uniform(0.006, 0.02, 3), np.arange(0.0, BEFORE + LONG, 1.0 / RATE)
    height = float(np.exp(rng.uniform(np.log(30.0), np.log(300.0))))
    pump, wind = PumpLoad(rng.uniform(0.2, 0.6), height, onset=rng.uniform(0.0, 3.0)), WindLoad(rng.uniform(10.0, 60.0))
    force = np.zeros((len(times), 2))
    if seed % 3 != 1:
        force[:, 1] = pump.force(times, BEFORE + LONG, [seed])
    if seed % 3 != 0:
        force[:, 0] = wind.force(times, BEFORE + LONG, [seed])
    directions = rng.normal(size=(3, 2))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    imu = rng.normal(0.0, 0.05, (len(times), 2))
    for k, (frequency, damping, mass) in enumerate(zip(frequencies, dampings, (400.0, 300.0, 250.0), strict=True)):
        push = force @ directions[k] / mass
        push[int(BEFORE * RATE)] += RATE * 0.15 * rng.normal() / (k + 1)  # the move that the hold ends
        felt = _acceleration(2.0 * math.pi * frequency, damping, push)
        imu += felt[:, None] * directions[k]
    held = times >= BEFORE
    return frequencies, times[held] - BEFORE, imu[held]


def _acceleration(omega: float, damping: float, push: np.ndarray) -> np.ndarray:
    """Of x'' + 2 damping omega x' + omega^2 x = push, and what its tilt lets gravity add."""
    rate = np.array([[0.0, 1.0, 0.0], [-(omega**2), -2.0 * damping * omega, 1.0], [0.0, 0.0, 0.0]])
    step = expm(rate / RATE)
    (a, b), (c, d), (e, f) = step[0, :2], step[1, :2], step[:2, 2]
    denominator = [1.0, -(a + d), a * d - b * c]
    place = lfilter([0.0, e, b * f - d * e], denominator, push)
    speed = lfilter([0.0, f, c * e - a * f], denominator, push)
    return push - (omega**2 - 0.2) * place - 2.0 * damping * omega * speed
