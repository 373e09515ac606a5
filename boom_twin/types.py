"""Frozen values that cross folders: inputs and results of the twin."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from enum import Enum, StrEnum
from math import pi
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from .predictions import Estimate, Prediction
from .sensor_kinds import (
    ANGLES,
    FORCES,
    IMU_2,
    IMU_3,
    IMU_4,
    MOMENTS,
    PRESSURES,
    STROKES,
    TIP_IMU,
    SensorKind,
    gyro_kind,
    point_kind,
)
from .texts import alarm_text

if TYPE_CHECKING:  # commands that only look at a bag start without NumPy
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Integers = NDArray[np.int64]
    ComplexArray = NDArray[np.complex128]
else:
    Array = Any
    Integers = Any
    ComplexArray = Any


NANO = 1e-9  # s in a nanosecond: stamps are whole nanoseconds, spans of time are seconds
SECOND = 1_000_000_000  # ns in a second

Mount = Literal["root", "head", "root_compensated", "head_compensated"]
"""Place of an inclinometer on its section; the two places differ by the bending of the section.

It finds the vertical by its acceleration and errs while its place accelerates, unless it is compensated by a gyro.
"""


class Stream(Enum):
    """Source of samples."""

    STROKES = "cylinder_strokes"
    ANGLES = "joint_angles"
    IMU = "tip_imu"
    FORCES = "cylinder_forces"
    RATE = "tip_imu_rate"
    IMU_2 = "imu_2"
    RATE_2 = "imu_2_rate"
    IMU_3 = "imu_3"
    RATE_3 = "imu_3_rate"
    IMU_4 = "imu_4"
    RATE_4 = "imu_4_rate"
    MOMENTS = "section_moments"
    POINT = "points"
    POINT_2 = "points_2"
    PRESSURES = "cylinder_pressures"

    __hash__ = object.__hash__  # members are single; Enum's own is a Python function, called for every look-up


class StrokeReading(StrEnum):
    """Quantity whose readings drive the model: lengths of cylinders, with the oil compressed or unloaded, or joint angles."""

    LENGTH = "length"
    DRIVE = "drive"
    ANGLE = "angle"

    @property
    def named(self) -> str:
        """Name of these readings for people."""
        return "angles" if self is StrokeReading.ANGLE else "strokes"

    @property
    def text(self) -> str:
        """Clause on the strokes of a session, for people."""
        return "are not read: angles drive the model" if self is StrokeReading.ANGLE else f"are {self}s of the cylinders"

    @property
    def stream(self) -> Stream:
        """Stream of these readings: every prediction has the stamp of one of its samples."""
        return Stream.ANGLES if self is StrokeReading.ANGLE else Stream.STROKES


@dataclass(frozen=True, slots=True)
class Place:
    """Place of a sensor in the plane of the boom."""

    section: int | None = None  # from 1 at the base; None is the last section
    at: float | None = None  # distance from the section's inboard pivot along it, m; None is its outboard pivot
    turned: float = 0.0  # angle of the sensor's x axis to the section, positive as a section is raised, rad


class Channel(NamedTuple):
    """Way to read a channel: quantity = sign * scale * (reading - zero), in `unit`. `turned` is an IMU's rotation, rad."""

    name: str
    unit: str
    sign: int = 1
    zero: float = 0.0
    scale: float = 1.0
    absolute: Mount | None = None
    turned: float = 0.0


NO_CHANNELS: Mapping[str, Channel] = {}
NO_PLACES: Mapping[str, Place] = {}  # of a boom whose only placed sensor is the tip IMU, at the tip

