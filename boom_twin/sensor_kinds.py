"""Kinds of sensors: names, units and messages of one stream."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from math import pi

G = 9.80665  # m/s^2, standard gravity


@dataclass(frozen=True, slots=True)
class SensorKind:
    """Sensors of one stream."""

    title: str  # for people
    stem: str  # start of its channel names: ``joint`` gives ``joint_1`` .. ``joint_n``
    units: dict[str, float]  # size of each unit in the SI unit, which is the first
    noise: str  # field of `boom_twin.config.settings.Settings`
    resolution: str = ""  # likewise; empty: 0
    ends: tuple[str, ...] = ()  # of its channel names, if there is not one for each joint: ``x`` gives ``tip_imu_x``
    lack: str = ""  # what is missing without these sensors; empty if few rigs have them
    message: str = "sensor_msgs/msg/JointState"  # read by names; another type is read by `axes`
    field: str = "position"  # that is read: of a JointState also ``effort``, of another message the vector with the `axes`
    axes: tuple[str, ...] = ()  # of that vector, one for each channel; empty if messages are read by names
    beside: str = ""  # input whose messages hold these readings, too, if they have no topic of their own
    gives: str = ""  # stream that these readings are converted to when decoded; they have channels in messages only
    is_placed: bool = False  # True if a boom has these sensors only where a mapping places them
    part: str = ""  # stem of the names in messages, if it differs: a force is that of ``cylinder_1``
    shown: str = ""  # the unit, one of `units`, in which pictures and the page show residuals; by default the SI unit
    alarms: tuple[str, ...] = ("stuck", "dropout", "range", "jump", "spikes", "noise")
    """Alarms of a single sensor. Jumps, spikes and noise count only if its quantity changes little per reading."""

    def is_at(self, places: Collection[str]) -> bool:
        """Return True if any of these sensors has a place; places are those of a stem, or of single channels of one."""
        return self.stem in places or any(not self.ends and place.rpartition("_")[0] == self.stem for place in places)

    @property
    def is_accelerometer(self) -> bool:
        """Return True for the accelerometers of an IMU."""
        return self.field == "linear_acceleration"

    @property
    def is_named(self) -> bool:
        """Return True if its messages are read by names."""
        return not self.axes

    @property
    def named(self) -> str:
        """Stem of the names in messages."""
        return self.part or self.stem

    @property
    def unit(self) -> str:
        """SI unit."""
        return next(iter(self.units))

    @property
    def unit_suffix(self) -> str:
        """SI unit as the end of a key or of a column's name: ``rad``, ``m_s2``."""
        return self.unit.replace("/", "_").replace("^", "").replace(" ", "")

    @property
    def shown_unit(self) -> tuple[float, str]:
        """Factor from SI to the unit that residuals are shown in, and that unit as it is printed."""
        unit = self.shown or self.unit
        return 1.0 / self.units[unit], unit.replace("^2", "²")

    def channels(self, joints: int) -> tuple[str, ...]:
        """Return the names of the channels in the order of a sample, of a boom with so many joints."""
        if self.gives:
            return tuple(f"{self.stem}_{i}_{end}" for i in range(1, joints + 1) for end in self.ends)
        return tuple(f"{self.stem}_{end}" for end in self.ends or range(1, joints + 1))


def imu_kind(stem: str, lack: str = "") -> SensorKind:
    """Return the accelerometers of an IMU."""
    return SensorKind(
        title=stem.replace("tip_imu", "tip IMU").replace("imu_", "IMU "),
        message="sensor_msgs/msg/Imu",
        stem=stem,
        ends=("x", "z"),
        units={"m/s^2": 1.0, "g": G, "mg": 1e-3 * G},
        noise="imu_sigma",
        lack=lack,
        field="linear_acceleration",
        axes=("x", "z"),
        is_placed=not lack,
        alarms=("stuck", "dropout"),
    )


def gyro_kind(imu: SensorKind) -> SensorKind:
    """Return the gyro of an IMU, which reads how fast its place is raised."""
    return replace(
        imu,
        title=f"{imu.title} gyro",
        ends=("rate",),
        units={"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": pi / 180.0},
        noise="rate_sigma",
        lack="",
        field="angular_velocity",
        axes=("y",),
        beside=imu.stem,
        shown="mrad/s",
    )
