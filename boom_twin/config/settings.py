"""Table of all settings: those of the twin and the thresholds of ``/diagnostics``; the reader of ROS parameter files."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Any, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ModelWrapValidatorHandler, ValidationError, ValidationInfo, model_validator
from pydantic.fields import FieldInfo

from ..errors import UsageError
from ..sensor_kinds import SensorKind
from ..types import StrokeReading
from .yaml_text import read_plain

ROS_OWN = ("use_sim_time", "start_type_description_service", "qos_overrides.")
"""First part of the names of parameters that rclpy declares for every node."""


def read_parameters(path: Path, namespace: str = "") -> dict[str, Any]:
    """Return the parameters that a ROS parameter file sets for the node ``boom_twin``, resolved as rclpy does.

    Every block whose name fits the node's full name counts: ``*`` stands for one part of it, ``**`` for any number of parts.
    The last value of a parameter wins. Raise UsageError if it is no ROS parameter file, or has no block for this node.
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


class _Table(BaseModel):
    """Table of settings. A value out of bounds or unknown raises UsageError."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    @model_validator(mode="wrap")
    @classmethod
    def _checked(cls, values: Any, handler: ModelWrapValidatorHandler[Self], info: ValidationInfo) -> Self:
        try:
            return handler(values)
        except ValidationError as error:
            source, others = info.context or (cls.__name__, ())
            lines, known = [], ""
            for e in error.errors():
                name = ".".join(map(str, e["loc"]))
                told = e["msg"]
                if e["type"] == "extra_forbidden":
                    told = f"unknown. The nearest is `{nearest(name, [*cls.model_fields, *others])}`"
                    known = f" Known parameters: {', '.join(cls.model_fields)}."
                lines.append(f"{name} = {e['input']!r}: {told}")
            raise UsageError(f"{source}: " + "; ".join(lines) + f".{known}") from None


Table = TypeVar("Table", bound=_Table)


def checked(table: type[Table], values: dict[str, Any], source: str, others: Iterable[str] = ()) -> Table:
    """Return a table with these values. UsageError names every value out of bounds or unknown here and among `others`."""
    return table.model_validate(values, context=(source, others))


def nearest(name: str, known: Sequence[str]) -> str:
    """Return the known name that is most similar to an unknown one."""
    return get_close_matches(name, known, n=1, cutoff=0.0)[0]


POSITIVE, NOT_NEGATIVE, SHARE, PROBABILITY = {"gt": 0.0}, {"ge": 0.0}, {"gt": 0.0, "le": 1.0}, {"gt": 0.0, "lt": 1.0}
LOAD, LIMIT = {"ge": -1.0, "le": 1e5}, {"ge": 1e-6, "le": 1e9}
"""Ranges of settings."""


def setting(default: float, unit: str, bounds: Mapping[str, Any], meaning: str, live: bool = False) -> Any:
    """Return a field of a table of settings; `unit` is ``1`` for a pure number, `live` tells if it can change at run time."""
    text = meaning if unit == "1" else f"{meaning}, {unit}"
    return Field(default=default, description=text, allow_inf_nan=False, json_schema_extra={"live": live}, **bounds)


def is_live(field: FieldInfo) -> bool:
    """Return True if a setting can change while the twin runs."""
    return isinstance(field.json_schema_extra, dict) and bool(field.json_schema_extra["live"])


class Thresholds(_Table):
    """Thresholds of ``/diagnostics``, in SI units. They can change at any time and do not affect the prediction."""

    raise_after: float = setting(2.0, "s", NOT_NEGATIVE, "time beyond a limit before its level is raised", True)
    clear_after: float = setting(5.0, "s", NOT_NEGATIVE, "time back below a limit before its level is cleared", True)
    release: float = setting(0.8, "1", SHARE, "share of a limit below which its level is left", True)
    stale_after: float = setting(2.0, "s", POSITIVE, "time without readings after which a sensor is stale", True)
    gap_warn: float = setting(0.1, "s", POSITIVE, "step between two stamps of a sensor: warning", True)
    unusable_warn: float = setting(0.01, "1", SHARE, "share of messages without a value: warning", True)
    unusable_error: float = setting(0.5, "1", SHARE, "share of messages without a value: error", True)
    clock_offset: float = setting(0.05, "s", POSITIVE, "difference between the clocks of two streams: warning", True)
    stamp_offset: float = setting(1.0, "s", POSITIVE, "difference of stamps and node's clock that is reported once", True)
    residual_window: float = setting(10.0, "s", POSITIVE, "time over which a residual is judged", True)
    residual_warn: float = setting(2.0, "1", POSITIVE, "root mean square of a normalised residual: warning", True)
    residual_error: float = setting(4.0, "1", POSITIVE, "root mean square of a normalised residual: error", True)
    swing_warn: float = setting(0.15, "m", POSITIVE, "distance of the swinging tip from its mean: warning", True)
    swing_error: float = setting(0.3, "m", POSITIVE, "distance of the swinging tip from its mean: error", True)
    load_warn: float = setting(0.5, "1", POSITIVE, "time of a step over the time between strokes: warning", True)
    load_error: float = setting(0.9, "1", POSITIVE, "time of a step over the time between strokes: error", True)
    unread_warn: float = setting(0.01, "1", SHARE, "share of messages lost, or given way to newer ones: warning", True)
    unread_error: float = setting(0.5, "1", SHARE, "share of messages lost, or given way to newer ones: error", True)
    wait_warn: float = setting(0.1, "s", POSITIVE, "time that messages wait for their turn: warning", True)
    wait_error: float = setting(1.0, "s", POSITIVE, "time that messages wait for their turn: error", True)
    lag_warn: float = setting(2.0, "s", POSITIVE, "age of recorded messages that are not on the disk: warning", True)
    lag_error: float = setting(5.0, "s", POSITIVE, "age of recorded messages that are not on the disk: error", True)
    disk_warn: float = setting(1800.0, "s", POSITIVE, "time until the disk is full at the present rate: warning", True)
    disk_error: float = setting(120.0, "s", POSITIVE, "time until the disk is full at the present rate: error", True)


def load_thresholds(path: Path, namespace: str = "") -> Thresholds:
    """Return the thresholds of a ROS parameter file, see `read_parameters`. Its other parameters are ignored."""
    values = read_parameters(path, namespace)
    return checked(Thresholds, {name: value for name, value in values.items() if name in Thresholds.model_fields}, str(path))


DEFAULT_FILE = Path(str(files("boom_twin") / "msg_config" / "twin.yaml"))
NODE_ONLY = ("scene", "mapping", "health", "causes", "frame_prefix", "hardware_id", "autostart", "monitor")
STROKE_RATE = 0.5  # m/s, upper bound of a cylinder's speed


class Settings(_Table):
    """Settings of the twin, in SI units. ``msg_config/twin.yaml`` has the defaults and explains each setting."""

    stroke_sigma: float = setting(2.0e-5, "m", NOT_NEGATIVE, "standard deviation of the noise of a stroke transducer")
    stroke_resolution: float = setting(5.0e-6, "m", POSITIVE, "resolution of a stroke transducer")
    stroke_zero: float = setting(0.0, "m", NOT_NEGATIVE, "standard deviation of the zero of a stroke transducer")
    angle_sigma: float = setting(1.745e-4, "rad", NOT_NEGATIVE, "standard deviation of the noise of a joint encoder")
    angle_resolution: float = setting(8.727e-5, "rad", POSITIVE, "resolution of a joint encoder")
    imu_sigma: float = setting(0.05, "m/s^2", POSITIVE, "standard deviation of the noise of an accelerometer")
    rate_sigma: float = setting(2e-3, "rad/s", POSITIVE, "standard deviation of the noise of a gyro")
    force_sigma: float = setting(100.0, "N", POSITIVE, "standard deviation of the noise of a cylinder's force")
    force_resolution: float = setting(20.0, "N", NOT_NEGATIVE, "resolution of a cylinder's force")
    pressure_sigma: float = setting(1e4, "Pa", POSITIVE, "standard deviation of the noise of a cylinder's pressure")
    moment_sigma: float = setting(50.0, "N m", POSITIVE, "standard deviation of the noise of a bending moment")
    point_sigma: float = setting(2e-3, "m", POSITIVE, "standard deviation of the noise of the position of a point")
    scene_error: float = setting(
        0.02, "1", {"ge": 0.0, "le": 0.3}, "relative standard deviation of the scene's stiffnesses and masses"
    )
    expected_load: float = setting(
        2.5e-3, "1", {"gt": 0.0, "le": 0.1}, "unknown force at the tip that the filter expects at first, over the boom's weight"
    )
    payload: float = setting(-1.0, "kg", LOAD, "mass at the tip; below 0: that of the scene", True)
    line_fill: float = setting(-1.0, "kg/m", LOAD, "concrete in the pipe line; below 0: that of the scene", True)
    stroke_rate: float = setting(STROKE_RATE, "m/s", LIMIT, "maximum speed of a cylinder; faster strokes are left out", True)
    angle_rate: float = setting(1.0, "rad/s", LIMIT, "maximum rate of an angle that drives the model")
    gap: float = setting(0.1, "s", LIMIT, "pause between strokes above which it is flagged", True)
    restart_gap: float = setting(5.0, "s", LIMIT, "pause above which the model restarts from rest", True)
    jump_back: float = setting(1.0, "s", LIMIT, "step back of a stamp below which the sample may be late", True)
    exaggeration: float = setting(10.0, "1", POSITIVE, "factor of the displacements drawn large in ~/shape")
    tip_deviation: float = setting(0.005, "m", POSITIVE, "deviation of an angle, as it moves the tip, that is an alarm")
    force_deviation: float = setting(5e3, "N", POSITIVE, "deviation of a cylinder force that is an alarm")
    tip_load_limit: float = setting(500.0, "N", POSITIVE, "force at the tip beside the known load that is an alarm")
    name_odds: float = setting(0.95, "1", PROBABILITY, "posterior probability from which on a cause is named")
    force_scale: float = setting(1.0e5, "N", POSITIVE, "cylinder force that has the full colour in ~/shape")

    @classmethod
    def live_names(cls) -> tuple[str, ...]:
        """Return the names of the settings that can change while the twin runs."""
        return tuple(name for name, field in cls.model_fields.items() if is_live(field))

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

    def standing(self, kind: SensorKind) -> float:
        """Return the variance of the rounding of a stream's sensors that no mean over readings at rest reduces, in SI units.

        Normal noise of s before the rounding to steps of h dithers it. At rest anywhere in a step the mean error of rounding
        has the variance h^2 / (2 pi^2) sum_k exp(-(2 pi k s / h)^2) / k^2, which is h^2 / 12 without noise (B. Widrow and
        I. Kollar, Quantization Noise, Cambridge 2008).
        """
        sigma, h = self.noise(kind)
        turns = 2.0 * math.pi * sigma / h if h > 0.0 else math.inf
        if turns > 6.0:  # exp(-36) is within the rounding of numbers
            return 0.0
        return h * h / (2.0 * math.pi**2) * sum(math.exp(-((k * turns) ** 2)) / k**2 for k in range(1, 100))

    def rate(self, reads: StrokeReading) -> float:
        """Return the maximum rate of what drives the model, m/s or rad/s."""
        return self.angle_rate if reads is StrokeReading.ANGLE else self.stroke_rate


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
