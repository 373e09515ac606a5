"""Who is at the other ends of the node's topics, and what keeps the two ends from hearing each other."""

from __future__ import annotations

from itertools import cycle
from typing import Any

from rclpy.duration import Infinite
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSCompatibility, QoSProfile, qos_check_compatible

from ..io.topics import Output, Topic, Topics
from ..records import Stream
from ..watch.peers import Peers
from .qos import qos_profile


class PeerBook:
    """The other ends of every topic of `node`, one topic looked up at a time.

    Discovery is asked, and not only the events of incompatible QoS: those do not tell who it was, nor that it has gone.

    Attributes
    ----------
    publishers : dict of Stream to Peers
        Of the inputs.
    subscribers : dict of Output to Peers
        Of the outputs.
    """

    def __init__(self, node: Node, topics: Topics) -> None:
        self._node = node
        self.publishers = dict.fromkeys(topics.inputs, Peers())
        self.subscribers = dict.fromkeys(topics.outputs, Peers())
        entries: list[tuple[Stream | Output, Topic]] = [*topics.inputs.items(), *topics.outputs.items()]
        self._entries = cycle([(key, topic.name, _as_discovered(qos_profile(topic.qos))) for key, topic in entries])

    def look(self) -> None:
        """Look up the next topic."""
        key, name, own = next(self._entries)
        address = self._node.resolve_topic_name(name)
        if isinstance(key, Stream):
            ends = self._node.get_publishers_info_by_topic(address)
            self.publishers[key] = _peers(address, [(end, end.qos_profile, own) for end in ends])
        else:
            ends = self._node.get_subscriptions_info_by_topic(address)
            self.subscribers[key] = _peers(address, [(end, own, end.qos_profile) for end in ends])


def _as_discovered(qos: QoSProfile) -> QoSProfile:
    """Own QoS as the other ends see it: what is left to the default is none."""
    qos.deadline = qos.lifespan = qos.liveliness_lease_duration = Infinite
    qos.liveliness = LivelinessPolicy.AUTOMATIC
    return qos


def _peers(address: str, ends: list[tuple[Any, QoSProfile, QoSProfile]]) -> Peers:
    """From the other ends, and the QoS offered and asked for."""
    faults = [(node_name(end), _reason(offered, asked)) for end, offered, asked in ends]
    names, ids = tuple(name for name, _ in faults), tuple(bytes(end.endpoint_gid).hex() for end, _, _ in ends)
    return Peers(address, names, tuple(f"{name}: {reason}" for name, reason in faults if reason), ids)


def _reason(offered: QoSProfile, asked: QoSProfile) -> str:
    """Why the two do not fit; empty if they do."""
    verdict, reason = qos_check_compatible(offered, asked)
    return str(reason).removeprefix("ERROR: ").rstrip(";") if verdict == QoSCompatibility.ERROR else ""


def node_name(endpoint: Any) -> str:
    """Namespace and name of the node of a publisher or subscriber that was discovered."""
    if "UNKNOWN" in endpoint.node_name:  # so rmw calls a node that it has not heard of
        return "a node without a known name"
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"
