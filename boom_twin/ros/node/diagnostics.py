"""Publish the node's state on ``/diagnostics``, log irregular samples once, and check the peers of its topics."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import cycle
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.duration import Infinite
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSCompatibility, QoSProfile, qos_check_compatible

from ...bag.advice import extra_names_message, strange_names_message
from ...config.settings import Thresholds
from ...diagnostics.levels import Level, Value
from ...diagnostics.sensor_status import sensors_of
from ...diagnostics.topic_status import Peers
from ...diagnostics.twin_status import TwinWatch
from ...messages.sample_decoder import ODDITIES, SampleDecoder
from ...messages.topic_table import Output, Topic, Topics
from ...predictions import Clock as StreamClock
from ...twin.blocks import EVENTS, TOLD_AT_ONCE
from ...twin.twin import Twin
from ...types import NANO, Stream
from ..receive import LARGEST, ReceiveQueue
from ..runtime import DiagnosticsPublisher, Log, node_name, qos_profile


class GraphPeers:
    """Peers (publishers or subscribers) of every topic of `node`, looked up one topic per call.

    Discovery is used because the events of incompatible QoS do not name the peer and do not report when it leaves.
    """

    def __init__(self, node: Node, topics: Topics) -> None:
        self._node = node
        self.publishers = dict.fromkeys(topics.inputs, Peers())  # peers of the inputs
        self.subscribers = dict.fromkeys(topics.outputs, Peers())  # peers of the outputs
        entries: list[tuple[Stream | Output, Topic]] = [*topics.inputs.items(), *topics.outputs.items()]
        self._entries = cycle([(key, topic, _as_discovered(qos_profile(topic.qos))) for key, topic in entries])

    def look(self) -> None:
        """Look up the next topic."""
        key, topic, own = next(self._entries)
        address = self._node.resolve_topic_name(topic.name)
        if isinstance(key, Stream):
            ends = self._node.get_publishers_info_by_topic(address)
            self.publishers[key] = _peers(address, topic.type, [(end, end.qos_profile, own) for end in ends])
        else:
            ends = self._node.get_subscriptions_info_by_topic(address)
            found = _peers(address, topic.type, [(end, own, end.qos_profile) for end in ends])
            mine = sum(publisher.topic_name == address for publisher in self._node.publishers)
            others = 0 if key is Output.DIAGNOSTICS else self._node.count_publishers(address) - mine
            self.subscribers[key] = replace(found, rivals=max(0, others))


def _as_discovered(qos: QoSProfile) -> QoSProfile:
    """Return the node's own QoS as discovery reports it to peers: default durations are infinite."""
    qos.deadline = qos.lifespan = qos.liveliness_lease_duration = Infinite
    qos.liveliness = LivelinessPolicy.AUTOMATIC
    return qos


def _peers(address: str, kind: str, ends: list[tuple[Any, QoSProfile, QoSProfile]]) -> Peers:
    """Return the `Peers` of a topic with message type `kind`; `ends`: endpoint, offered QoS and requested QoS of each peer."""
    strange = tuple(f"{node_name(end)}: {end.topic_type}, not {kind}" for end, _, _ in ends if end.topic_type != kind)
    ends = [each for each in ends if each[0].topic_type == kind]
    faults = [(node_name(end), _reason(offered, asked)) for end, offered, asked in ends]
    names, ids = tuple(name for name, _ in faults), tuple(bytes(end.endpoint_gid).hex() for end, _, _ in ends)
    incompatible = tuple(f"{name}: {reason}" for name, reason in faults if reason)
    return Peers(address, names, incompatible, ids, mistyped=strange)


def _reason(offered: QoSProfile, asked: QoSProfile) -> str:
    """Return the reason of a QoS incompatibility, or an empty string."""
    verdict, reason = qos_check_compatible(offered, asked)
    return str(reason).removeprefix("ERROR: ").rstrip(";") if verdict == QoSCompatibility.ERROR else ""


class ClockCheck:
    """Comparison of the newest stamp with a clock."""

    def __init__(self) -> None:
        self._was_apart, self._newest, self._since = False, 0, 0.0

    def apart(self, clock: float, newest: int, tolerance: float, now: float) -> float:
        """Return the lead (s) of `clock` (s) over the `newest` stamp (ns) if two checks in a row exceed the tolerance; else 0.

        Two checks are needed because the stamps and the clock of a looping bag jump at different moments. While no sample
        arrives, the tolerance grows with the monotonic time `now` (s).
        """
        if newest != self._newest:
            self._newest, self._since = newest, now
        apart, before = clock - newest * NANO, self._was_apart
        self._was_apart = abs(apart) > tolerance + now - self._since
        return apart if self._was_apart and before else 0.0


WORDS = {**EVENTS, **ODDITIES, "too large": f"a message of more than {LARGEST >> 10} KiB, which is left out"}
"""Descriptions logged with the first irregular sample of each kind."""
NOT_ACTIVE, PREPARING = "not active", "preparing the model"
TICK = 0.1  # s of steady time between checks for an urgent state
PERIOD = 1.0  # s between diagnostics messages if nothing is urgent


