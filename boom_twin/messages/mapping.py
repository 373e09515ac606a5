"""Read a mapping file: which topics and sensors a rig has, and how their readings are converted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isnan
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from ..config.settings import nearest
from ..config.yaml_text import read_plain
from ..errors import Fault, UsageError, bound_of, listed
from ..types import NUMBERED_SIDE, SENSORS, Stream, sensor_kind, stream_of
from .topic_table import InputTopic, Qos, Sensor, SensorPlace, Topic, Topics, default_document, load_topics, used_inputs, usual

NO_LAG = frozenset({Stream.FORCES, Stream.PRESSURES, Stream.MOMENTS})  # zeros that change with the posture hide a lag

_REMEDIES = {
    "name": "Give the name as it is published.",
    "sign": "Give 1, or -1 for a sensor that counts the other way.",
    "zero": "Give what the sensor reads where the quantity is 0, in its unit.",
    "scale": "Give the factor that corrects the sensor, 1.0 for one that is right; turn it round by sign.",
    "unit": "Give the unit of the published values.",
    "absolute": "Give root or head, where on its section the inclinometer sits, with _compensated if a gyro corrects it; "
    "leave it out for an encoder.",
    "drive": "Give angles for a boom without stroke transducers; else leave it out.",
    "depth": "Give a number of messages.",
    "delay": "Give the seconds by which the stamps come after the readings, or auto.",
    "section": "Give the number of a section, 1 at the base.",
    "at": "Give the distance from the section's inboard pivot along it, m.",
    "turned": "Give the angle of the sensor's x axis to the section, rad, positive anticlockwise.",
    "frame_id": "Give header.frame_id of its messages.",
    "bore": "Give a list of diameters, m, one for each cylinder.",
    "rod": "Give a list of diameters, m, one for each cylinder.",
    "place": "Give section, at and turned.",
    "reads": "Give length for a transducer in or on the cylinder; drive only for sessions of a simulated boom.",
    "frame": "Give the name of a frame without a leading slash: base_link.",
}
_SEE = "See the comments in msg_config/topics.yaml."


def load_mapping(path: Path | None = None, joints: int | None = None) -> Topics:
    """Return the topics and sensors of a YAML file, or those of the package if no path is given.

    What the file does not name is from the package. If the number of `joints` of the scene is given, channels beyond it are
    faults, too. Raise UsageError if the file cannot be read, or has faults: the message lists each with path, value, bound and
    remedy.
    """
    if path is None:
        return load_topics()
    return mapping_from(read_plain(path, UsageError, "Give a file as `boom_twin mapping` prints it."), str(path), joints)


def mapping_from(document: Any, source: str, joints: int | None = None) -> Topics:
    """Return the topics and sensors of a document read from `source`. UsageError lists all faults, as in `load_mapping`."""
    if not isinstance(document, dict | None):
        raise UsageError(f"{source}: a list or a value: keys inputs, outputs, sensors are needed. {_SEE}")
    usual_values = default_document()
    values = _merged(usual_values, document or {})
    faults = _role_faults(values, usual_values)
    sensors = values.pop("sensors", None) or {}
    absent = frozenset[str]()
    if isinstance(sensors, dict):
        absent = frozenset(channel for channel, given in sensors.items() if given == "none")
    sensors, names, found = _sensors(sensors, values.get("drive") == "angles")
    faults += found
    if isinstance(values["inputs"], dict):
        values["inputs"] = used_inputs(values["inputs"], sensors)
    topics: Topics | None = None
    try:
        topics = Topics.model_validate(values)
        faults += [*_name_faults(topics), *_input_faults(topics)]
    except ValidationError as error:
        faults += [_fault(detail) for detail in error.errors(include_url=False)]
    if joints is not None:
        faults += _set_faults(names, joints, topics is not None and topics.is_shared)
    if faults or topics is None:
        raise UsageError(listed(source, faults))
    if topics.has_pressures:  # a force needs both sides
        absent |= {f"cylinder_force_{each.split('_')[1]}" for each in absent if NUMBERED_SIDE.fullmatch(each)}
    inputs = topics.inputs
    if topics.drive == "angles":
        inputs = {stream: topic for stream, topic in inputs.items() if stream is not Stream.STROKES}
    return topics.model_copy(update={"inputs": inputs, "sensors": sensors, "absent": absent})


def _merged(base: Any, own: Any) -> Any:
    """Return `own`, with missing keys taken from `base`."""
    if not (isinstance(base, dict) and isinstance(own, dict)):
        return own
    return {**base, **{key: _merged(base.get(key), value) for key, value in own.items()}}


def _role_faults(values: dict[str, Any], usual_values: dict[str, Any]) -> list[Fault]:
    """Return faults for unknown roles and for types other than those of their roles. Remove unknown roles from `values`."""
    faults: list[Fault] = []
    for side in ("inputs", "outputs"):
        if not isinstance(values[side], dict):
            continue
        for role in [role for role in values[side] if role not in usual_values[side]]:
            remedy = f"The nearest is `{nearest(str(role), usual_values[side])}`."
            faults.append(Fault(f"{side}.{role}", values[side].pop(role), "unknown topic", remedy))
        for role, topic in values[side].items():
            if isinstance(topic, dict) and topic["type"] != (usual_type := usual_values[side][role]["type"]):
                bound = f"only {usual_type} is read or filled there"
                faults.append(Fault(f"{side}.{role}.type", topic["type"], bound, "Leave the key out."))
    return faults


def _sensors(values: Any, is_driven_by_angles: bool) -> tuple[dict[str, Sensor], dict[str, str], list[Fault]]:
    """Return the sensors that are valid by themselves, the names of all, and the faults."""
    drive, bound = Stream.STROKES, "every cylinder's stroke drives the model"
    if is_driven_by_angles:
        drive, bound = Stream.ANGLES, "every joint's angle drives the model"
    if not isinstance(values, dict):
        return {}, {}, [Fault("sensors", values, "a block of channels is needed", _SEE)]
    sensors: dict[str, Sensor] = {}
    names: dict[str, str] = {}
    faults: list[Fault] = []
    for channel, given in values.items():
        if stream_of(str(channel)) is None:
            faults.append(Fault(f"sensors.{channel}", given, f"channels are {_known_channels()}", "Name one of them."))
            continue
        if given == "none":
            names[channel] = usual(channel)["name"]
            if stream_of(channel) is drive:
                faults.append(Fault(f"sensors.{channel}", given, bound, "Name its sensor."))
            continue
        merged = _merged(usual(channel), given or {})
        if isinstance(merged, dict):
            names[channel] = str(merged["name"])
            faults += _kind_faults(channel, merged)
        try:
            sensors[channel] = Sensor.model_validate(merged)
        except ValidationError as error:
            faults += [_fault(detail, "sensors", channel) for detail in error.errors(include_url=False)]
    return sensors, names, faults


def _kind_faults(channel: str, given: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield faults for keys, as in the file, that a channel of this kind cannot have."""
    kind, place = sensor_kind(channel), f"sensors.{channel}"
    if (unit := given.get("unit", kind.unit)) not in list(kind.units):
        yield Fault(f"{place}.unit", unit, f"it must be one of {', '.join(kind.units)}", "Use scale for any other.")
    if kind is not SENSORS[Stream.ANGLES] and (mount := given.get("absolute")) is not None:
        yield Fault(f"{place}.absolute", mount, "only an angle (joint_i) can be absolute", "Remove the key.")
    if kind is not SENSORS[Stream.MOMENTS] and given.get("place") is not None:
        yield Fault(f"{place}.place", "given", "only a moment_i has a place", "Give the place of an IMU under inputs.")
    if not kind.is_named and (name := given.get("name", "x")) not in ("x", "y", "z"):
        yield Fault(f"{place}.name", name, "it must be x, y or z", f"Give the axis of {kind.field}.")


