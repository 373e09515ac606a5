"""Arguments that several commands have, and the parsing of their values."""

from __future__ import annotations

import re
from argparse import REMAINDER, SUPPRESS, ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import UsageError
from ..types import Place, Stream

if TYPE_CHECKING:
    from ..bag.session_file import TimeWindow
    from ..scene.schema import Scene


SESSION = "a rosbag2 directory, a directory of its files, or one file: .mcap, .db3, .bag of ROS 1, .csv"
SESSION_SCENE = "scene file (YAML); without it, the one that the session was made with, else the default scene"


def add_scene(parser: ArgumentParser) -> None:
    """Declare the scene file, as ``--scene`` or as a positional argument; without it, the default scene."""
    either = parser.add_mutually_exclusive_group()
    either.add_argument("--scene", metavar="SCENE", help="scene file (YAML); without it, the default scene")
    either.add_argument("scene", nargs="?", default=SUPPRESS, metavar="SCENE", help="scene file, as with --scene")


def add_place(parser: ArgumentParser) -> Any:
    """Declare ``--posture``, ``--strokes`` and ``--lengths``, of which one is needed; return their group."""
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--posture", metavar="P", help="posture, or section angles to the horizontal, deg: 60,-20,-30")
    where.add_argument("--strokes", type=numbers, metavar="S1,..,SN", help="strokes of the drives (oil unloaded), m")
    read = "cylinder lengths less closed_length, m: what stroke transducers read of the boom at rest"
    where.add_argument("--lengths", type=numbers, metavar="L1,..,LN", help=read)
    return where


def add_file(parser: ArgumentParser, option: str, purpose: str, metavar: str = "FILE") -> None:
    parser.add_argument(option, metavar=metavar, type=Path, help=purpose)


def add_session(
    parser: ArgumentParser, params: bool = True, mapping: bool = True, scene: str = SESSION_SCENE, namespace: bool = True
) -> None:
    """Declare the options by which a recorded session is read: scene, parameters, mapping, namespace, window."""
    parser.add_argument("--scene", metavar="SCENE", help=scene)
    if params:
        add_file(parser, "--params", "ROS parameter file (default: as recorded, else the package's twin.yaml)")
    if mapping:
        purpose = "mapping of topics and sensors (default: as recorded, else what `boom_twin mapping` prints)"
        add_file(parser, "--mapping", purpose)
    if namespace:
        add_namespace(parser, "ROS namespace of the node in the session, for its topics" + " and --params" * params)
    begin = "begin S seconds after the first sample (default 0); the model starts at rest there"
    parser.add_argument("--start", type=not_negative, default=0.0, metavar="S", help=begin)
    parser.add_argument("--duration", type=positive, metavar="S", help="read S seconds (default: all)")


def window_of(args: Namespace) -> TimeWindow:
    from ..bag.session_file import TimeWindow

    return TimeWindow(args.start, args.duration)


def add_json(parser: ArgumentParser) -> None:
    """Declare ``--json``: stdout holds exactly one flat JSON object."""
    parser.add_argument("--json", action="store_true", help="print exactly one flat JSON object on stdout")


def add_ros_args(parser: ArgumentParser) -> None:
    """Declare ``--namespace`` and ``--ros-args``, for `ros_arguments`."""
    add_namespace(parser, "ROS namespace of the twin: --namespace front is short for --ros-args -r __ns:=/front")
    purpose = "namespace, remappings and enclave, as for any node: -r cylinder_strokes:=/rig/strokes -e /boom_twin/recorder"
    parser.add_argument("--ros-args", nargs=REMAINDER, default=[], help=purpose)


def add_namespace(parser: ArgumentParser, purpose: str) -> None:
    parser.add_argument("--namespace", type=_namespace, metavar="NAME", default="", help=purpose)


def _namespace(text: str) -> str:
    if not re.fullmatch(r"/?([A-Za-z_]\w*(/[A-Za-z_]\w*)*)?/?", text, re.ASCII):
        raise ArgumentTypeError(f"'{text}': each part must begin with a letter or _, then letters, digits and _; like front")
    return text


def ros_arguments(args: Namespace) -> list[str]:
    namespace = args.namespace.strip("/")
    return ["--ros-args", *(["-r", f"__ns:=/{namespace}"] if namespace else []), *args.ros_args]


def files_of(args: Namespace, *names: str) -> list[Path]:
    """Return the paths that these arguments name, one or several each, without those that are not given."""
    values = [getattr(args, name) for name in names]
    return [Path(path) for value in values if value for path in (value if isinstance(value, list) else [value])]


def refuse_given(args: Namespace, remedy: str, *names: str) -> None:
    """Raise UsageError, with the `remedy`, if one of these arguments is given."""
    for name in names:
        value = getattr(args, name)
        if value is not None and value is not False and value != "":
            first = value[0] if isinstance(value, list) else value
            shown = "" if value is True else f" {first:g}" if isinstance(first, float) else f" {first}"
            raise UsageError(f"--{name.replace('_', '-')}{shown}: {remedy}")


