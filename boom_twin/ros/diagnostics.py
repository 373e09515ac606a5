"""State of the node on ``/diagnostics`` (REP-107), once a second and on every change of level."""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from ..io.intake import Intake
from ..io.topics import Output, Topics
from ..records import Report, Stream
from ..twin import EVENTS, TOLD_AT_ONCE, Twin
from .input_watch import InputWatch, seconds
from .qos import qos_profile

TICK = 0.1  # s of steady time between looks at the state
PERIOD = 10  # ticks from one message to the next, where no level changes
HOLD = 1.0  # s by the node's clock for which a failure of the model is shown

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


class Diagnostics:
    """Watches the inputs and the model of one node; nothing is computed or logged for a single message.

    Parameters
    ----------
    node : Node
    topics : Topics
    """

    def __init__(self, node: Node, topics: Topics) -> None:
        self._node = node
        self._inputs = {stream: InputWatch(topic) for stream, topic in topics.inputs.items()}
        topic = topics.outputs[Output.DIAGNOSTICS]
        self._publisher = node.create_publisher(DiagnosticArray, topic.name, qos_profile(topic.qos))
        self._timer = node.create_timer(TICK, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._ticks, self._published = 0, self._now()
        self._levels: dict[str, bytes] = {}
        self._oddities_told: set[str] = set()
        self._twin: Twin | None = None
        self._intake: Intake | None = None
        self._scene = ""
        self._rest()

    def watch(self, twin: Twin, intake: Intake, scene: str) -> None:
        """The node is configured with these."""
        self._twin, self._intake, self._scene = twin, intake, scene
        self._oddities_told.clear()

    def start(self) -> None:
        """The node is active: from now on an input that is silent is stale."""
        self._rest()
        self._active = True
        for entry in self._inputs.values():
            entry.begin(self._now())

    def stop(self) -> None:
        """The node is active no more."""
        self._active = False

    def seen(self, stream: Stream, stamp: int) -> None:
        """A message came."""
        self._inputs[stream].seen(stamp)

    def reported(self, report: Report) -> None:
        """The twin took a sample."""
        if report.prediction is not None:
            self._predictions += 1
        elif report.status != "ok":
            self._fail(report.status)

    def broken(self, stream: Stream, error: Exception) -> None:
        """A message could not be handled at all."""
        self._broken += 1
        self._fail(f"a message of {stream.value} could not be handled: {type(error).__name__}: {error}")

    def _rest(self) -> None:
        self._active = False
        self._predictions = self._broken = 0
        self._failure = ""
        self._failed_at = 0.0

    def _fail(self, reason: str) -> None:
        self._failure, self._failed_at = reason, self._now()

    def _now(self) -> float:
        """Seconds of the node's clock."""
        return float(self._node.get_clock().now().nanoseconds) * 1e-9

    def _tick(self) -> None:
        now = self._now()
        for entry in self._inputs.values():
            entry.look(now)
        self._tell_oddities()
        self._ticks += 1
        due = self._ticks >= PERIOD
        if due:
            self._ticks = 0
            for entry in self._inputs.values():
                entry.count_rate(now - self._published)
            self._published = now
        statuses = [self._model(now), *(self._input(entry, now) for entry in self._inputs.values())]
        if self._tell_changes(statuses) or due:
            message = DiagnosticArray(status=statuses)
            message.header.stamp = self._node.get_clock().now().to_msg()
            self._publisher.publish(message)

    def _model(self, now: float) -> DiagnosticStatus:
        """State of the twin, with all its counts."""
        level, message = self._judge(now)
        newest = self._inputs[Stream.STROKES].newest
        values: dict[str, Any] = {
            "scene": self._scene,
            "predictions": self._predictions,
            "newest stroke stamp": seconds(newest),
            "unhandled messages": self._broken,
        }
        if self._twin is not None and self._intake is not None:
            values |= {f"samples: {name}": self._twin.counts[name] for name in EVENTS}
            values |= {f"messages: {name}": count for name, count in sorted(self._intake.oddities.items())}
        return self._status("model", level, message, values)

    def _judge(self, now: float) -> tuple[bytes, str]:
        if not self._active:
            return WARN, "not active"
        if self._failure and 0.0 <= now - self._failed_at <= HOLD:
            return ERROR, self._failure
        if self._predictions == 0 or self._inputs[Stream.STROKES].is_silent(now):
            return WARN, "waiting for strokes"
        return OK, "following the strokes"

    def _input(self, entry: InputWatch, now: float) -> DiagnosticStatus:
        """State of one input topic."""
        topic = self._node.resolve_topic_name(entry.topic.name)
        return self._status(entry.topic.name, *entry.judge(self._active, now), {"topic": topic, **entry.values()})

    def _status(self, name: str, level: bytes, message: str, values: dict[str, Any]) -> DiagnosticStatus:
        return DiagnosticStatus(
            name=f"{self._node.get_name()}: {name}",
            hardware_id="",
            level=level,
            message=message,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )

    def _tell_changes(self, statuses: list[DiagnosticStatus]) -> bool:
        """Log every change of level; whether there was one."""
        before, self._levels = self._levels, {status.name: status.level for status in statuses}
        changed = [status for status in statuses if before.get(status.name, status.level) != status.level]
        for status in changed:
            if status.level == OK:
                self._node.get_logger().info(f"{status.name}: {status.message}")
            else:
                self._node.get_logger().warning(f"{status.name}: {status.message}")
        return bool(changed)

    def _tell_oddities(self) -> None:
        """Log the first sample of every kind that is out of the ordinary; all of them are counted."""
        if self._twin is None or self._intake is None:
            return
        for name in sorted({*self._twin.counts, *self._intake.oddities} - self._oddities_told - TOLD_AT_ONCE):
            self._oddities_told.add(name)
            meaning = EVENTS.get(name, "seen in a message")
            self._node.get_logger().warning(f"{name}: {meaning} (told once; counted on /diagnostics)")
