"""A topic that is to be recorded, and how it is subscribed to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ..errors import UsageError
from ..io.bagmeta import dump, offered_qos
from ..io.recorded import Recorded
from ..io.topics import NODE, Qos, Topic, Topics
from ..io.typestore import jazzy
from ..io.writer import recorded
from ..plain import plain
from ..retouch import with_value
from .definition import definition_of, full_name, installed_class
from .qos import qos_profile

DEPTH = 4000
"""Messages that may wait for the recorder, for every topic: seconds of a session."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """One topic.

    Attributes
    ----------
    name : str
        Absolute.
    type : str or None
        None: that of its first publisher.
    topic : Topic or None
        Where ``topics.yaml`` has it.
    """

    name: str
    type: str | None = None
    topic: Topic | None = None

    @property
    def required(self) -> bool:
        """Whether recording is complete only with a publisher of it."""
        return self.topic is None or self.topic.required


@dataclass(frozen=True, slots=True)
class Found:
    """How a topic is subscribed to and how it stands in the bag."""

    kind: Any
    qos: QoSProfile
    recorded: Recorded


def wanted_of(names: Sequence[str], known: Mapping[str, Topic]) -> list[Wanted]:
    """Topics from the words of a command line: ``NAME`` or ``NAME:package/msg/Name``.

    Parameters
    ----------
    names : sequence of str
    known : dict of str to Topic
        By absolute name.

    Raises
    ------
    UsageError
        A type is not installed, or a topic is named twice.
    """
    found: dict[str, Wanted] = {}
    for text in names:
        name, _, type_name = text.partition(":")
        name = "/" + name.lstrip("/")
        if name in found:
            raise UsageError(f"topic {name} is named twice. Name it once.")
        topic = known.get(name)
        if type_name:
            type_name = full_name(installed_class(type_name))
            topic = topic if topic is not None and topic.type == type_name else None
        found[name] = Wanted(name, type_name or (topic.type if topic else None), topic)
    return list(found.values())


def resolved(wanted: Wanted, node: Any) -> Wanted:
    """The topic by the name that it has in the namespace of `node`, with its remappings.

    A name private to the twin is taken to be that of the node ``boom_twin`` there.
    """
    if wanted.topic is None:
        return replace(wanted, name=node.resolve_topic_name(wanted.name))
    topic = resolved_topic(wanted.topic, node)
    return replace(wanted, name=topic.absolute, topic=topic)


def resolved_topic(topic: Topic, node: Any) -> Topic:
    """Likewise of a topic of a mapping."""
    return topic.model_copy(update={"name": node.resolve_topic_name(topic.name.replace("~", NODE, 1))})


def resolved_mapping(text: str, topics: Topics, node: Any) -> str:
    """Text of a mapping that says what `text` does, with all names of `topics` as `resolved` has them."""
    places: dict[tuple[str, ...], Topic] = {("inputs", stream.value): topic for stream, topic in topics.inputs.items()}
    places |= {("outputs", key.value): topic for key, topic in topics.outputs.items()} | {("events",): topics.events}
    for place, topic in places.items():
        name = resolved_topic(topic, node).absolute
        if name != topic.absolute:
            text = with_value(text if plain(text) else "{}", (*place, "name"), name)
    return text


def subscription_of(node: Any, wanted: Wanted) -> Found | None:
    """How to subscribe; None as long as the type is not known.

    Raises
    ------
    UsageError
        The type is not installed, or its publishers have several.
    """
    if wanted.topic is not None:
        topic = wanted.topic
        return Found(installed_class(topic.type), qos_profile(topic.qos, DEPTH), recorded(topic))
    publishers = node.get_publishers_info_by_topic(wanted.name)
    types = {wanted.type} if wanted.type else {each.topic_type for each in publishers}
    if len(types) > 1:
        raise UsageError(f"topic {wanted.name} has publishers of {', '.join(sorted(types))}. Choose: {wanted.name}:TYPE.")
    if not publishers or not types:
        return None
    kind = installed_class(types.pop())
    qos = _qos([each.qos_profile for each in publishers])
    return Found(kind, qos_profile(qos, DEPTH), _recorded(wanted.name, kind, qos, publishers[0]))


def _qos(offered: list[QoSProfile]) -> Qos:
    """What every publisher can serve."""
    is_reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in offered)
    is_kept = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offered)
    return Qos(
        reliability="reliable" if is_reliable else "best_effort",
        durability="transient_local" if is_kept else "volatile",
        depth=min(max(max(each.depth for each in offered), 1), 10_000),
    )


def _recorded(name: str, kind: Any, qos: Qos, publisher: Any) -> Recorded:
    type_name, offered = full_name(kind), offered_qos(qos)
    known = type_name in jazzy().types
    type_hash = jazzy().hash_rihs01(type_name) if known else str(publisher.topic_type_hash)
    details = {"offered_qos_profiles": dump(offered), "topic_type_hash": type_hash}
    return Recorded(name, type_name, definition_of(kind).encode(), details, offered, type_hash)