def _set_faults(names: Mapping[str, str], joints: int, is_shared: bool) -> Iterator[Fault]:
    """Yield faults for channels beyond the joints, and for names that two channels of one topic share.

    `names` are those that a mapping lists by channel; `is_shared` is True if strokes and angles come by one topic.
    """
    known = {stream: kind.channels(joints) for stream, kind in SENSORS.items()}
    for channel in names:
        if not any(channel in group for group in known.values()):
            bound = f"the scene has {joints} joints, so channels end at {sensor_kind(channel).stem}_{joints}"
            yield Fault(f"sensors.{channel}", channel, bound, "Remove it, or use the scene that this mapping is for.")
    first, second, *others = known.values()
    for group in [first + second, *others] if is_shared else known.values():
        users: dict[str, str] = {}
        for channel in group:
            name = names.get(channel, usual(channel)["name"])
            if name in users:
                bound = f"{users[name]} has this name too, in the same messages"
                yield Fault(f"sensors.{channel}.name", name, bound, "Give each channel its own name.")
            users.setdefault(name, channel)


def _known_channels() -> str:
    kinds = SENSORS.values()
    *most, last = [name for kind in kinds for name in (kind.channels(0) or (kind.channels(1)[0], f"{kind.channels(2)[-1]} .."))]
    return f"{', '.join(most)} and {last}"


