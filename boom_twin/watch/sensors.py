"""The sensors that a boom has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, radians

from ..records import Mount, Stream
from ..scene.parts import Scene
from ..settings import Settings
from .sensor import Sensor

SLACK = 5.0
"""Deviations of its noise by which a sensor may read beyond the range of what it measures."""


def sensors_of(
    scene: Scene, settings: Settings, required: Mapping[Stream, bool], mounts: Sequence[Mount | None]
) -> dict[Stream, list[Sensor]]:
    """The sensors of every stream, in the order of a sample's values.

    Parameters
    ----------
    scene : Scene
        Gives the ranges: strokes 0 to ``max_stroke``, angles as in ``range_deg``.
    settings : Settings
        Noise and resolution.
    required : dict of Stream to bool
        Whether the twin needs the stream.
    mounts : sequence of Mount or None
        Of the sensor of each joint; an inclinometer (not None) has no range of its own.
    """
    tuned = settings
    stroke = tuned.stroke_sigma, tuned.stroke_resolution, required[Stream.STROKES]
    angle = tuned.angle_sigma, tuned.angle_resolution, required[Stream.ANGLES]
    force = tuned.imu_sigma, 0.0, required[Stream.IMU]
    beyond, over = SLACK * tuned.stroke_sigma, SLACK * tuned.angle_sigma
    strokes, angles = [], []
    for number, (joint, mount) in enumerate(zip(scene.joints, mounts, strict=True), start=1):
        low, high = (-inf, inf) if mount is not None else (radians(degrees) for degrees in joint.range_deg)
        strokes.append(Sensor(f"cylinder_{number}", "m", -beyond, joint.cylinder.max_stroke + beyond, *stroke))
        angles.append(Sensor(f"joint_{number}", "rad", low - over, high + over, *angle))
    imu = [Sensor(f"tip_imu_{axis}", "m_s2", -inf, inf, *force) for axis in "xz"]
    return {Stream.STROKES: strokes, Stream.ANGLES: angles, Stream.IMU: imu}