SENSORS: dict[Stream, SensorKind] = {
    Stream.STROKES: STROKES,
    Stream.ANGLES: ANGLES,
    Stream.IMU: TIP_IMU,
    Stream.FORCES: FORCES,
    Stream.RATE: gyro_kind(TIP_IMU),
    Stream.IMU_2: IMU_2,
    Stream.RATE_2: gyro_kind(IMU_2),
    Stream.IMU_3: IMU_3,
    Stream.RATE_3: gyro_kind(IMU_3),
    Stream.IMU_4: IMU_4,
    Stream.RATE_4: gyro_kind(IMU_4),
    Stream.MOMENTS: MOMENTS,
    Stream.POINT: point_kind("points"),
    Stream.POINT_2: point_kind("points_2"),
    Stream.PRESSURES: PRESSURES,
}
"""In the order of `Stream`. Expected readings are in `boom_twin.deviation.channels`, topics in ``topics.yaml``."""


USUAL_STREAMS = tuple(stream for stream, kind in SENSORS.items() if not (kind.is_placed or kind.beside or kind.gives))
"""Streams that a boom has without a mapping, but for the gyro of its IMU."""


def streams_of(places: Collection[str]) -> tuple[Stream, ...]:
    """Return the streams of a boom whose mapping places these sensors, such as ``imu_2``."""
    return tuple(stream for stream, kind in SENSORS.items() if not (kind.gives or (kind.is_placed and not kind.is_at(places))))


def channels_of(joints: int, streams: Collection[Stream] = tuple(Stream)) -> dict[Stream, tuple[str, ...]]:
    """Return the names of the channels of every stream, in the order of its samples, of a boom with so many joints.

    Streams that are not among `streams` have no channels.
    """
    return {s: kind.channels(joints) if s in streams and not kind.gives else () for s, kind in SENSORS.items()}


NUMBER = re.compile(r"[1-9]\d{0,3}")
NUMBERED_SIDE = re.compile(rf"cylinder_{NUMBER.pattern}_(cap|rod)")


def stream_of(channel: str) -> Stream | None:
    """Return the stream of a channel; None if there can be no such channel."""
    stem, _, end = channel.rpartition("_")
    if NUMBERED_SIDE.fullmatch(channel):
        return Stream.PRESSURES
    for stream, kind in SENSORS.items():
        if stem == kind.stem and not kind.gives and (end in kind.ends if kind.ends else NUMBER.fullmatch(end)):
            return stream
    return None


def sensor_kind(channel: str) -> SensorKind:
    """Return the row of `SENSORS` of a channel; KeyError if there can be no such channel."""
    stream = stream_of(channel)
    if stream is None:
        raise KeyError(channel)
    return SENSORS[stream]


GIVE = 5.0 * pi / 180.0
"""Angle (rad) that an encoder may read beyond ``range_deg``, which holds for the rigid boom, without sag and vibration."""


LIMIT = 1e7
"""Largest magnitude that is taken for a reading: no stroke (m), angle (rad), acceleration (m/s^2) or force (N) is near it."""


@dataclass(frozen=True, slots=True)
class Sample:
    """Message of the rig, mapped to the scene's order and units."""

    stream: Stream
    stamp: int
    """Nanoseconds, `header.stamp` of the message."""
    values: Array
    """``STROKES``: (n,) m. ``ANGLES``: (n,) rad, of an inclinometer to the horizontal. ``IMU``, ``IMU_2`` ..: (2,) m/s^2,
    specific force along x and z of the sensor. ``RATE``, ``RATE_2`` ..: (1,) rad/s, positive when raised. ``FORCES``: (n,) N,
    of the cylinders, positive in tension. ``MOMENTS``: (n,) N m, positive where the outboard end is bent up. ``POINT``,
    ``POINT_2``: (2,) m, forward and up. NaN where the message had no value; a value beyond `LIMIT` counts as none.
    """