def _fault(detail: ErrorDetails, *before: str) -> Fault:
    """Return a pydantic error as a fault of the file. `before` is the path of the validated value in the file."""
    place = [*before, *map(str, detail["loc"])]
    if detail["type"] == "extra_forbidden":
        near = nearest(place[-1], [*_model_at(place).model_fields])
        return Fault(".".join(place), detail["input"], "unknown key", f"The nearest known key here is `{near}`.")
    return Fault(".".join(place), detail["input"], bound_of(detail["msg"]), _REMEDIES.get(place[-1], _SEE))


def _model_at(place: list[str]) -> type[BaseModel]:
    if "place" in place[:-1]:
        return SensorPlace
    if place[0] == "sensors" and len(place) > 1:
        return Sensor
    if "qos" in place[:-1]:
        return Qos
    return {"inputs": InputTopic}.get(place[0], Topic) if len(place) > 1 else Topics


def _name_faults(topics: Topics) -> Iterator[Fault]:
    """Yield faults for names that two topics share. Strokes and angles may share a name if their QoS is equal."""
    present: dict[str, Topic] = {f"inputs.{stream.value}": topic for stream, topic in topics.inputs.items()}
    present |= {f"outputs.{key.value}": topic for key, topic in topics.outputs.items()} | {"events": topics.events}
    users: dict[str, str] = {}
    for place, topic in present.items():
        first = users.setdefault(topic.absolute, place)
        if {first, place} == {"inputs.cylinder_strokes", "inputs.joint_angles"}:
            if topic.qos != present[first].qos:
                bound = f"{first} is the same topic with another"
                yield Fault(f"{place}.qos", topic.qos.model_dump(), bound, "Give both the same.")
        elif first != place:
            yield Fault(f"{place}.name", topic.name, f"{first} has this name too", "Give each its own name.")


def _input_faults(topics: Topics) -> Iterator[Fault]:
    """Yield faults for a delay of what drives the model, whose stamps all outputs have, and for keys of another input."""
    for stream, topic in topics.inputs.items():
        place, keys, is_named = f"inputs.{stream.value}", topic.model_dump(), SENSORS[stream].is_named
        for key, owner, has_key in (
            ("bore", "only cylinder_pressures has it", stream is Stream.PRESSURES),
            ("rod", "only cylinder_pressures has it", stream is Stream.PRESSURES),
            ("reads", "only cylinder_strokes has it", stream is Stream.STROKES),
            ("place", "only IMUs and points have it", not is_named),
            ("frame_id", "only IMUs and points have it", not is_named),
        ):
            if keys[key] and not has_key:
                yield Fault(f"{place}.{key}", keys[key], owner, "Remove the key.")
        if topic.place is None and SENSORS[stream].is_placed and not is_named:
            told = "it must be there: section, at (m), turned (rad)"
            yield Fault(f"{place}.place", None, told, "Give {} for the tip.")
        if isnan(topic.delay) and stream in NO_LAG:
            told = "auto is not for forces, pressures and moments: their zeros change with the posture, which hides a lag"
            yield Fault(f"{place}.delay", "auto", told, "Give the seconds, or leave the key out.")
    drive, named = (Stream.ANGLES, "an angle") if topics.drive == "angles" else (Stream.STROKES, "a stroke")
    if delay := topics.inputs[drive].delay:
        bound = f"every output has the stamp of {named} sample, so the other streams' delays count against it"
        given, others = ("auto", "auto") if isnan(delay) else (delay, f"{-delay:g}")
        yield Fault(f"inputs.{drive.value}.delay", given, bound, f"Give the others {others} instead.")