class Diagnostics:
    """Diagnostics of one node, computed and logged periodically and never per message."""

    def __init__(self, node: Node, topics: Topics, queue: ReceiveQueue) -> None:
        self._node, self._logger, self._queue = node, Log(node), queue
        self._inputs = {stream: topic.name for stream, topic in topics.inputs.items()}
        self._required = {stream: topic.required for stream, topic in topics.inputs.items()}
        hardware_id = node.get_parameter("hardware_id").value
        self._publisher = DiagnosticsPublisher(node, topics.outputs[Output.DIAGNOSTICS], hardware_id)
        self._peers = GraphPeers(node, topics)
        self._timer = node.create_timer(TICK, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._is_peers_turn = False
        self._due, self._active = time.monotonic() + PERIOD, False
        self._preparing_since: float | None = None
        self.watch = TwinWatch({}, {}, Thresholds())  # receives the twin's events. Every `configure` replaces it
        self._counts: dict[str, Mapping[str, int]] = {}
        self._lags: Callable[[], Mapping[Stream, StreamClock]] = dict
        self._decoder: SampleDecoder | None = None
        self._scene, self._joints = "", 0
        self._told: set[str] = set()
        self._clock = ClockCheck()

    def prepare(self) -> None:
        """Report from now on that the model is being prepared, until `configure` or `stop`."""
        self._preparing_since = time.monotonic()

    def configure(self, twin: Twin, decoder: SampleDecoder, scene: str) -> None:
        """Watch a newly configured twin."""
        sensors = sensors_of(twin.plan.joints, self._required, twin.absent)
        self._lags = lambda: twin.clocks
        self.watch = TwinWatch(sensors, self._inputs, self.watch.thresholds)
        self._queue.oddities.clear()
        self._counts = {"samples": twin.counts, "messages": decoder.oddities, "received": self._queue.oddities}
        self._scene, self._joints, self._decoder = scene, twin.plan.joints, decoder
        self._told.clear()
        self._preparing_since = None

    def start(self) -> None:
        """Start watching when the node becomes active. From now on a silent input is stale."""
        self.watch.begin()
        self._active = True

    def stop(self) -> None:
        """Stop watching when the node becomes inactive."""
        self._active = False

    def _tick(self) -> None:
        """Look up the peers of one topic at every second call, and check everything if that is due."""
        self._is_peers_turn = not self._is_peers_turn
        if self._is_peers_turn:
            self._peers.look()
        now = time.monotonic()
        if now >= self._due - 0.5 * TICK or (self._active and self.watch.is_urgent()):
            self._due = now + PERIOD
            self._look()

    def _look(self) -> None:
        clock = self._node.get_clock().now().nanoseconds * NANO
        told: dict[str, Value] = {"scene": self._scene}
        told |= {f"{kind}: {name}": count for kind, found in self._counts.items() for name, count in sorted(found.items())}
        for stream, each in self._lags().items():
            told |= {f"{stream.value} lag_s": each.lag, f"{stream.value} lag_sigma_s": each.lag_sigma}
            told[f"{stream.value} clock_drift_ppm"] = 1e6 * each.drift
        peers = self._peers
        wrong, received = self._wrong_names(), self._queue.look()
        ends = peers.publishers, peers.subscribers.values()
        since, idle = self._preparing_since, "" if self._active else NOT_ACTIVE
        if since is not None:
            idle, told["preparing_s"] = PREPARING, time.monotonic() - since
        found = self.watch.look(told, idle, *ends, clock, received, wrong, WORDS)
        self._tell_oddities()  # whoever sees a count finds its line in the log
        self._publisher.show(found)
        self._tell_types()
        self._tell_clock(clock, max((each.wait for each in received.values() if each.wait > 0.0), default=0.0))

    def _wrong_names(self) -> dict[Stream, tuple[Level, str]]:
        """Return level and message of every input that named cylinders or joints unknown to the scene since the last check."""
        decoder, found = self._decoder, dict[Stream, tuple[Level, str]]()
        if decoder is None:
            return found
        for stream, (lacking, strange) in decoder.strange_names.items():
            told = strange_names_message(self._inputs[stream], lacking, strange)
            found[stream] = (Level.ERROR if len(lacking) == self._joints else Level.WARN, told)
        for stream, names in decoder.other_boom_names.items():
            found[stream] = Level.ERROR, extra_names_message(self._inputs[stream], names, stream, self._joints, self._scene)
        decoder.strange_names.clear()
        decoder.other_boom_names.clear()
        return found

    def _tell_oddities(self) -> None:
        """Log the first irregular sample of every kind. All are counted on ``/diagnostics``."""
        for name in sorted({name for found in self._counts.values() for name in found} - TOLD_AT_ONCE):
            self._tell(name, f"{name}: {WORDS.get(name, 'seen in a message')} (told once; counted on /diagnostics)")

    def _tell_types(self) -> None:
        """Warn of publishers with another message type. They cannot be received, and the input's level does not show them."""
        for each in self._peers.publishers.values():
            if each.mistyped:
                self._tell(f"type of {each.address}", f"{each.address}: another type of message: {'; '.join(each.mistyped)}")

    def _tell_clock(self, clock: float, wait: float) -> None:
        """Warn if the stroke stamps do not follow the node's clock; `wait` (s) is the longest time a message was queued."""
        newest, is_simulated = self.watch.newest if self._active else None, self._node.get_parameter("use_sim_time").value
        if newest is None:
            return
        if clock == 0.0:
            told = "use_sim_time is set and no /clock came yet: play with --clock, or set use_sim_time to false"
            self._tell("no clock", told)
        elif apart := self._clock.apart(clock, newest, self.watch.thresholds.stamp_offset + wait, time.monotonic()):
            own = "the node's clock: set use_sim_time or play with --clock"
            own = "/clock: is this the clock of what is played?" if is_simulated else own
            self._tell("clock", f"newest stamp is {apart:.1f} s from {own}")

    def _tell(self, name: str, text: str) -> None:
        """Log a warning once."""
        if name not in self._told:
            self._told.add(name)
            self._logger.warning(text)
