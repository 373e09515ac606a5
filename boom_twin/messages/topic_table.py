"""A mapping: topics by role with their QoS, and the sensors in them, as ``msg_config/topics.yaml`` lists them."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from ..errors import UsageError
from ..plain import read_plain
from ..records import Mount, Stream
from .sensors import Sensor, channels, number_of, stream_of, usual

NODE = "boom_twin"
DEFAULT_FILE = Path(__file__).parent.parent / "msg_config" / "topics.yaml"


class Output(StrEnum):
    """What the twin publishes."""

    TIP_DISPLACEMENT = "tip_displacement"
    TIP_POSITION = "tip_position"
    TIP_ACCELERATION = "tip_acceleration"
    JOINT_STATES = "joint_states"
    RESIDUALS = "residuals"
    SHAPE = "shape"
    CHANGES = "changes"
    HEALTH = "health"
    TIP_UNCERTAINTY = "tip_uncertainty"
    DIAGNOSTICS = "diagnostics"


TYPES: dict[Stream | Output, str] = {
    Stream.STROKES: "sensor_msgs/msg/JointState",
    Stream.ANGLES: "sensor_msgs/msg/JointState",
    Stream.IMU: "sensor_msgs/msg/Imu",
    Output.TIP_DISPLACEMENT: "geometry_msgs/msg/Vector3Stamped",
    Output.TIP_POSITION: "geometry_msgs/msg/PointStamped",
    Output.TIP_ACCELERATION: "geometry_msgs/msg/AccelStamped",
    Output.JOINT_STATES: "sensor_msgs/msg/JointState",
    Output.RESIDUALS: "sensor_msgs/msg/JointState",
    Output.SHAPE: "visualization_msgs/msg/MarkerArray",
    Output.CHANGES: "sensor_msgs/msg/JointState",
    Output.HEALTH: "diagnostic_msgs/msg/DiagnosticArray",
    Output.TIP_UNCERTAINTY: "geometry_msgs/msg/Vector3Stamped",
    Output.DIAGNOSTICS: "diagnostic_msgs/msg/DiagnosticArray",
}
"""The one message type that the program reads or fills for each role."""


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Qos(_Entry):
    """Quality of service, the three policies that an operator chooses."""

    reliability: Literal["best_effort", "reliable"]
    durability: Literal["volatile", "transient_local"]
    depth: Annotated[int, Field(ge=1, le=10_000)]


class Topic(_Entry):
    """One topic; the keys are explained at the top of ``topics.yaml``."""

    name: Annotated[str, Field(pattern=r"^(~/|/)?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*$")]
    type: str
    qos: Qos
    unit: str
    meaning: str
    required: bool = True

    @property
    def absolute(self) -> str:
        """The name in a bag: relative to ``/``, private to ``/boom_twin``."""
        if self.name.startswith("~/"):
            return f"/{NODE}/{self.name[2:]}"
        return self.name if self.name.startswith("/") else f"/{self.name}"


class EventTopic(Topic):
    """Where an operator's marks go."""

    type: Literal["rcl_interfaces/msg/Log"]


class Topics(_Entry):
    """All topics by role, and the sensors that are not as usual by channel; see `boom_twin.io.mapping` for how it is read."""

    inputs: dict[Stream, Topic]
    outputs: dict[Output, Topic]
    events: EventTopic
    sensors: dict[str, Sensor] = {}

    @property
    def is_shared(self) -> bool:
        """Whether strokes and angles come by one topic."""
        return self.inputs[Stream.STROKES].absolute == self.inputs[Stream.ANGLES].absolute

    @property
    def heard(self) -> dict[str, list[Stream]]:
        """The streams of every input topic, by its name; strokes first."""
        found: dict[str, list[Stream]] = {}
        for stream in Stream:
            found.setdefault(self.inputs[stream].name, []).append(stream)
        return found

    def sensors_of(self, stream: Stream, joints: int) -> dict[str, Sensor]:
        """The sensors of a stream by channel, in the order of its samples."""
        return {name: self.sensors.get(name) or Sensor(**usual(name)) for name in channels(stream, joints)}

    def beyond(self, stream: Stream, joints: int, names: Iterable[str]) -> list[str]:
        """Those of `names` by which a message tells of cylinders or joints that a boom with so many joints does not have.

        ``cylinder_5`` of four; not if a channel reads that name, nor if `sensors` has every channel of the stream: then
        whoever wrote the mapping has said which of the names are the boom's.
        """
        if stream is Stream.IMU or all(channel in self.sensors for channel in channels(stream, joints)):
            return []
        used = {sensor.name for sensor in self.sensors_of(stream, joints).values()}
        return [name for name in names if stream_of(name) is stream and number_of(name) > joints and name not in used]

    def mounts(self, joints: int) -> list[Mount | None]:
        """Where the inclinometers of a boom sit, one entry for each joint; None is an encoder."""
        return [sensor.absolute for sensor in self.sensors_of(Stream.ANGLES, joints).values()]


@cache
def load_topics() -> Topics:
    """The topics of the package, read once; sensors as usual."""
    return Topics.model_validate(default_document())


@cache
def default_document() -> Any:
    """What the package's own file says; not to be changed."""
    return read_plain(DEFAULT_FILE, UsageError, "Install the package anew.")
