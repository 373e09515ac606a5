"""The table of topics with their types and QoS, and of sensor channels with their names, signs, zeros, scales and units."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import StrEnum
from functools import cache
from math import hypot, isnan, nan, pi, radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, WrapValidator

from ..config.settings import Settings
from ..config.yaml_text import read_plain
from ..errors import UsageError
from ..types import GIVE, NUMBER, SECOND, SENSORS, Channel, Mount, Place, Stream, StrokeReading, sensor_kind, streams_of

if TYPE_CHECKING:
    from ..scene.schema import Joint


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)


class SensorPlace(_Entry):
    """Place of a sensor on the boom; see `boom_twin.types.Place`."""

    section: Annotated[int, Field(ge=1)] | None = None
    at: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = None
    turned: Annotated[float, Field(ge=-2 * pi, le=2 * pi, allow_inf_nan=False)] = 0.0

    @property
    def value(self) -> Place:
        return Place(self.section, self.at, self.turned)


class Sensor(_Entry):
    """Sensor of one channel: quantity = sign * scale * (reading - zero), in `unit`. ``topics.yaml`` explains the keys."""

    name: Annotated[str, Field(min_length=1, max_length=200)]
    unit: str
    sign: Literal[1, -1] = 1
    zero: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    scale: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 1.0
    absolute: Mount | None = None
    place: SensorPlace | None = None


def usual(channel: str) -> dict[str, Any]:
    """Return the default name and unit of a channel."""
    kind, end = sensor_kind(channel), channel.rpartition("_")[2]
    if kind.gives:
        return {"name": channel, "unit": kind.unit}
    name = f"{kind.named}_{end}" if kind.is_named else kind.axes[kind.ends.index(end)]
    return {"name": name, "unit": kind.unit}


def factor(channel: str, sensor: Sensor) -> float:
    """Return the factor of (reading - zero): sign, scale and conversion of the unit to SI.

    A gyro reads a turn about an axis that points to the right of a boom that is raised about the one to its left.
    """
    kind = sensor_kind(channel)
    turn = -1.0 if kind.field == "angular_velocity" else 1.0
    return turn * sensor.sign * sensor.scale * kind.units[sensor.unit]


NO_AREAS = (
    "inputs.cylinder_pressures: bore and rod of the cylinders are not known. Give `oil: {bore, rod, ..}` to each "
    "cylinder of the scene, or bore and rod (lists, m) to inputs.cylinder_pressures in the mapping."
)
_OR_AUTO = WrapValidator(lambda value, check: nan if value == "auto" else check(value))
NODE = "boom_twin"
FRAME = "base_link"  # frame of the base, in which outputs are given unless a mapping or a parameter names another
TIP_JOINTS = ("tip_dx", "tip_dz", "tip_pitch")
"""Displacement of the tip from that of rigid sections: along and across the last section, m, and its rotation, rad."""
DEFAULT_FILE = Path(__file__).parent.parent / "msg_config" / "topics.yaml"


class Output(StrEnum):
    """Outputs that the twin publishes."""

    TIP_DISPLACEMENT = "tip_displacement"
    TIP_POSITION = "tip_position"
    TIP_ACCELERATION = "tip_acceleration"
    JOINT_STATES = "joint_states"
    RESIDUALS = "residuals"
    SHAPE = "shape"
    CHANGES = "changes"
    HEALTH = "health"
    TIP_UNCERTAINTY = "tip_uncertainty"
    ESTIMATE_POSE = "estimate_pose"
    ESTIMATE_TWIST = "estimate_twist"
    ESTIMATE_ACCELERATION = "estimate_acceleration"
    ESTIMATE_LOAD = "estimate_load"
    ESTIMATE_MODES = "estimate_modes"
    DIAGNOSTICS = "diagnostics"


class Qos(_Entry):
    """Quality of service, the three policies that an operator chooses."""

    reliability: Literal["best_effort", "reliable"]
    durability: Literal["volatile", "transient_local"]
    depth: Annotated[int, Field(ge=1, le=10_000)]


class Topic(_Entry):
    """Topic with its type and QoS. The top of ``topics.yaml`` explains the keys."""

    name: Annotated[str, Field(pattern=r"^(~/|/)?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*$")]
    type: str
    qos: Qos
    unit: str
    meaning: str
    required: bool = True

    @property
    def absolute(self) -> str:
        """Name in a bag: a relative name begins with ``/``, a private one with ``/boom_twin``."""
        if self.name.startswith("~/"):
            return f"/{NODE}/{self.name[2:]}"
        return self.name if self.name.startswith("/") else f"/{self.name}"


class InputTopic(Topic):
    """One topic of readings. ``delay`` is NaN where it is estimated (``auto``)."""

    delay: Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False), _OR_AUTO] = 0.0
    reads: Literal["length", "drive"] | None = None
    place: SensorPlace | None = None
    frame_id: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    bore: tuple[Annotated[float, Field(gt=0, le=1)], ...] = ()
    rod: tuple[Annotated[float, Field(gt=0, le=1)], ...] = ()


class EventTopic(Topic):
    """Topic of the operator's marks."""

    type: Literal["rcl_interfaces/msg/Log"]


