"""What of a session can be published, and with what quality of service it was offered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import BagError
from ..records import Stream
from .offered import profiles
from .reader import Session, TopicInfo, check_topic
from .session_model import mapping_of
from .topics import Qos, Topics

_USUAL = Qos(reliability="reliable", durability="volatile", depth=100)


@dataclass(frozen=True, slots=True)
class Publishable:
    """One topic: name as it is published under, type, quality of service."""

    name: str
    type: str
    qos: Qos


def publishable(session: Session, names: Sequence[str] | None = None) -> list[Publishable]:
    """The topics of those names; without names the session's inputs: strokes, and what else has messages.

    Raises
    ------
    BagError
        One of them is not there, empty, or an input of another type.
    """
    topics = mapping_of(session.path).topics
    if names is None:
        chosen = _inputs(session, topics)
    else:
        found = [check_topic(session, name, _type(session, name)) for name in names]
        chosen = {topic.name: topic for topic in found}
    return [Publishable(name, topic.type, _qos(session, topic, topics)) for name, topic in chosen.items()]


def _inputs(session: Session, topics: Topics) -> dict[str, TopicInfo]:
    """By the names of the mapping, which may be relative and so be put into a namespace."""
    found: dict[str, TopicInfo] = {}
    for stream, topic in topics.inputs.items():
        info = session.find(topic.name)
        if stream is Stream.STROKES or (info is not None and info.count):
            found[topic.name] = check_topic(session, topic.name, topic.type)
    return found


def _type(session: Session, name: str) -> str:
    """The type of a topic; of one that is not there nothing is known, which `check_topic` tells."""
    info = session.find(name)
    if info is not None and info.type.count("/") != 2:
        raise BagError(f"{session.path}: topic {info.name} has type {info.type!r}: no message of ROS 2. Leave it out.")
    return info.type if info else ""


def _qos(session: Session, topic: TopicInfo, topics: Topics) -> Qos:
    """What was offered by the metadata, else by the channels, else as the mapping has it; the strongest of several."""
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
