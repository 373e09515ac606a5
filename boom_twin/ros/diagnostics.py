"""State of the node on ``/diagnostics``, once a second and as soon as the model fails or an input falls silent."""

from __future__ import annotations

import time
from collections.abc import Mapping

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from ..io.boom_names import told_beyond
from ..io.intake import Intake
from ..io.topics import Output, Topics
from ..records import Report, Sample, Stream
from ..thresholds import Thresholds
from ..twin import EVENTS, TOLD_AT_ONCE, Twin
from ..watch.sensors import sensors_of
from ..watch.twin import TwinWatch
from .board import Board
from .log import Log
from .peers import PeerBook
from .receive_queue import ReceiveQueue

TICK = 0.1  # s of steady time between looks at whether something is urgent
PERIOD = 1.0  # s from one message to the next, where nothing is
NANO = 1e-9


class Diagnostics:
    """Watches one node; nothing is computed or logged for a single message.

    Parameters
    ----------
    node : Node
    topics : Topics
    queue : ReceiveQueue
        Of the inputs.
    """

    def __init__(self, node: Node, topics: Topics, queue: ReceiveQueue) -> None:
        self._node, self._logger, self._queue = node, Log(node), queue
        self._inputs = {stream: topic.name for stream, topic in topics.inputs.items()}
        self._required = {stream: topic.required for stream, topic in topics.inputs.items()}
        self._board = Board(node, topics.outputs[Output.DIAGNOSTICS])
        self._peers = PeerBook(node, topics)
        self._timer = node.create_timer(TICK, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._due, self._active = time.monotonic() + PERIOD, False
        self._watch = TwinWatch({}, {}, Thresholds())
        self._counts: dict[str, Mapping[str, int]] = {}
        self._scene, self._joints = "", 0
        self._strangers: dict[Stream, list[str]] = {}
        self._told: set[str] = set()

    def watch(self, twin: Twin, intake: Intake, scene: str) -> None:
        """The node is configured with these."""
        sensors = sensors_of(twin.scene, twin.settings, self._required, twin.mounts)
        self._watch = TwinWatch(sensors, self._inputs, self._watch.thresholds)
        self._counts = {"samples": twin.counts, "messages": intake.oddities}
        self._scene, self._joints, self._strangers = scene, twin.plan.joints, intake.strangers
        self._told.clear()

    def tune(self, thresholds: Thresholds) -> None:
        """Judge by these from now on."""
        self._watch.thresholds = thresholds

    def start(self) -> None:
        """The node is active: from now on an input that is silent is stale."""
        self._watch.begin()
        self._active = True

    def stop(self) -> None:
        """The node is active no more."""
        self._active = False

    def seen(self, stream: Stream, stamp: int) -> None:
        """A message came."""
        self._watch.seen(stream, stamp)

    def took(self, sample: Sample, report: Report, duration: float) -> None:
        """The twin made `report` of `sample` in so many seconds."""
        self._watch.took(sample, report, duration)

    def acknowledge(self) -> str:
        """Somebody has seen the alarms of the rig's health; says which of them ended and are let go."""
        health = self._watch.health
        return "health is not judged" if health is None else health.acknowledge()

    def broken(self, stream: Stream, error: Exception) -> None:
        """A message could not be handled at all."""
        self._watch.broken(f"a message of {stream.value} could not be handled: {type(error).__name__}: {error}")

    def _tick(self) -> None:
        """Look up one topic's other ends; look at everything, if it is due."""
        self._peers.look()
        now = time.monotonic()
        if now >= self._due - 0.5 * TICK or (self._active and self._watch.is_urgent()):
            self._due = now + PERIOD
            self._look()

    def _look(self) -> None:
        clock = self._node.get_clock().now().nanoseconds * NANO
        told: dict[str, str | int] = {"scene": self._scene}
        told |= {f"{kind}: {name}": count for kind, found in self._counts.items() for name, count in sorted(found.items())}
        peers = self._peers
        others, received = self._other_booms(), self._queue.look()
        ends = peers.publishers, peers.subscribers.values()
        self._board.show(self._watch.look(told, self._active, *ends, clock, received, others))
        self._tell_oddities()
        self._tell_clock(clock)

    def _other_booms(self) -> dict[Stream, str]:
        """The inputs that named cylinders or joints of another boom since the last look, in words."""
        found = {
            stream: told_beyond(self._inputs[stream], names, stream, self._joints, self._scene)
            for stream, names in self._strangers.items()
        }
        self._strangers.clear()
        return found

    def _tell_oddities(self) -> None:
        """Log the first sample of every kind that is out of the ordinary; all of them are counted."""
        for name in sorted({name for found in self._counts.values() for name in found} - TOLD_AT_ONCE):
            self._tell(name, f"{name}: {EVENTS.get(name, 'seen in a message')} (told once; counted on /diagnostics)")

    def _tell_clock(self, clock: float) -> None:
        """Log that the strokes are stamped by another clock than the node's."""
        newest = self._watch.newest if self._active else None
        if newest is not None and abs(clock - newest * NANO) > self._watch.thresholds.stamp_offset:
            apart = clock - newest * NANO
            self._tell("clock", f"newest stamp is {apart:.1f} s from the node's clock: set use_sim_time or play with --clock")

    def _tell(self, name: str, text: str) -> None:
        """Log something once."""
        if name not in self._told:
            self._told.add(name)
            self._logger.warning(text)