OneTopic = TypeVar("OneTopic", bound=Topic)


class Topics(_Entry):
    """All topics by role, frame of the outputs, and sensors that differ from the defaults; see `boom_twin.messages.mapping`."""

    frame: Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_/.-]*$", max_length=200)]
    drive: Literal["strokes", "angles"] = "strokes"
    """Readings that drive the model. Where angles do, `inputs` has no strokes."""
    inputs: dict[Stream, InputTopic]
    outputs: dict[Output, Topic]
    events: EventTopic
    sensors: dict[str, Sensor] = {}
    absent: frozenset[str] = frozenset()  # channels without a sensor, marked by ``none`` in the mapping
    ranges: tuple[tuple[float, float], ...] = ()
    """Lowest and highest angle of every joint, rad; empty where the scene is not known."""
    areas: tuple[tuple[float, float], ...] = ()
    """Areas of piston and ring of every cylinder, m^2; empty where they are not known."""

    @property
    def is_shared(self) -> bool:
        """Return True if strokes and angles come by one topic."""
        strokes = self.inputs.get(Stream.STROKES)
        return strokes is not None and strokes.absolute == self.inputs[Stream.ANGLES].absolute

    @property
    def streams_by_topic(self) -> dict[str, list[Stream]]:
        """Streams of every input topic; strokes first."""
        found: dict[str, list[Stream]] = {}
        pressures = [Stream.PRESSURES] if self.areas else []
        for stream in [*streams_of(self.places), *pressures]:
            if (topic := self.inputs.get(Stream(SENSORS[stream].beside or stream))) is not None:
                found.setdefault(topic.name, []).append(stream)
        return found

    @property
    def places(self) -> dict[str, Place]:
        """Places of the sensors that have one, by their names."""
        found = {SENSORS[stream].stem: topic.place.value for stream, topic in self.inputs.items() if topic.place is not None}
        return found | {channel: each.place.value for channel, each in self.sensors.items() if each.place is not None}

    def renamed(self, name: Callable[[Topic], str]) -> Topics:
        """Return these topics, each with the name that `name` returns for it."""

        def new(topic: OneTopic) -> OneTopic:
            return topic.model_copy(update={"name": name(topic)})

        inputs, outputs = ({key: new(topic) for key, topic in each.items()} for each in (self.inputs, self.outputs))
        return self.model_copy(update={"inputs": inputs, "outputs": outputs, "events": new(self.events)})

    def in_namespace(self, namespace: str) -> Topics:
        """Return these topics with their names for a node in `namespace` (``/`` is none)."""
        space = f"/{namespace.strip('/')}" if namespace.strip("/") else ""
        return self.renamed(lambda topic: topic.name if topic.name.startswith("/") else f"{space}{topic.absolute}")

    def of_scene(self, joints: Sequence[Joint]) -> Topics:
        """Return these topics of a scene: joint ranges, which resolve whole turns of encoders, and cylinder areas.

        Raise UsageError if the mapping says that there are pressures, but areas are not known.
        """
        ranges = tuple((radians(low) - GIVE, radians(high) + GIVE) for low, high in (joint.range_deg for joint in joints))
        topics = self.model_copy(update={"ranges": ranges})
        topic, oils = self.inputs[Stream.PRESSURES], [joint.cylinder.oil for joint in joints]
        given: list[tuple[float, float] | None] = [None if oil is None else (oil.bore, oil.rod) for oil in oils]
        if topic.bore or topic.rod:
            if not len(topic.bore) == len(topic.rod) == len(oils):
                told = f"bore and rod have {len(topic.bore)} and {len(topic.rod)} entries, the scene has {len(oils)} cylinders"
                raise UsageError(f"inputs.cylinder_pressures: {told}. Give one for each, m.")
            given = list(zip(topic.bore, topic.rod, strict=True))
            for number, (bore, rod) in enumerate(zip(topic.bore, topic.rod, strict=True), 1):
                if rod >= bore:
                    told = f"cylinder {number} has bore {bore:g} and rod {rod:g} m, and the rod must be thinner"
                    raise UsageError(f"inputs.cylinder_pressures: {told}. Give the diameters, m.")
        areas = [(pi / 4 * bore**2, pi / 4 * (bore**2 - rod**2)) for bore, rod in filter(None, given)]
        if len(areas) == len(oils):
            return topics.model_copy(update={"areas": tuple(areas)})
        if self.has_pressures:
            raise UsageError(NO_AREAS)
        return topics

    @property
    def has_pressures(self) -> bool:
        """Return True if the mapping says that there are pressures."""
        topic = self.inputs[Stream.PRESSURES]
        return topic.required or bool(topic.bore)

    def noise_of(self, settings: Settings) -> Settings:
        """Return the settings with the noise of forces that come from pressures: that of the smallest cylinder.

        The filter learns what is above it.
        """
        if not (self.areas and self.has_pressures):
            return settings
        sigma = settings.pressure_sigma * min(hypot(*areas) for areas in self.areas)
        return settings.model_copy(update={"force_sigma": sigma, "force_resolution": 0.0})

    def lacks(self, channel: str) -> bool:
        """Return True if the mapping says that a channel has no sensor, or does not place one that needs a place."""
        kind = sensor_kind(channel)
        return channel in self.absent or (kind.is_placed and kind.is_named and channel not in self.places)

    def delay(self, stream: Stream) -> int:
        """Return the time from the readings of a stream to their stamps, ns."""
        topic = self.inputs.get(Stream(SENSORS[stream].beside or stream))
        return 0 if topic is None or isnan(topic.delay) else round(topic.delay * SECOND)

    @property
    def lagging(self) -> list[Stream]:
        """Streams whose delay is estimated."""
        found = {Stream(SENSORS[stream].gives or stream) for stream, topic in self.inputs.items() if isnan(topic.delay)}
        return sorted(found, key=list(Stream).index)

    def sensors_of(self, stream: Stream, joints: int) -> dict[str, Sensor]:
        """Return the sensors of a stream by channel, in the order of its samples."""
        return {name: self.sensors.get(name) or Sensor(**usual(name)) for name in SENSORS[stream].channels(joints)}

    def beyond(self, stream: Stream, joints: int, names: Iterable[str]) -> list[str]:
        """Return those of `names` that number a cylinder or joint beyond the joints of the boom.

        An example is ``cylinder_5`` with four joints. A name that a channel reads is left out. The result is empty if the
        mapping names every channel of the stream, because it then says which names are the boom's.
        """
        kind = SENSORS[stream]
        if kind.ends or all(channel in self.sensors or channel in self.absent for channel in kind.channels(joints)):
            return []
        used = {sensor.name for sensor in self.sensors_of(stream, joints).values()}
        numbered = re.compile(rf"{kind.named}_{NUMBER.pattern}")
        return [
            name for name in names if numbered.fullmatch(name) and int(name.rpartition("_")[2]) > joints and name not in used
        ]

    def reading(self, reads: StrokeReading) -> Topics:
        """Return these topics with stroke transducers, if there are any, that read the quantity `reads`."""
        if Stream.STROKES not in self.inputs:
            return self
        strokes = self.inputs[Stream.STROKES].model_copy(update={"reads": reads})
        return self.model_copy(update={"inputs": {**self.inputs, Stream.STROKES: strokes}})

    @property
    def stroke_reading(self) -> StrokeReading:
        """Quantity that drives the model: angles or what stroke transducers read, by the mapping; else lengths."""
        if Stream.STROKES not in self.inputs:
            return StrokeReading.ANGLE
        return StrokeReading(self.inputs[Stream.STROKES].reads or StrokeReading.LENGTH)

    def mounts(self, joints: int) -> list[Mount | None]:
        """Return the mounts of a boom's inclinometers, one entry for each joint; None is an encoder."""
        return [sensor.absolute for sensor in self.sensors_of(Stream.ANGLES, joints).values()]

    def sensing(self, joints: int) -> dict[str, Any]:
        """Return the arguments of `boom_twin.Twin` that describe the sensors."""
        read = {name: Channel(name, each.unit, each.sign, each.zero, each.scale) for name, each in self.sensors.items()}
        found: dict[str, Any] = {"reads": self.stroke_reading, "mounts": self.mounts(joints), "absent": self.absent}
        return found | {"places": self.places, "lagging": self.lagging, "declared": read}


