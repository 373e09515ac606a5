"""The topics by role: names, types, QoS, units and meanings, as ``msg_config/topics.yaml`` lists them."""

from __future__ import annotations

from enum import StrEnum
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from ..errors import UsageError
from ..records import Stream

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


class Topics(_Entry):
    """All topics by role."""

    inputs: dict[Stream, Topic]
    outputs: dict[Output, Topic]

    @model_validator(mode="after")
    def _complete(self) -> Topics:
        present: dict[Stream | Output, Topic] = dict(self.inputs.items() | self.outputs.items())
        for role, expected in TYPES.items():
            if role not in present:
                raise ValueError(f"{role.value} is missing: every topic must be listed; copy it from the default file")
            if present[role].type != expected:
                raise ValueError(
                    f"{role.value}.type = {present[role].type!r}: only {expected} is read or filled there; restore it"
                )
        names = [topic.absolute for topic in present.values()]
        if twice := {name for name in names if names.count(name) > 1}:
            raise ValueError(f"name = {sorted(twice)}: used by two topics; give each its own name")
        return self


@lru_cache(maxsize=8)
def load_topics(path: Path = DEFAULT_FILE) -> Topics:
    """The topics of one YAML file, read once.

    Raises
    ------
    UsageError
        If the file cannot be read, or an entry is unknown, missing or outside its bounds: all faults, with their paths.
    """
    try:
        return Topics.model_validate(YAML(typ="safe").load(path.read_text(encoding="utf-8")))
    except (OSError, UnicodeDecodeError, YAMLError) as error:
        raise UsageError(f"{path}: no readable YAML file of topics ({error}). Start from the default file.") from error
    except ValidationError as error:
        faults = [f"  {'.'.join(map(str, fault['loc'])) or 'file'}: {fault['msg']}" for fault in error.errors()]
        raise UsageError("\n".join([f"{path}: topics that cannot be used", *faults])) from error
