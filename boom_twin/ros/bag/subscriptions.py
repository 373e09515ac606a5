"""Subscriptions of the recorder: topics, QoS and type definitions."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ...bag.metadata import Recorded
from ...bag.writer import recorded
from ...config.yaml_text import with_values
from ...errors import UsageError
from ...messages.topic_table import NODE, Qos, Topic, Topics
from ...messages.type_store import jazzy
from ..runtime import message_class, qos_profile

_BASE = {"double": "float64", "float": "float32", "boolean": "bool", "octet": "byte"}
_EMPTY = "uint8 structure_needs_at_least_one_member\n"  # field of an empty message in CDR
_RULE = "=" * 80


def installed_class(type_name: str) -> Any:
    """Return the class of ``package/msg/Name`` or ``package/Name``.

    Raise UsageError if the type is not installed or not a message type.
    """
    parts = type_name.split("/")
    full = f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else type_name
    try:
        return message_class(full)
    except (ImportError, AttributeError, ValueError) as error:
        raise UsageError(
            f"type {type_name!r}: not an installed message type ({error}). Write package/msg/Name, and install the "
            "package or source its workspace."
        ) from error


def full_name(kind: Any) -> str:
    """Return ``package/msg/Name`` of a class."""
    package, folder = kind.__module__.split(".")[:2]
    return f"{package}/{folder}/{kind.__name__}"


def definition_of(kind: Any) -> str:
    """Return the definition of a class and all its types. Types outside ROS 2 Jazzy's own packages have fields only."""
    name = full_name(kind)
    if name in jazzy().types:
        return str(jazzy().generate_msgdef(name, ros_version=2)[0])
    texts: dict[str, str] = {}
    waiting = [name]
    while waiting:
        current = waiting.pop(0)
        if current not in texts:
            texts[current], inner = _fields(message_class(current))
            waiting += inner
    first, *others = texts
    return texts[first] + "".join(f"{_RULE}\nMSG: {other.replace('/msg/', '/')}\n{texts[other]}" for other in others)


def _fields(kind: Any) -> tuple[str, list[str]]:
    """Return one line for each field, and the types in them."""
    lines, inner = [], []
    for name, described in kind.get_fields_and_field_types().items():
        text = _spelled(described)
        lines.append(f"{text} {name}\n")
        package, slash, element = text.partition("[")[0].partition("/")
        inner += [f"{package}/msg/{element}"] if slash else []
    return "".join(lines) or _EMPTY, inner


def _spelled(described: str) -> str:
    """Return a field's type as a .msg file writes it."""
    text = re.sub(r"^sequence<([^,]+)(?:, (\d+))?>$", lambda m: f"{m[1]}[{'<=' + m[2] if m[2] else ''}]", described)
    text = re.sub(r"^(w?string)<(\d+)>", r"\1<=\2", text)
    return re.sub(rf"^({'|'.join(_BASE)})\b", lambda m: _BASE[m[1]], text)


@dataclass(frozen=True, slots=True)
class RequestedTopic:
    """Topic to record."""

    name: str  # absolute name
    type: str | None = None  # None for the type of its first publisher
    topic: Topic | None = None  # entry of ``topics.yaml``, if any

    @property
    def required(self) -> bool:
        """Return True if recording is complete only with a publisher of this topic."""
        return self.topic is None or self.topic.required


def requested_topics(names: Sequence[str], known: Mapping[str, Topic]) -> list[RequestedTopic]:
    """Return the topics named on a command line: ``NAME`` or ``NAME:package/msg/Name``.

    Raise UsageError if a type is not installed, or a topic is named twice.
    """
    found: dict[str, RequestedTopic] = {}
    for text in names:
        name, _, type_name = text.partition(":")
        name = "/" + name.lstrip("/")
        if name in found:
            raise UsageError(f"topic {name} is named twice. Name it once.")
        topic = known.get(name)
        if type_name:
            type_name = full_name(installed_class(type_name))
            topic = topic if topic is not None and topic.type == type_name else None
        found[name] = RequestedTopic(name, type_name or (topic.type if topic else None), topic)
    return list(found.values())


def resolved(wanted: RequestedTopic, node: Any) -> RequestedTopic:
    """Return a requested topic by its name in the namespace of `node`, with the node's remappings.

    A name private to the twin belongs to the node ``boom_twin`` there.
    """
    if wanted.topic is None:
        return replace(wanted, name=node.resolve_topic_name(wanted.name))
    topic = resolved_topic(wanted.topic, node)
    return replace(wanted, name=topic.absolute, topic=topic)


def resolved_topic(topic: Topic, node: Any) -> Topic:
    """Return a topic of a mapping by its name in the namespace of `node`, with the node's remappings."""
    return topic.model_copy(update={"name": node.resolve_topic_name(topic.name.replace("~", NODE, 1))})


def resolved_mapping(text: str, topics: Topics, node: Any) -> str:
    """Return the mapping `text` with all names of `topics` resolved by `resolved_topic`."""
    places: dict[tuple[str, ...], Topic] = {("inputs", stream.value): topic for stream, topic in topics.inputs.items()}
    places |= {("outputs", key.value): topic for key, topic in topics.outputs.items()} | {("events",): topics.events}
    for place, topic in places.items():
        name = resolved_topic(topic, node).absolute
        if name != topic.absolute:
            text = with_values(text, [((*place, "name"), name)])
    return text


def subscription_of(node: Any, wanted: RequestedTopic) -> tuple[Any, QoSProfile, Recorded] | None:
    """Return message class, QoS and entry in the bag of a topic, or None while its type is unknown.

    Raise UsageError if the type is not installed, or publishers differ in type.
    """
    depth = 4000  # queue of every topic, messages: some seconds of a session
    if wanted.topic is not None:
        topic = wanted.topic
        return installed_class(topic.type), qos_profile(topic.qos, depth), recorded(topic)
    publishers = node.get_publishers_info_by_topic(wanted.name)
    types = {wanted.type} if wanted.type else {each.topic_type for each in publishers}
    if len(types) > 1:
        raise UsageError(f"topic {wanted.name} has publishers of {', '.join(sorted(types))}. Choose: {wanted.name}:TYPE.")
    if not publishers or not types:
        return None
    kind = installed_class(types.pop())
    type_name, qos = full_name(kind), _qos([each.qos_profile for each in publishers])
    is_known = type_name in jazzy().types
    type_hash = jazzy().hash_rihs01(type_name) if is_known else str(publishers[0].topic_type_hash)
    described = Recorded.offered(wanted.name, type_name, definition_of(kind), qos, type_hash)
    return kind, qos_profile(qos, depth), described


def _qos(offered: list[QoSProfile]) -> Qos:
    """Return the QoS that every publisher can serve."""
    is_reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in offered)
    is_kept = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offered)
    return Qos(
        reliability="reliable" if is_reliable else "best_effort",
        durability="transient_local" if is_kept else "volatile",
        depth=min(max(max(each.depth for each in offered), 1), 10_000),
    )