@dataclass(frozen=True, slots=True)
class Residuals:
    """Residuals at the stamp of one sample: measured minus predicted.

    The prediction is that of the strokes up to this stamp. Residuals of strokes, or of the angles that drive the model in their
    place, are innovations: the prediction, its mean over the filter's models by their probabilities, is that before them.
    """

    stream: Stream
    stamp: int
    """Nanoseconds."""
    names: tuple[str, ...]
    """One per channel: ``cylinder_1``, .., ``joint_1``, .., ``tip_imu_x``, ``tip_imu_z``, or ``cylinder_force_1``, .."""
    values: Array
    sigmas: Array
    """Residuals in the unit of the sensor and their expected standard deviations, shape (len(names),); NaN if not measured."""

    @property
    def normalised(self) -> Array:
        """Residual over its expected standard deviation, shape (len(names),)."""
        return self.values / self.sigmas


@dataclass(frozen=True, slots=True)
class Change:
    """Change of a running twin that takes effect at one stroke sample; a replay repeats it."""

    stamp: int
    """Stamp of that sample, nanoseconds."""
    from_rest: bool
    """True if the model began with it, at rest."""
    settings: dict[str, float]
    """Values of all settings that can change while the twin runs, see `boom_twin.config.settings.Settings`."""
    zeros: dict[str, float]
    """Zero errors by channel (``cylinder_1`` m, ``joint_1`` rad, ``tip_imu_x`` m/s^2, ``cylinder_force_1`` N), else 0."""
    is_new: bool = False
    """True if the twin itself began with it and knows nothing that was measured before."""


@dataclass(frozen=True, slots=True)
class Ranked:
    """Cause that may explain an alarm."""

    cause: str
    """A parameter of the scene, a sensor, or ``unknown``."""
    probability: float
    """Probability among all causes, given that something is wrong."""
    parts: tuple[tuple[str, float, float, str], ...]
    """Fault parts: kind, estimate, its standard deviation, unit (empty for a share)."""


@dataclass(frozen=True, slots=True)
class Alarm:
    """Alarm about the rig, its sensors, or the model of it."""

    channel: str
    """Channel that shows it."""
    kind: str
    """Kind of fault in one word."""
    since: int
    """Onset, stamp in ns."""
    until: int | None
    """End, stamp in ns; None while it lasts."""
    cause: str | None
    """The scene's parameter or the sensor at fault; None if unknown."""
    evidence: str
    """Figures for whoever looks closer: how much, how sure."""
    ranked: tuple[Ranked, ...] = ()
    """Causes that may explain it, the most probable first; empty if the sensor itself shows it."""

    @property
    def told(self) -> str:
        """Sentence for an operator: what is wrong, and what to do."""
        return alarm_text(self.channel, self.kind, self.cause)


@dataclass(frozen=True, slots=True)
class Health:
    """Health of the rig at one stamp (ns)."""

    stamp: int
    """Stamp of the strokes, or driving angles, with which the newest block of residuals was complete."""
    alarms: tuple[Alarm, ...]
    """Active alarms, and those that have ended since the last `Health`."""
    tip_sigmas: Array
    """Standard deviation of the predicted tip's x and y, m, shape (2,)."""
    noise: Mapping[str, float] = field(default_factory=dict)
    """Noise of most sensors of a stream over the stated noise, at least 1, by ``noise_over_`` and the name of its setting."""


@dataclass(frozen=True, slots=True)
class Report:
    """Report on one sample and all that it caused."""

    stamp: int
    """Stamp of the sample, nanoseconds."""
    accepted: bool
    """False if the sample was not used; `events` says why. Of a ``leap``, only the stamp is used."""
    prediction: Prediction | None = None
    """Prediction at every stroke sample that the model was stepped to."""
    residuals: tuple[Residuals, ...] = ()
    """Residuals that became known by this sample, in order of their stamps."""
    events: tuple[str, ...] = ()
    """Irregularities, by the names in `boom_twin.twin.blocks.EVENTS`."""
    status: str = "ok"
    """``ok``, or one sentence on a failure of the model."""
    change: Change | None = None
    """Set if the model began from rest, or a requested change took effect."""
    health: Health | None = None
    """Set once a second, and when an alarm begins, changes or ends."""
    estimate: Estimate | None = None
    """Set beside every prediction."""
