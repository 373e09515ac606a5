"""A topic that is to be recorded, and how it is subscribed to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ..errors import UsageError
from ..io.bagmeta import dump, offered_qos
from ..io.recorded import Recorded
from ..io.topics import Qos, Topic
from ..io.typestore import jazzy
from ..io.writer import recorded
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
