"""Parameters of the twin and thresholds of ``/diagnostics``: type, unit, bounds, meaning; the reader of ROS parameter files."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..errors import UsageError
from ..types import SensorKind
from .yaml_text import read_plain

Table = TypeVar("Table", bound=BaseModel)
_GONE = ("jerk_density", "lag", "stroke_agility", "step", "look_step", "step_tip_error", "step_acceleration_error", "rho")
RETIRED = dict.fromkeys(
    (*_GONE, "section_deviation"), "without effect since 0.2.0, whose filter adapts by itself: leave it out"
) | {"false_alarms": "without effect since 0.2.0: leave it out"}
"""Parameters of earlier versions, and the remedy for each."""


ROS_OWN = ("use_sim_time", "start_type_description_service", "qos_overrides.")
"""First part of the names of parameters that rclpy declares for every node."""


def read_parameters(path: Path, namespace: str = "") -> dict[str, Any]:
    """Return the parameters that a ROS parameter file sets for the node ``boom_twin``, resolved as rclpy does.

    Every block whose name fits the node's full name counts: ``*`` stands for one part of it, ``**`` for any number of parts.
    The last value of a parameter wins.

    Raises
    ------
    UsageError
        The file is no ROS parameter file, or has no block for this node.
    """
    content = read_plain(path, UsageError, "Give a ROS parameter file.")
    node = "/".join(["", *filter(None, namespace.split("/")), "boom_twin"])
    try:
        blocks = list(_blocks(content))
        found = [dict(_dotted(values)) for name, values in blocks if re.fullmatch(_pattern(name), node)]
    except (AttributeError, ValueError):
        raise UsageError(f"{path}: not a ROS parameter file. It needs `/**:` with `ros__parameters:` below.") from None
    if not found:
        names = ", ".join(name for name, _ in blocks)
        raise UsageError(f"{path}: no parameters of {node}, only of {names}. Name the node `/**`, or give its --namespace.")
    return {name: value for values in found for name, value in values.items()}


def _blocks(content: Any, node: str = "") -> Iterator[tuple[str, Any]]:
    """Yield node and values of every ``ros__parameters``; ValueError if a block has none."""
    if not content:
        raise ValueError(f"{node}: no ros__parameters")
    for key, value in content.items():
        if key == "ros__parameters" and node:
            yield node, value
        else:
            yield from _blocks(value, f"{node}/{key.removeprefix('/')}")


def _pattern(name: str) -> str:
    return re.escape(name).replace(r"/\*\*", r"(/\w+)*").replace(r"/\*", r"/\w+")


def _dotted(values: Any, block: str = "") -> Iterator[tuple[str, Any]]:
    """Yield names and values. Names of inner blocks become parts of the names: ``a.b``."""
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _dotted(value, f"{block}{key}.")
        else:
            yield f"{block}{key}", value


def checked(table: type[Table], values: dict[str, Any], source: str, others: Iterable[str] = ()) -> Table:
    """Return a table with these values. UsageError names every value out of bounds or unknown here and among `others`."""
    try:
        return table(**values)
    except ValidationError as error:
        lines = []
        for e in error.errors():
            name = ".".join(map(str, e["loc"]))
            told = e["msg"]
            if e["type"] == "extra_forbidden":
                told = f"unknown. The nearest is `{nearest(name, [*table.model_fields, *others])}`"
            lines.append(f"{name} = {e['input']!r}: {RETIRED.get(name, told)}")
        known = ", ".join(table.model_fields)
        raise UsageError(f"{source}: " + "; ".join(lines) + f". Known parameters: {known}.") from None


def nearest(name: str, known: Sequence[str]) -> str:
    """Return the known name that is most similar to an unknown one."""
    return get_close_matches(name, known, n=1, cutoff=0.0)[0]


Share = Annotated[float, Field(gt=0, le=1)]
Probability = Annotated[float, Field(gt=0, lt=1)]


class Thresholds(BaseModel):
    """Thresholds of ``/diagnostics``, in SI units. They can change at any time and do not affect the prediction."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    raise_after: NotNegative = Field(default=2.0, description="time for which a limit is passed before it is told, s")
    clear_after: NotNegative = Field(default=5.0, description="time for which all is well again before it is told, s")
    release: Share = Field(default=0.8, description="share of a limit below which its level is left")
    stale_after: Positive = Field(default=2.0, description="a sensor without readings for so long is stale, s")
    gap_warn: Positive = Field(default=0.1, description="a longer step between two stamps of a sensor is told, s")
    unusable_warn: Share = Field(default=0.01, description="share of readings missing or out of range: warning")
    unusable_error: Share = Field(default=0.5, description="share of readings missing or out of range: error")
    frozen_after: Positive = Field(default=1.0, description="a reading unchanged for so long, at least, is frozen, s")
    frozen_false_alarm: Probability = Field(
        default=1e-9, description="probability that a live sensor is taken for frozen, for each reading"
    )
    clock_offset: Positive = Field(default=0.05, description="clocks of two streams that differ by more are told, s")
    stamp_offset: Positive = Field(default=1.0, description="stamps and node's clock that differ by more are told once, s")
    residual_window: Positive = Field(default=10.0, description="time over which a residual is judged, s")
    residual_warn: Positive = Field(default=2.0, description="root mean square of a normalised residual: warning")
    residual_error: Positive = Field(default=4.0, description="root mean square of a normalised residual: error")
    load_warn: Positive = Field(default=0.5, description="time of a step over the time between strokes: warning")
    load_error: Positive = Field(default=0.9, description="time of a step over the time between strokes: error")
    unread_warn: Share = Field(default=0.01, description="share of messages lost, or given way to newer ones: warning")
    unread_error: Share = Field(default=0.5, description="share of messages lost, or given way to newer ones: error")
    wait_warn: Positive = Field(default=0.1, description="messages wait for their turn for longer: warning, s")
    wait_error: Positive = Field(default=1.0, description="messages wait for their turn for longer: error, s")
    lag_warn: Positive = Field(default=2.0, description="recorded messages not on the disk for so long: warning, s")
    lag_error: Positive = Field(default=5.0, description="recorded messages not on the disk for so long: error, s")
    disk_warn: Positive = Field(default=1800.0, description="the disk is full in less, at the present pace: warning, s")
    disk_error: Positive = Field(default=120.0, description="the disk is full in less, at the present pace: error, s")


