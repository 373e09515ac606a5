"""Kinds of sensors: names, units and messages of each stream."""

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


STROKES = SensorKind(
    title="cylinder strokes",
    stem="cylinder",
    units={"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254},
    noise="stroke_sigma",
    resolution="stroke_resolution",
    lack="nothing can be replayed",
    shown="mm",
)
ANGLES = SensorKind(
    title="joint angles",
    stem="joint",
    units={"rad": 1.0, "mrad": 1e-3, "deg": pi / 180.0, "gon": pi / 200.0},
    noise="angle_sigma",
    resolution="angle_resolution",
    lack="there are no joint residuals",
    shown="mrad",
)
FORCES = SensorKind(
    title="cylinder forces",
    stem="cylinder_force",
    units={"N": 1.0, "daN": 10.0, "kN": 1e3, "lbf": 4.4482216152605},
    noise="force_sigma",
    resolution="force_resolution",
    field="effort",
    part="cylinder",
    alarms=("stuck", "dropout"),
)
PRESSURES = SensorKind(
    title="cylinder pressures",
    stem="cylinder",
    ends=("cap", "rod"),
    units={"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "bar": 1e5, "psi": 6894.757293168},
    noise="pressure_sigma",
    field="effort",
    gives="cylinder_forces",
)
MOMENTS = SensorKind(
    title="bending moments",
    stem="moment",
    units={"N m": 1.0, "kN m": 1e3},
    noise="moment_sigma",
    field="effort",
    is_placed=True,
    shown="kN m",
    alarms=("stuck", "dropout"),
)


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


TIP_IMU = imu_kind("tip_imu", lack="there are no residuals of the tip's acceleration (optional)")
IMU_2, IMU_3, IMU_4 = map(imu_kind, ("imu_2", "imu_3", "imu_4"))


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


def point_kind(stem: str) -> SensorKind:
    """Return the positions of a named point, as a total station or a camera measures them."""
    return SensorKind(
        title=stem.replace("_", " "),
        message="geometry_msgs/msg/PointStamped",
        stem=stem,
        ends=("x", "z"),
        units={"m": 1.0, "mm": 1e-3},
        noise="point_sigma",
        field="point",
        axes=("x", "z"),
        is_placed=True,
        shown="mm",
        alarms=(),
    )