SENSORS = {"angles": Stream.ANGLES, "imu": Stream.IMU, "gyro": Stream.RATE, "forces": Stream.FORCES}
"""Sensors beside strokes by their names in ``--sensors``."""
PLACE = "SECTION:AT[:TURNED]"
FURTHER = {"imu": ("imu_2", "imu_3", "imu_4"), "point": ("points", "points_2")}
"""Names of the sensors that a boom may have at places, by kind; a moment is that of its section."""
SENSOR_LIST = (
    f"{', '.join(SENSORS)} (a gyro is that of the tip IMU); imu@{PLACE}, gyro@.., moment@.., point@..: elsewhere, AT m along "
    "the section from its inboard pivot, turned by TURNED rad (example: angles,imu,imu@2:3.1)"
)


def sensors_of(text: str, scene: Scene) -> list[tuple[str, Stream, dict[str, Place]]]:
    """Return name, stream and place of the sensors between commas, see `SENSOR_LIST`. A gyro is part of the IMU at its place.

    UsageError for an unknown name, a place off the boom, or too many places.
    """
    chosen, found = list[tuple[str, Stream, dict[str, Place]]](), dict[tuple[str, str], dict[str, Place]]()
    for name in filter(None, (part.strip() for part in text.split(","))):
        kind, _, at = name.partition("@")
        if not at and name in SENSORS:
            chosen.append((name, SENSORS[name], {}))
        elif at and kind in ("imu", "gyro", "moment", "point"):
            holder = "imu" if kind == "gyro" else kind
            if (holder, at) not in found:
                taken = {stem for (other, _), places in found.items() if other == holder for stem in places}
                found[holder, at] = _placed(holder, at, taken, scene)
            (stem,) = found[holder, at]
            stream = Stream.MOMENTS if kind == "moment" else Stream(stem + "_rate" * (kind == "gyro"))
            chosen.append((name, stream, found[holder, at]))
        else:
            raise UsageError(f"--sensors {text}: {name!r} is no sensor. Give some of {SENSOR_LIST}.")
    return chosen


def _placed(kind: str, text: str, taken: set[str], scene: Scene) -> dict[str, Place]:
    """Return the place that is written as `PLACE` says, by a name of its kind that is not among those `taken`."""
    section, _, rest = text.partition(":")
    at, _, turned = rest.partition(":")
    try:
        place = Place(number := int(section), float(at), float(turned or 0.0))
    except ValueError:
        raise UsageError(f"{kind}@{text}: section, place (m) and turn (rad) must be numbers. Write {kind}@{PLACE}.") from None
    count = len(scene.sections)
    if not 1 <= number <= count:
        raise UsageError(f"{kind}@{text}: section = {section}, the boom has sections 1 to {count}. Give one of them.")
    length, beam = scene.sections[number - 1].length, scene.sections[number - 1].beam
    if not (0.0 <= float(at) <= length and isfinite(place.turned)):
        told = f"section {section} reaches from 0 to {length:g} m. Give the distance from its inboard pivot."
        raise UsageError(f"{kind}@{text}: {told}")
    if kind == "moment" and not (beam and scene.is_flexible(number - 1) and beam[0] < float(at) < beam[1]):
        bends = f"bends from {beam[0]:g} to {beam[1]:g} m" if beam and scene.is_flexible(number - 1) else "is rigid"
        raise UsageError(f"moment@{text}: section {section} {bends}; strain is read on a beam only. Give another place.")
    names = FURTHER.get(kind, (f"moment_{section}",))
    if not (free := [name for name in names if name not in taken]):
        where = "on one section" if kind == "moment" else "on a boom"
        raise UsageError(f"{kind}@{text}: at most {len(names)} of this kind are possible {where}. Leave one out.")
    return {free[0]: place}


def positive(text: str) -> float:
    value = not_negative(text)
    if value == 0.0:
        raise ArgumentTypeError(f"{text}: must be > 0")
    return value


def not_negative(text: str) -> float:
    """Parse a finite number of at least 0."""
    try:
        value = float(text)
    except ValueError:
        raise ArgumentTypeError(f"{text}: not a number") from None
    if not 0.0 <= value < inf:
        raise ArgumentTypeError(f"{text}: must be >= 0 and finite")
    return value


def at_least(least: int) -> Callable[[str], int]:
    """Return a parser of whole numbers of at least `least`."""

    def read(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise ArgumentTypeError(f"{text}: must be a whole number of at least {least}")
        return int(text)

    return read


def numbers(text: str) -> list[float]:
    """Parse numbers between commas."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not a list of numbers like 0.1,0.2") from None
