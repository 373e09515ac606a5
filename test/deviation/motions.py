"""Motions that try the filter on lengths: rests, a sweep, abrupt stops; lengths measured in them, and what the boom does.

The truth is this package's own model in fine steps along the true drives, so that what is left is the filter's error.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from default_boom import strokes_of_posture

from boom_twin import load_scene, simulate
from boom_twin.types import SECOND
from boom_twin.validation.rig.motion import Move, Programme, ease
from boom_twin.validation.rig.session import Sensors, read, sampling_stamps

SECONDS = 12.0
POSTURE = "arch"


class Measured(NamedTuple):
    """Samples of k instants: stamps (ns), lengths and joint angles as measured, the tip's true acceleration (k, 2)."""

    stamps: np.ndarray
    strokes: np.ndarray
    joints: np.ndarray
    acceleration: np.ndarray


def window(times, start, end, width=0.5):
    """From 0 to 1 within `width` s of `start`, and back before `end`."""
    return ease((times - start) / width) - ease((times - end + width) / width)


def swept(times, low, high, start=1.0, end=SECONDS - 1.0):
    """0.3 mm on cylinder 1, from `low` to `high` Hz."""
    along = np.clip(times - start, 0.0, end - start)
    phase = 2.0 * np.pi * (low * along + 0.5 * (high - low) * along**2 / (end - start))
    return np.outer(3e-4 * np.sin(phase) * window(times, start, end), [1.0, 0.0, 0.0, 0.0])


def stopped(times):
    """One cylinder after the other goes at 40 mm/s for half a second, and stops within 20 ms."""
    found = np.zeros((len(times), 4))
    for i in range(4):
        start, end = 1.0 + 2.5 * i, 2.0 + 2.5 * i
        speeds = 0.04 * (ease((times - start) / 0.5) - ease((times - end) / 0.02))
        found[:, i] = np.cumsum(speeds) * (times[1] - times[0])
    return found


def rested(times):
    """Two moves of 40 mm, and rests."""
    first = (0.0, 0.0, 0.0, 0.0)
    return Programme(first, (Move(0, 3.0, 1.5, 0.04), Move(3, 8.0, 2.0, -0.04)))(times)[0]


MOTIONS = {
    "rests": rested,
    "sweep": lambda times: swept(times, 1.0, 6.0),
    "stops": stopped,
    "12 Hz": lambda times: swept(times, 12.0, 12.0),
    "35 Hz": lambda times: swept(times, 35.0, 35.0),
}


@cache
def true_motion(name):
    """Return the boom's motion in steps of 0.5 ms."""
    scene, times = load_scene(), 5e-4 * np.arange(round(SECONDS / 5e-4) + 1)
    strokes = strokes_of_posture(scene, POSTURE) + MOTIONS[name](times)
    return times, simulate(scene, times, strokes, dt=5e-4, estimate_errors=False)


def measured(name, rate=200.0, seed=3):
    """What sensors with the virtual rig's noise read of a motion, `rate` times a second."""
    times, boom = true_motion(name)
    clock, noise, angles = np.random.default_rng(seed).spawn(3)
    sensors = Sensors(rate=rate, jitter=min(2e-4, 0.2 / rate))
    stamps = sampling_stamps(sensors, SECONDS, 100 * SECOND, clock)
    at = stamps / SECOND - 100.0
    true, joints, acceleration = (
        np.column_stack([np.interp(at, times, column) for column in values.T])
        for values in (boom.lengths, boom.joints, boom.tip_acceleration[:, :2])
    )
    return Measured(
        stamps,
        read(true, sensors.stroke_sigma, sensors.stroke_resolution, noise),
        read(joints, sensors.angle_sigma, sensors.angle_resolution, angles),
        acceleration,
    )
