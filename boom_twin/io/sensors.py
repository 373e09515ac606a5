"""How a rig's own sensors read: names, signs, zeros, scales and units, as a mapping lists them channel by channel."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from ..errors import Fault
from ..records import Mount, Stream, channels_of

GRAVITY = 9.80665
"""m/s^2 of one g, by definition."""

UNITS: dict[Stream, dict[str, float]] = {
    Stream.STROKES: {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254},
    Stream.ANGLES: {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0, "gon": math.pi / 200.0},
    Stream.IMU: {"m/s^2": 1.0, "g": GRAVITY, "mg": 1e-3 * GRAVITY},
}
"""How much of the SI unit each unit is."""

AXES = ("x", "y", "z")
KINDS = {"cylinder": Stream.STROKES, "joint": Stream.ANGLES}
CHANNEL = re.compile(r"(?P<kind>cylinder|joint)_(?P<number>[1-9]\d{0,3})|tip_imu_(?P<axis>[xz])")


class Sensor(BaseModel):
    """One channel: quantity = sign * scale * (reading - zero), in the unit. The keys are explained in ``topics.yaml``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(min_length=1, max_length=200)]
    unit: str
    sign: Literal[1, -1] = 1
    zero: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    scale: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 1.0
    absolute: Mount | None = None


def stream_of(channel: str) -> Stream | None:
    """Where a channel comes by; None if there can be no such channel."""
    match = CHANNEL.fullmatch(channel)
    return None if match is None else KINDS.get(match["kind"] or "", Stream.IMU)


def number_of(channel: str) -> int:
    """Of a channel ``cylinder_i`` or ``joint_i``: i."""
    return int(channel.rpartition("_")[2])


def channels(stream: Stream, joints: int) -> list[str]:
    """The channels of a stream in the order of its samples, for a boom of so many joints."""
    return list(channels_of(joints)[stream])


def usual(channel: str) -> dict[str, Any]:
    """Name and unit of a channel that no mapping names."""
    stream = stream_of(channel)
    assert stream is not None
    return {"name": channel[-1] if stream is Stream.IMU else channel, "unit": next(iter(UNITS[stream]))}


def factor(channel: str, sensor: Sensor) -> float:
    """By what reading minus zero is multiplied."""
    stream = stream_of(channel)
    assert stream is not None
    return sensor.sign * sensor.scale * UNITS[stream][sensor.unit]


def kind_faults(channel: str, given: Mapping[str, Any]) -> Iterator[Fault]:
    """What a channel of this kind cannot have, of the keys as they stand in the file."""
    stream, place = stream_of(channel), f"sensors.{channel}"
    assert stream is not None
    if (unit := given.get("unit", usual(channel)["unit"])) not in list(UNITS[stream]):
        yield Fault(f"{place}.unit", unit, f"it must be one of {', '.join(UNITS[stream])}", "Use scale for any other.")
    if stream is not Stream.ANGLES and (mount := given.get("absolute")) is not None:
        yield Fault(f"{place}.absolute", mount, "only an angle (joint_i) can be absolute", "Remove the key.")
    if stream is Stream.IMU and (name := given.get("name", "x")) not in AXES:
        yield Fault(f"{place}.name", name, "it must be x, y or z", "Give the axis of linear_acceleration.")


def set_faults(names: Mapping[str, str], joints: int, is_shared: bool) -> Iterator[Fault]:
    """Channels that a boom of so many joints does not have, and names that two channels of one topic have.

    Parameters
    ----------
    names : mapping of str to str
        The names of the channels that a mapping lists; all others have their usual ones.
    joints : int
    is_shared : bool
        Whether strokes and angles come by one topic.
    """
    known = {stream: channels(stream, joints) for stream in Stream}
    for channel in names:
        if not any(channel in group for group in known.values()):
            bound = f"the scene has {joints} joints, so channels end at {channel.split('_')[0]}_{joints}"
            yield Fault(f"sensors.{channel}", channel, bound, "Remove it, or use the scene that this mapping is for.")
    groups = [known[Stream.STROKES], known[Stream.ANGLES], known[Stream.IMU]]
    for group in [groups[0] + groups[1], groups[2]] if is_shared else groups:
        users: dict[str, str] = {}
        for channel in group:
            name = names.get(channel, usual(channel)["name"])
            if name in users:
                bound = f"{users[name]} has this name too, in the same messages"
                yield Fault(f"sensors.{channel}.name", name, bound, "Give each channel its own name.")
            users.setdefault(name, channel)