@cache
def load_topics() -> Topics:
    """Return the topics of the package with default sensors; the file is read once."""
    return Topics.model_validate({**default_document(), "inputs": used_inputs(default_document()["inputs"], {})})


def type_of(output: Output) -> str:
    """Return the one message type that the program fills for an output."""
    return load_topics().outputs[output].type


@cache
def every_input() -> dict[Stream, InputTopic]:
    """Return all inputs of the package, with those that a boom has only if its mapping names them."""
    return {Stream(role): InputTopic.model_validate(topic) for role, topic in default_document()["inputs"].items()}


def used_inputs(inputs: Mapping[str, Any], sensors: Mapping[str, Sensor]) -> dict[str, Any]:
    """Return the inputs without those of sensors that no place is given for: as in the package, or under `sensors`."""
    usual = default_document()["inputs"]
    placed = {stream.value for stream, kind in SENSORS.items() if kind.is_placed}
    if any(sensor.place is not None for sensor in sensors.values()):
        placed.discard(Stream.MOMENTS.value)
    return {role: topic for role, topic in inputs.items() if role not in placed or topic != usual[role]}


@cache
def default_document() -> Any:
    """Return the content of the package's own file. Do not modify it."""
    return read_plain(DEFAULT_FILE, UsageError, "Install the package anew.")
