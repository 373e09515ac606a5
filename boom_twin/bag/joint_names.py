"""Check that the cylinders and joints that a session names are those of the scene."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping

from ..errors import BagError
from ..messages.sample_decoder import MOST_NAMES
from ..messages.topic_table import Topics
from ..types import SENSORS, Stream
from .reader import Session, read

NAMING_TIME = 5_000_000_000  # log time (ns) from the first message of strokes or angles, in which all names are read

KINDS = {stream: kind.named for stream, kind in SENSORS.items() if kind.is_named and not kind.ends}
NAMES_TOLD = 12  # limit for the number of names in a sentence


def refuse_other_names(session: Session, topics: Topics, joints: int, scene: str = "") -> None:
    """Raise BagError if a session names other cylinders or joints than a scene has.

    Parameters
    ----------
    scene : str
        Source of the scene; empty if unknown.
    """
    for sentence in other_names(topics, _names(session, topics, joints), joints, scene):
        raise BagError(f"{session.path}: {sentence}")


DRIVE_REMEDY = (
    "If this boom has no stroke transducers, write `drive: angles` in a mapping (--mapping; the node: parameter mapping)."
)


def refuse_missing_drive(session: Session, topics: Topics) -> None:
    """Raise BagError if strokes drive the model, and a session has angles but no strokes."""
    for sentence in missing_drive(session, topics):
        raise BagError(f"{session.path}: {sentence}")


def missing_drive(session: Session, topics: Topics) -> Iterator[str]:
    """Yield the error sentence of `refuse_missing_drive`, if any."""
    strokes = topics.inputs.get(Stream.STROKES)
    found = [session.find(topic.name) for topic in (strokes, topics.inputs[Stream.ANGLES]) if topic is not None]
    counts = [0 if topic is None else topic.count for topic in found]
    if strokes is not None and counts[0] == 0 < counts[1]:
        name = topics.inputs[Stream.ANGLES].absolute
        yield f"no strokes ({strokes.absolute}), but {counts[1]} messages of {name}. {DRIVE_REMEDY}"


def other_names(topics: Topics, names: Mapping[Stream, Collection[str]], joints: int, scene: str) -> Iterator[str]:
    """Yield an error sentence for each conflict between `names` of a session and a scene of `joints` joints.

    Cylinders and joints beyond the scene are a conflict. A sensor that drives the model and is never named is a conflict, too:
    the prediction needs it. Other unknown or missing names are ignored.
    """
    for stream, found in names.items():
        if beyond := topics.beyond(stream, joints, found):
            yield extra_names_message(topics.inputs[stream].absolute, beyond, stream, joints, scene)
    drive = topics.stroke_reading.stream
    found = names.get(drive, ())
    lacking = [sensor.name for sensor in topics.sensors_of(drive, joints).values() if sensor.name not in found]
    if found and lacking:
        angles = {sensor.name for sensor in topics.sensors_of(Stream.ANGLES, joints).values()}
        is_alone = topics.is_shared and len(lacking) == joints and angles.issubset(found)
        yield (
            f"{topics.inputs[drive].absolute} never names {_listed(lacking)}, but {_listed(found)}; "
            f"{_scene(scene)} has {_counted(joints, KINDS[drive])}. Give that of this boom by --scene, or its names by "
            "--mapping." + (f" {DRIVE_REMEDY}" if is_alone else "")
        )


def extra_names_message(topic: str, names: Collection[str], stream: Stream, joints: int, scene: str) -> str:
    """Return the message, with remedy, for a topic that names cylinders or joints beyond those of the scene."""
    kind = KINDS[stream]
    return (
        f"{topic} names {_listed(names)}; {_scene(scene)} has {_counted(joints, kind)}, so this is another boom. "
        f"Give its scene by --scene (the node: parameter scene), or a mapping whose sensors list every {kind} of this one."
    )


def strange_names_message(topic: str, lacking: Collection[str], strange: Collection[str]) -> str:
    """Return the message, with remedy, for a topic that lacks names of the scene and has unknown ones."""
    return (
        f"{topic} names {_listed(strange)}, but not {_listed(lacking)}, which the scene has: if they are the same, correct "
        "them at their source, or give the mapping these names"
    )


def _scene(source: str) -> str:
    return f"the scene ({source})" if source else "the scene"


def _listed(names: Iterable[str]) -> str:
    first = list(dict.fromkeys(names))
    return ", ".join(first[:NAMES_TOLD]) + (f" and {len(first) - NAMES_TOLD} more" if len(first) > NAMES_TOLD else "")


def _counted(number: int, kind: str) -> str:
    return f"{number} {kind}{'s' if number > 1 else ''}"


def _names(session: Session, topics: Topics, joints: int) -> dict[Stream, dict[str, None]]:
    """Return the names in messages of strokes and angles, read for `NAMING_TIME` and until all driving sensors are named."""
    heard = {name: [stream for stream in streams if stream in KINDS] for name, streams in topics.heard.items()}
    present = {name: streams for name, streams in heard.items() if streams and (t := session.find(name)) and t.count}
    if not present:
        return {}
    found: dict[Stream, dict[str, None]] = {stream: {} for streams in present.values() for stream in streams}
    drive = topics.stroke_reading.stream
    needed = {sensor.name for sensor in topics.sensors_of(drive, joints).values()}
    first: int | None = None
    for name, log, message in read(session, {name: topics.inputs[streams[0]].type for name, streams in present.items()}):
        first = log if first is None else first
        for stream in present[name]:
            if len(found[stream]) < MOST_NAMES:
                found[stream].update(dict.fromkeys(message.name[:MOST_NAMES]))
        if log - first > NAMING_TIME and needed <= found.get(drive, {}).keys():
            break
    return found
