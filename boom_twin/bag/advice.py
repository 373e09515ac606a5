"""Statements on a session: what a replay lacks, names that are not those of the scene, topics that can be published."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..errors import BagError
from ..messages.cdr_decoder import CdrDecoder
from ..messages.sample_decoder import MOST_NAMES
from ..messages.topic_table import Qos, Topic, Topics
from ..system.terminal_text import several
from ..types import NANO, SECOND, SENSORS, Stream
from .inspect import BagInfo, Tally, spacing_faults
from .metadata import profiles
from .reader import Session, TopicInfo, check_topic, read_blocks, readable
from .session_file import CDR
from .session_model import mapping_of

SKEW = 0.05
"""Threshold (s) for a reported clock difference. A boom moves by centimetres in that time."""


def missing(info: BagInfo, topics: Topics, joints: int, scene: str = "", gap: float = math.inf) -> list[str]:
    """Return a sentence for each input of a replay that the session lacks, the worst first.

    `scene` is the source of the scene, named in the sentences. `gap` (s) is the setting of that name.
    """
    found: list[str] = []
    with suppress(BagError):  # the loop below tells it
        found.extend(conflicts(info.session, topics, joints, scene))
    for stream, topic in topics.inputs.items():
        if not SENSORS[stream].lack and not info.session.count(topic.name):
            continue
        try:
            name = check_topic(info.session, topic.name, topic.type).name
            for file in info.session.files:
                readable(file, {name: topic.type})
        except BagError as error:
            reason = str(error).removeprefix(f"{info.session.path}: ")
            found.append(f"{reason} Without it {SENSORS[stream].lack}." if SENSORS[stream].lack else reason)
            continue
        if (tally := info.tally(topic.name)) is not None:
            found += _stamps(tally)
            usual = float(np.median(np.abs(np.diff(tally.stamps)))) * NANO if tally.count > 1 else 0.0
            if stream is topics.stroke_reading.stream and usual > gap:
                found.append(
                    f"{tally.name}: most stamps are {usual:.3g} s apart. The setting gap, {gap:g} s, leaves such samples out. "
                    "Record at 10 Hz or more, or raise gap in a file for --params."
                )
    return found


def remarks(info: BagInfo, topics: Topics) -> list[str]:
    """Return remarks on checksums, origin, clocks and messages that are not read."""
    found: list[str] = []
    is_table = info.session.files[0].storage == "csv"
    if is_table:
        found.append("A table has no checksums and no note of its origin. `boom_twin import` makes a session with both.")
    if not info.session.checked and not is_table:
        found.append("No checksums: a flipped bit cannot be noticed. Record with `boom_twin record`.")
    if info.synthetic is None and not is_table:
        found.append("Its origin is not noted, so whether a rig made it is unknown. Record with --origin.")
    inputs = topics.inputs.values()
    for topic in inputs:
        found += _passed_over(info.session, topic)
    known = [(tally.name, tally.skew.mean) for topic in inputs if (tally := info.tally(topic.name)) and tally.skew]
    if known and abs(skew := known[0][1]) > SKEW:
        side = "after" if skew > 0.0 else "before"
        found.append(
            f"Log times are on average {abs(skew):.3f} s {side} the stamps of {known[0][0]}. Results go by the stamps."
        )
    for (one, skew), (other, other_skew) in pairwise(known):
        if abs(apart := other_skew - skew) > SKEW:
            where = "before" if apart > 0.0 else "after"
            found.append(
                f"Clocks of {one} and {other} differ: on average {other} is stamped {abs(apart):.3f} s {where} "
                f"its log time, compared with {one}. Synchronise the sensors' clocks."
            )
    return found


def _passed_over(session: Session, topic: Topic) -> Iterator[str]:
    """Yield a sentence for each channel of the topic with an unread message type or encoding."""
    for file in session.files:
        for channel in file.channels.values():
            kind, encoding = file.type_of(channel), channel.message_encoding
            if channel.topic == topic.absolute and (kind, encoding) != (topic.type, CDR) and file.counts.get(channel.id):
                yield (
                    f"{channel.topic}: {file.counts[channel.id]} messages of {file.path.name} are {kind or 'of no type'} in "
                    f"{encoding or 'no encoding'} and are passed over. Record {topic.type} in {CDR} alone there."
                )


def _stamps(tally: Tally) -> Iterator[str]:
    if tally.unset:
        yield (
            f"{tally.name}: {tally.unset} of {tally.count} messages have no header.stamp and are left out. "
            "Let the driver set it."
        )
    yield from (f"{tally.name}: {sentence}" for sentence in spacing_faults(np.array(tally.stamps)))


_USUAL = Qos(reliability="reliable", durability="volatile", depth=100)


@dataclass(frozen=True, slots=True)
class Publishable:
    """Topic that can be published: its name, type and quality of service."""

    name: str
    type: str
    qos: Qos


def publishable(session: Session, names: Sequence[str] | None = None) -> list[Publishable]:
    """Return the topics with these names; without names, strokes and all inputs with messages.

    Raise BagError if a topic is missing, is empty, or is an input of another type.
    """
    topics = mapping_of(session.path).topics
    if names is None:  # a name of the mapping may be relative to a namespace
        chosen = {
            topic.name: check_topic(session, topic.name, topic.type)
            for stream, topic in topics.inputs.items()
            if stream is topics.stroke_reading.stream or session.count(topic.name)
        }
    else:
        found = [check_topic(session, name, getattr(session.find(name), "type", "")) for name in names]
        chosen = {topic.name: topic for topic in found}
    return [Publishable(name, topic.type, _qos(session, topic, topics)) for name, topic in chosen.items()]


def _qos(session: Session, topic: TopicInfo, topics: Topics) -> Qos:
    """Return the strongest QoS offered in the metadata, or else in the channels; by default the mapping's."""
    offered = [qos for value in _values(session, topic.name) for qos in profiles(value)]
    if not offered:
        known = (each for each in topics.inputs.values() if each.absolute == topic.name)
        return next((each.qos for each in known), _USUAL)
    return Qos(
        reliability="reliable" if any(qos.reliability == "reliable" for qos in offered) else "best_effort",
        durability="transient_local" if any(qos.durability == "transient_local" for qos in offered) else "volatile",
        depth=max(qos.depth for qos in offered),
    )