def load_thresholds(path: Path, namespace: str = "") -> Thresholds:
    """Return the thresholds of a ROS parameter file, see `read_parameters`. Its other parameters are ignored."""
    values = read_parameters(path, namespace)
    return checked(Thresholds, {name: value for name, value in values.items() if name in Thresholds.model_fields}, str(path))


DEFAULT_FILE = Path(str(files("boom_twin") / "msg_config" / "twin.yaml"))

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
NODE_ONLY = ("scene", "mapping", "health", "baseline", "frame_prefix", "hardware_id", "autostart", "monitor")
STROKE_RATE = 0.5
"""Upper bound of a cylinder's speed, m/s."""
LIVE = "live"
"""Mark of a setting that can change while the twin runs."""
Load = Annotated[float, Field(ge=-1, le=1e5, allow_inf_nan=False), LIVE]
Limit = Annotated[float, Field(ge=1e-6, le=1e9, allow_inf_nan=False), LIVE]


class Settings(BaseModel):
    """Settings of the twin, in SI units. ``msg_config/twin.yaml`` has the defaults and explains each setting."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    stroke_sigma: NotNegative = Field(default=2.0e-5, description="noise of a stroke transducer, m")
    stroke_resolution: Positive = Field(default=5.0e-6, description="resolution of a stroke transducer, m")
    angle_sigma: NotNegative = Field(default=1.745e-4, description="noise of a joint encoder, rad")
    angle_resolution: Positive = Field(default=8.727e-5, description="resolution of a joint encoder, rad")
    imu_sigma: Positive = Field(default=0.05, description="noise of the tip IMU, m/s^2")
    force_sigma: Positive = Field(default=100.0, description="noise of a cylinder's force, N")
    force_resolution: NotNegative = Field(default=20.0, description="resolution of a cylinder's force, N")
    payload: Load = Field(default=-1.0, description="mass at the tip, kg; below 0: that of the scene")
    line_fill: Load = Field(default=-1.0, description="concrete in the pipe line, kg/m; below 0: that of the scene")
    stroke_rate: Limit = Field(default=STROKE_RATE, description="no cylinder is faster, m/s; such a stroke is left out")
    gap: Limit = Field(default=0.1, description="longer pauses between strokes are flagged, s")
    restart_gap: Limit = Field(default=5.0, description="longer pauses start again from rest, s")
    jump_back: Limit = Field(default=1.0, description="a stamp earlier by less may be of a late sample, s")
    leap: Limit = Field(default=3600.0, description="a longer step of the first stamps of angles is confirmed, s")
    exaggeration: Positive = Field(default=10.0, description="factor of the displacements drawn large in ~/shape")
    tip_deviation: Positive = Field(default=0.02, description="an angle off its prediction by more at the tip is an alarm, m")
    force_deviation: Positive = Field(default=5e3, description="a cylinder force off its prediction by more is an alarm, N")
    tip_load_limit: Positive = Field(default=500.0, description="force at the tip beside the known load that is an alarm, N")
    force_scale: Positive = Field(default=1.0e5, description="cylinder force that has the full colour in ~/shape, N")

    @classmethod
    @cache
    def live_names(cls) -> tuple[str, ...]:
        """Return the names of the settings that can change while the twin runs."""
        return tuple(name for name, field in cls.model_fields.items() if LIVE in field.metadata)

    @property
    def live(self) -> dict[str, float]:
        """Values of the settings `live_names`."""
        return {name: getattr(self, name) for name in self.live_names()}

    @property
    def load(self) -> tuple[float, float]:
        """Payload (kg) and line fill (kg/m)."""
        return self.payload, self.line_fill

    @property
    def limits(self) -> dict[str, float]:
        """Values of the live settings except payload and line fill."""
        return {name: value for name, value in self.live.items() if name not in ("payload", "line_fill")}

    def tuned(self, live: Mapping[str, float]) -> Settings:
        """Return these settings with other live values. Raise UsageError if one is out of bounds or not live."""
        if fixed := sorted(set(live) - set(self.live_names())):
            known = ", ".join(self.live_names())
            raise UsageError(f"{', '.join(fixed)}: fixed while the twin runs. What can change: {known}.")
        return checked(Settings, {**self.model_dump(), **live}, "change of settings")

    def noise(self, kind: SensorKind) -> tuple[float, float]:
        """Return the standard deviation of the noise and the resolution of the sensors of a stream, in their SI unit."""
        return getattr(self, kind.noise), getattr(self, kind.resolution) if kind.resolution else 0.0

    def variance(self, kind: SensorKind) -> float:
        """Return the variance (noise and rounding) of one reading of a stream's sensors, in the square of their SI unit."""
        sigma, resolution = self.noise(kind)
        return sigma**2 + resolution**2 / 12.0

    @property
    def stroke_variance(self) -> float:
        """Variance of a stroke reading (noise and rounding), m^2."""
        return self.stroke_sigma**2 + self.stroke_resolution**2 / 12.0


def load_settings(path: Path | None = None, namespace: str = "") -> Settings:
    """Return the settings of a ROS parameter file, see `read_parameters`; the package's own if no path is given.

    Parameters of the node alone (`NODE_ONLY`), of ``/diagnostics`` and of rclpy (`ROS_OWN`) are ignored.

    Parameters
    ----------
    path : Path, optional
        The file; by default ``msg_config/twin.yaml`` of the package.
    namespace : str
        ROS namespace of the node ``boom_twin``.

    Returns
    -------
    Settings
        All settings; one that the file does not name has its default.

    Raises
    ------
    UsageError
        The file cannot be read, or a parameter is unknown or out of bounds.
    """
    source = DEFAULT_FILE if path is None else Path(path)
    others = (*NODE_ONLY, *Thresholds.model_fields)
    found = read_parameters(source, namespace).items()
    values = {name: value for name, value in found if name not in others and not name.startswith(ROS_OWN)}
    return checked(Settings, values, str(source), others)