def _values(session: Session, name: str) -> list[Any]:
    if session.metadata is not None:
        entries = (entry.topic_metadata for entry in session.metadata.topics_with_message_count)
        return [entry.offered_qos_profiles for entry in entries if entry.name == name]
    channels = (channel for file in session.files for channel in file.channels.values() if channel.topic == name)
    return [channel.metadata.get("offered_qos_profiles", "") for channel in channels]


KINDS = {stream: kind.named for stream, kind in SENSORS.items() if kind.is_named and not kind.ends}


DRIVE_REMEDY = (
    "If this boom has no stroke transducers, write `drive: angles` in a mapping (--mapping; the node: parameter mapping)."
)


def refuse_conflicts(session: Session, topics: Topics, joints: int, scene: str = "") -> None:
    """Raise BagError if a session is of another boom than a scene, or lacks what drives the model; see `conflicts`."""
    for sentence in conflicts(session, topics, joints, scene):
        raise BagError(f"{session.path}: {sentence}")


def conflicts(session: Session, topics: Topics, joints: int, scene: str) -> Iterator[str]:
    """Yield an error sentence for each conflict between a session and a scene (of source `scene`) with `joints` joints.

    Angles without the strokes that drive the model are a conflict. Cylinders and joints beyond the scene are a conflict. A
    sensor that drives the model and is never named is a conflict, too: the prediction needs it. Other unknown or missing names
    are ignored.
    """
    drive, strokes, angles = topics.stroke_reading.stream, topics.inputs.get(Stream.STROKES), topics.inputs[Stream.ANGLES]
    if strokes is not None and (heard := session.count(angles.name)) and not session.count(strokes.name):
        yield f"no strokes ({strokes.absolute}), but {heard} messages of {angles.absolute}. {DRIVE_REMEDY}"
    names = _names_read(session, topics, joints)
    for stream, found in names.items():
        if beyond := topics.beyond(stream, joints, found):
            yield extra_names_message(topics.inputs[stream].absolute, beyond, stream, joints, scene)
    named = names.get(drive, {})
    lacking = [sensor.name for sensor in topics.sensors_of(drive, joints).values() if sensor.name not in named]
    if named and lacking:
        own = {sensor.name for sensor in topics.sensors_of(Stream.ANGLES, joints).values()}
        is_alone = topics.is_shared and len(lacking) == joints and own.issubset(named)
        yield (
            f"{topics.inputs[drive].absolute} never names {_listed(lacking)}, but {_listed(named)}; "
            f"{_scene(scene)} has {several(joints, KINDS[drive])}. Give that of this boom by --scene, or its names by "
            "--mapping." + (f" {DRIVE_REMEDY}" if is_alone else "")
        )


def extra_names_message(topic: str, names: Collection[str], stream: Stream, joints: int, scene: str) -> str:
    """Return the message, with remedy, for a topic that names cylinders or joints beyond those of the scene."""
    kind = KINDS[stream]
    return (
        f"{topic} names {_listed(names)}; {_scene(scene)} has {several(joints, kind)}, so this is another boom. "
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
    names_told = 12  # limit for the number of names in a sentence
    first = list(dict.fromkeys(names))
    return ", ".join(first[:names_told]) + (f" and {len(first) - names_told} more" if len(first) > names_told else "")


def _names_read(session: Session, topics: Topics, joints: int) -> dict[Stream, dict[str, None]]:
    """Return the names in messages of strokes and angles, read for 5 s and until all driving sensors are named."""
    heard = {name: [stream for stream in streams if stream in KINDS] for name, streams in topics.streams_by_topic.items()}
    present = {name: streams for name, streams in heard.items() if streams and session.count(name)}
    if not present:
        return {}
    found: dict[Stream, dict[str, None]] = {stream: {} for streams in present.values() for stream in streams}
    drive = topics.stroke_reading.stream
    needed = {sensor.name for sensor in topics.sensors_of(drive, joints).values()}
    blocks = read_blocks(session, {name: topics.inputs[streams[0]].type for name, streams in present.items()})
    decoders = [CdrDecoder(source.type) for source in blocks.sources]
    first: int | None = None
    for block in blocks:
        first = int(block.log_times[0]) if first is None else first
        for source, _, message in blocks.read_together(decoders, block):
            for stream in present[blocks.sources[source].name]:
                if len(found[stream]) < MOST_NAMES:
                    found[stream].update(dict.fromkeys(message.name[:MOST_NAMES]))
        if block.log_times[-1] - first > 5 * SECOND and needed <= found.get(drive, {}).keys():
            break
    return found
